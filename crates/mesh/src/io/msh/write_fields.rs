//! Fields in the sections that all versions share: `$NodeData`, `$ElementData`, `$ElementNodeData`.

use super::writer::Writer;
use crate::io::loss::Losses;
use crate::mesh::{Field, Support, Values};

impl Writer<'_> {
    /// The fields; `point_tag` gives the number of a point in the file, `keep_cells` is whether cells keep theirs.
    pub fn fields(
        &mut self,
        point_tag: impl Fn(u32) -> u64,
        keep_cells: bool,
        losses: &mut Losses,
    ) {
        let mesh = self.mesh;
        let on_cells = |field: &Field| field.on != Support::Points;
        let cell_tags: Vec<u64> = match mesh.fields.iter().any(on_cells) {
            true if keep_cells => mesh.cell_tags().collect(),
            true => (1..=mesh.cell_count() as u64).collect(),
            false => Vec::new(),
        };
        for field in &mesh.fields {
            if field.name.contains(['"', '\n', '\r']) || field.name != field.name.trim_ascii() {
                losses.lose(format!(
                    "the field name {:?}, which has a quote, a line end or outer blanks",
                    field.name
                ));
                continue;
            }
            self.field(field, &point_tag, &cell_tags, losses);
        }
    }

    fn field(
        &mut self,
        field: &Field,
        point_tag: &impl Fn(u32) -> u64,
        cell_tags: &[u64],
        losses: &mut Losses,
    ) {
        let inexact = match &field.values {
            Values::I64(values) => values.iter().any(|v| v.unsigned_abs() > 1 << 53),
            Values::U64(values) => values.iter().any(|v| *v > 1 << 53),
            _ => false,
        };
        if inexact {
            losses.lose(format!(
                "the 64-bit integers of field {:?} exactly",
                field.name
            ));
        }
        let section = match field.on {
            Support::Points => "NodeData",
            Support::Cells => "ElementData",
            Support::CellPoints => "ElementNodeData",
        };
        let all: Vec<u32>;
        let at = if field.at.is_empty() {
            all = (0..self.mesh.items(field.on) as u32).collect();
            &all
        } else {
            &field.at
        };
        let tag = |index: u32| match field.on {
            Support::Points => point_tag(index),
            Support::Cells | Support::CellPoints => {
                cell_tags.get(index as usize).copied().unwrap_or(0)
            }
        };
        // These numbers have 32 bits in every version.
        if self.binary && at.iter().any(|&index| i32::try_from(tag(index)).is_err()) {
            losses.lose(format!(
                "the field {:?}, as numbers of its points or cells exceed 32 bits",
                field.name
            ));
            return;
        }
        let kinds = self.mesh.cells().map(|(_, kind, _)| kind.points());
        let kinds: Vec<usize> = match field.on {
            Support::CellPoints => kinds.collect(),
            Support::Points | Support::Cells => Vec::new(),
        };
        let (time, step) = (field.time.unwrap_or(0.0), field.step.unwrap_or(0));
        self.out
            .text(&format!("${section}\n1\n\"{}\"\n1\n", field.name));
        self.out.float(time).end();
        self.out
            .text(&format!("3\n{step}\n{}\n{}\n", field.components, at.len()));
        let values = field.values.to_f64();
        let mut next = values.iter();
        for &index in at {
            self.tag(tag(index));
            let points = kinds.get(index as usize).copied();
            if let Some(points) = points {
                self.i32(points as i32);
            }
            for &value in next.by_ref().take(points.unwrap_or(1) * field.components) {
                self.f64(value);
            }
            self.end();
        }
        self.end_section(section);
    }
}
