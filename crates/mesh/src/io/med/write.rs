//! Writes MED files.

use std::collections::BTreeMap;
use std::ops::Range;

use super::cells;
use crate::error::Result;
use crate::io::hdf5::write::{Data, Group};
use crate::io::loss::Losses;
use crate::io::raw::CellNodes;
use crate::io::scalar::Number;
use crate::io::{Job, elements, sets};
use crate::mesh::{CellBlock, CellGroups, CellKind, Field, Mesh, Support};

const INT: Number = Number::I32;
const MESH: &str = "mesh";
/// The step of what does not change with time.
const NO_STEP: i64 = -1;

pub fn write(job: Job<'_>) -> Result<Vec<String>> {
    let Job {
        path,
        mesh,
        mut losses,
        ..
    } = job;
    losses.note_gmsh(mesh);
    let kinds = of_kinds(mesh, &mut losses);
    let families = Families::of(mesh, &mut losses);
    let mut file = Group::default();
    let about = file.group("INFOS_GENERALES");
    for (name, number) in [("MAJ", 4), ("MIN", 0), ("REL", 0)] {
        about.with(name, Data::integer(INT, number));
    }
    let dim = i64::from(mesh.dim());
    let space = if mesh.is_flat() { 2 } else { 3 };
    let head = file.group("ENS_MAA").group(MESH);
    for (name, number) in [
        ("DIM", dim),
        ("ESP", space as i64),
        ("REP", 0),
        ("TYP", 0),
        ("SRT", 1),
        ("NXT", -1),
        ("NXI", -1),
    ] {
        head.with(name, Data::integer(INT, number));
    }
    let axes: String = ["X", "Y", "Z"][..space]
        .iter()
        .map(|axis| format!("{axis:<16}"))
        .collect();
    head.with("DES", Data::text("faceoff"))
        .with("NOM", Data::text(axes))
        .with("UNI", Data::text(" ".repeat(16 * space)))
        .with("UNT", Data::text(""));
    let step = head.group(&step_name(NO_STEP, NO_STEP));
    for (name, number) in [
        ("CGT", 1),
        ("NDT", NO_STEP),
        ("NOR", NO_STEP),
        ("NXT", -1),
        ("NXI", -1),
        ("PVT", -1),
        ("PVI", -1),
    ] {
        step.with(name, Data::integer(INT, number));
    }
    step.with("PDT", Data::float(-1.0));

    let count = mesh.points.len();
    let nodes = step.group("NOE");
    nodes
        .with("CGT", Data::integer(INT, 1))
        .with("CGS", Data::integer(INT, 1))
        .with("PFL", Data::text("MED_NO_PROFILE_INTERNAL"));
    let coordinates = Data::table(vec![count * space], [count, space], true, |k, axis| {
        mesh.points[k][axis]
    });
    nodes.add("COO", sized(coordinates, count));
    let cells_of = step.group("MAI");
    cells_of.with("CGT", Data::integer(INT, 1));
    for of_kind in &kinds {
        let group = cells_of.group(of_kind.name);
        let (kind, count) = (of_kind.kind, of_kind.count());
        for (key, number) in [("CGT", 1), ("CGS", 1), ("GEO", geometry(kind))] {
            group.with(key, Data::integer(INT, number));
        }
        group.with("PFL", Data::text("MED_NO_PROFILE_INTERNAL"));
        let nodes = CellNodes::of_blocks(&of_kind.blocks, cells::order(kind), true);
        let nodes = Data::nodes(vec![nodes.len()], nodes, 1);
        group.add("NOD", sized(nodes, count));
        let runs = families.runs(&of_kind.cells);
        if runs
            .iter()
            .any(|(_, set)| families.numbers[*set as usize][0] != 0)
        {
            let numbers = Data::runs(INT, vec![count], runs, families.numbers.clone());
            group.add("FAM", sized(numbers, count));
        }
    }
    families.write(&mut file);
    write_fields(&mut file, mesh, &kinds, &mut losses);
    losses.settle(path, || file.save(path))
}

fn sized(data: Data<'_>, count: usize) -> Data<'_> {
    data.with("CGT", Data::integer(INT, 1))
        .with("NBR", Data::integer(INT, count as i64))
}

/// MED's number of a kind: a hundred for each dimension, and the number of nodes.
fn geometry(kind: CellKind) -> i64 {
    100 * i64::from(kind.dim()) + kind.points() as i64
}

fn step_name(number: i64, order: i64) -> String {
    let part = |n: i64| {
        if n < 0 {
            format!("-{:019}", -n)
        } else {
            format!("{n:020}")
        }
    };
    part(number) + &part(order)
}

/// The cells of one kind, which MED has together.
struct OfKind<'a> {
    name: &'static str,
    kind: CellKind,
    blocks: Vec<&'a CellBlock>,
    /// Those of each block.
    cells: Vec<Range<u32>>,
}

impl OfKind<'_> {
    fn count(&self) -> usize {
        self.cells.iter().map(Range::len).sum()
    }
}

fn of_kinds<'a>(mesh: &'a Mesh, losses: &mut Losses) -> Vec<OfKind<'a>> {
    let mut kinds: BTreeMap<CellKind, OfKind<'a>> = BTreeMap::new();
    for (cells, block) in mesh.ranges() {
        let of_kind = kinds.entry(block.kind).or_insert_with(|| OfKind {
            name: elements::name(|element| element.med, block.kind).unwrap_or_default(),
            kind: block.kind,
            blocks: Vec::new(),
            cells: Vec::new(),
        });
        of_kind.blocks.push(block);
        of_kind.cells.push(cells);
    }
    let mut kinds: Vec<OfKind<'a>> = kinds.into_values().collect();
    kinds.retain(|of| {
        if of.name.is_empty() {
            losses.lose(format!("{} {} cells", of.count(), of.kind));
        }
        !of.name.is_empty()
    });
    kinds
}

/// Which family each cell is in, and the groups of each.
struct Families {
    sets: CellGroups,
    /// The one number of the family of each set.
    numbers: Vec<Vec<i64>>,
    /// Number and names of groups.
    all: Vec<(i64, Vec<String>)>,
}

impl Families {
    /// Cells are in families of negative numbers; vertices are cells.
    fn of(mesh: &Mesh, losses: &mut Losses) -> Self {
        let names = sets::distinct_names(mesh.groups.iter(), 80);
        for (group, name) in mesh.groups.iter().zip(&names) {
            if group.name.as_ref() != Some(name) {
                losses.called(group, name);
            }
        }
        if !mesh.groups.is_empty() {
            losses.note("groups are numbered anew, in the order of their names");
        }
        let sets = CellGroups::new(mesh);
        let number = |set: usize| {
            if sets.sets[set].is_empty() {
                0
            } else {
                -(set as i64)
            }
        };
        let numbers = (0..sets.sets.len()).map(|set| vec![number(set)]).collect();
        let of = |set: &Vec<u32>| -> Vec<String> {
            set.iter().map(|&k| names[k as usize].clone()).collect()
        };
        let mut all: Vec<(i64, Vec<String>)> = sets
            .sets
            .iter()
            .enumerate()
            .map(|(k, set)| (number(k), of(set)))
            .filter(|(number, _)| *number != 0)
            .collect();
        let mut next = -(sets.sets.len() as i64);
        for (group, name) in mesh
            .groups
            .iter()
            .zip(&names)
            .filter(|(group, _)| group.cells.is_empty())
        {
            let _ = group;
            all.push((next, vec![name.clone()]));
            next -= 1;
        }
        Families { sets, numbers, all }
    }

    /// Runs of these cells, one list after another, in one family: the end of each and its set.
    fn runs(&self, cells: &[Range<u32>]) -> Vec<(u32, u32)> {
        let (mut runs, mut before) = (Vec::new(), 0);
        for cells in cells {
            let within = self.sets.runs_from(cells.start);
            for (run, set) in within.take_while(|(run, _)| run.start < cells.end) {
                runs.push((before + run.end.min(cells.end) - cells.start, set));
            }
            before += cells.len() as u32;
        }
        runs
    }

    fn write(&self, file: &mut Group<'_>) {
        let root = file.group("FAS").group(MESH);
        root.group("FAMILLE_ZERO")
            .with("NUM", Data::integer(INT, 0));
        for (number, groups) in &self.all {
            let family = root.group("ELEME").group(&format!("FAM_{number}"));
            family.with("NUM", Data::integer(INT, *number));
            let list = family.group("GRO");
            list.with("NBR", Data::integer(INT, groups.len() as i64));
            list.add("NOM", Data::byte_arrays(groups.clone(), 80));
        }
    }
}

fn write_fields<'a>(
    file: &mut Group<'a>,
    mesh: &'a Mesh,
    kinds: &'a [OfKind<'a>],
    losses: &mut Losses,
) {
    let mut steps: BTreeMap<&str, i64> = BTreeMap::new();
    let mut seen: Vec<(String, Option<u64>, Support)> = Vec::new();
    for field in &mesh.fields {
        if field.name.is_empty() {
            losses.lose_field(&field.name, field.on);
            continue;
        }
        let key = (field.name.clone(), field.time.map(f64::to_bits), field.on);
        let name: String = field
            .name
            .chars()
            .map(|c| if c == '/' { '_' } else { c })
            .collect();
        let known = file.group("CHA").has(&name);
        let same_width = mesh
            .fields
            .iter()
            .find(|other| other.name == field.name)
            .is_none_or(|other| other.components == field.components);
        if seen.contains(&key) || name.len() > 64 || !same_width {
            losses.lose(format!(
                "the field {:?} on {}, whose name exists or is too long",
                field.name, field.on
            ));
            continue;
        }
        seen.push(key);
        let width = field.components;
        let root = file.group("CHA").group(&name);
        if !known {
            let blank = " ".repeat(16 * width);
            root.with("MAI", Data::text(MESH))
                .with("TYP", Data::integer(INT, 6))
                .with("NCO", Data::integer(INT, width as i64));
            let names: String = (1..=width)
                .map(|k| format!("{:<16}", format!("{k}")))
                .collect();
            root.with("NOM", Data::text(names))
                .with("UNI", Data::text(blank))
                .with("UNT", Data::text(""));
        }
        let number = match (field.time, field.step) {
            (None, _) => NO_STEP,
            (_, Some(step)) if step >= 0 => step.into(),
            _ => {
                let next = steps.entry(&field.name).or_insert(-1);
                *next += 1;
                *next
            }
        };
        let step = root.group(&step_name(number, NO_STEP));
        if !step.has_attributes() {
            for (key, value) in [
                ("NDT", number),
                ("NOR", NO_STEP),
                ("RDT", NO_STEP),
                ("ROR", NO_STEP),
            ] {
                step.with(key, Data::integer(INT, value));
            }
            step.with("PDT", Data::float(field.time.unwrap_or(-1.0)));
        }
        match field.on {
            Support::Points => {
                let partial = !field.at.is_empty();
                if partial {
                    losses.note_gaps(&field.name, field.on);
                }
                let count = mesh.points.len();
                add_values(
                    step,
                    "NOE",
                    count,
                    1,
                    Data::table(vec![count * width], [count, width], true, move |k, of| {
                        value(field, k, of)
                    }),
                );
            }
            Support::Cells => {
                for OfKind {
                    name: kind, cells, ..
                } in kinds
                {
                    let cells: Vec<u32> = cells.iter().cloned().flatten().collect();
                    let has =
                        |cell: &&u32| field.at.is_empty() || field.at.binary_search(cell).is_ok();
                    let there = cells.iter().filter(has).count();
                    if there == 0 {
                        continue;
                    }
                    if there < cells.len() {
                        losses.note_gaps(&field.name, kind);
                    }
                    let count = cells.len();
                    let shape = vec![count * width];
                    let values = Data::table(shape, [count, width], true, move |k, of| {
                        value(field, cells[k] as usize, of)
                    });
                    add_values(step, &format!("MAI.{kind}"), count, 1, values);
                }
            }
            Support::CellPoints => losses.lose_field(&field.name, field.on),
        }
    }
}

/// A component of a field at a point or cell; NaN if there is none.
fn value(field: &Field, item: usize, component: usize) -> f64 {
    let row = match field.at.is_empty() {
        true => Some(item),
        false => crate::io::steps::row_of(&field.at, item),
    };
    row.map_or(f64::NAN, |row| {
        crate::io::steps::number(&field.values, row * field.components + component)
    })
}

fn add_values<'a>(step: &mut Group<'a>, place: &str, count: usize, gauss: i64, values: Data<'a>) {
    const PROFILE: &str = "MED_NO_PROFILE_INTERNAL";
    let at = step.group(place);
    at.with("GAU", Data::text(""))
        .with("PFL", Data::text(PROFILE));
    let at = at.group(PROFILE);
    at.with("NBR", Data::integer(INT, count as i64))
        .with("NGA", Data::integer(INT, gauss))
        .with("GAU", Data::text(""));
    at.add("CO", values);
}
