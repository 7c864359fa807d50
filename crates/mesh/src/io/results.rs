//! The fields of any file, for comparison: CSV tables, and every mesh format that holds fields.
//!
//! Files written by faceoff name a field and its engine. If there is only one engine, its name is left out, so that the
//! results of two engines have fields of the same names.

use std::path::Path;

use super::medit::sol;
use super::{Content, collection, table};
use crate::error::Result;
use crate::field::{GlobalArray, GlobalValues, PADDING, ResultField, Results, to_i64};
use crate::memory;
use crate::mesh::{CellBlock, CellKind, Field, Mesh, Support, Values};

/// Fields that faceoff writes on all faces although only some have them; the others have NaN.
const PARTIAL: [&str; 5] = ["gamma", "contact", "jump", "flux", "P"];

/// VTK's own data about numbering, which are not results.
const BOOKKEEPING: [&str; 3] = ["vtkOriginalPointIds", "vtkOriginalCellIds", GHOSTS];
const GHOSTS: &str = "vtkGhostType";

/// Reads the fields of a file. `python` is the interpreter of an environment that has meshio, for the formats that meshio
/// reads.
///
/// # Errors
/// The file cannot be read, its format is unknown, or it violates its format.
pub fn read_results(path: &Path, bytes: &[u8], python: Option<&Path>) -> Result<Results> {
    if collection::has_suffix(path, "csv") {
        return table::read(path, bytes);
    }
    of_content(path, content(path, bytes, None, python)?)
}

/// The contents of a file, of the one file of a list, or of a solution and its mesh, which is next to it unless it is given.
pub(super) fn content(
    path: &Path,
    bytes: &[u8],
    mesh: Option<&Path>,
    python: Option<&Path>,
) -> Result<Content> {
    let has_suffix = |suffix| collection::has_suffix(path, suffix);
    if has_suffix("sol") || has_suffix("solb") {
        let both = ["mesh", "meshb"].map(|suffix| path.with_extension(suffix));
        let beside = both.iter().find(|mesh| mesh.exists()).unwrap_or(&both[0]);
        let mut content = super::open(mesh.unwrap_or(beside), python)?;
        content.mesh.fields = sol::read(path, bytes, &content.mesh)?;
        return Ok(content);
    }
    match &collection::sources(path)?[..] {
        [one] if one != path => super::open(one, python),
        _ if collection::is_pvd(path) => super::open(&collection::only_file(path, bytes)?, python),
        _ => super::parse(path, bytes, python),
    }
}

/// The fields of a file that has been read.
///
/// # Errors
/// Its table of cells, as wide as the largest of them, is too large for the memory.
pub fn of_content(path: &Path, content: Content) -> Result<Results> {
    let mesh = &content.mesh;
    let width = mesh.blocks.iter().map(|block| block.kind.points()).max();
    let entries = width.unwrap_or(0) as f64 * mesh.cell_count() as f64;
    memory::require(
        4.0 * entries,
        "the table of cells, as wide as the largest of them,",
    )?;
    let mut results = of_mesh(path.display().to_string(), content.mesh, &content.whole);
    results.unread = content.unread;
    results.ghosts += content.ghosts;
    Ok(results)
}

fn of_mesh(source: String, mut mesh: Mesh, whole: &[GlobalArray]) -> Results {
    let ours = whole.iter().any(|data| data.name == "faceoff");
    let engine = only_engine(whole).map(|engine| format!(" {engine}"));
    let kinds: Vec<(CellKind, usize)> = mesh.blocks.iter().map(|b| (b.kind, b.len())).collect();
    let width = kinds.iter().map(|(kind, _)| kind.points()).max();
    let width = width.unwrap_or(0);
    let cells = match &mut mesh.blocks[..] {
        // Cells of one kind are the table already.
        [all] => std::mem::take(&mut all.nodes),
        blocks => {
            let mut cells = Vec::with_capacity(width * kinds.iter().map(|(_, n)| n).sum::<usize>());
            for cell in blocks.iter().flat_map(CellBlock::cells) {
                cells.extend_from_slice(cell);
                cells.extend(std::iter::repeat_n(PADDING, width - cell.len()));
            }
            cells.into()
        }
    };
    let planar = mesh.points.iter().all(|p| p[2] == 0.0);
    let mut results = Results {
        source,
        space: if planar { 2 } else { 3 },
        width,
        cells,
        kinds,
        ..Results::default()
    };
    let sizes = results.kinds.clone();
    let starts = || {
        let sizes = sizes.iter();
        let sizes = sizes.flat_map(|(kind, n)| std::iter::repeat_n(kind.points() as u32, *n));
        sizes.scan(0, |next, size| {
            let start = *next;
            *next += size;
            Some((start, size))
        })
    };
    // VTK's marks of cells that another process has as well, the lowest bit.
    let is_ghost =
        |field: &&Field| field.name == GHOSTS && field.on == Support::Cells && field.at.is_empty();
    let ghosts = mesh.fields.iter().find(is_ghost);
    let ghosts = ghosts
        .and_then(|field| to_i64(&field.values))
        .unwrap_or_default();
    let mut of_cells = None;
    let is_result = |field: &Field| !BOOKKEEPING.contains(&field.name.as_str());
    for field in std::mem::take(&mut mesh.fields)
        .into_iter()
        .filter(is_result)
    {
        let on = field.on;
        let quantity = engine.as_deref().and_then(|e| field.name.strip_suffix(e));
        let quantity = quantity.filter(|_| ours).map(str::to_owned);
        let mut carried = carry(field, ours);
        if let Some(quantity) = quantity {
            carried.name = quantity;
        }
        match on {
            Support::Points => results.on_points.push(carried),
            Support::Cells => results.on_cells.push(carried),
            Support::CellPoints => {
                // The field lists cells, the result corners.
                if let Some(cells) = carried.at.take() {
                    let of_cells: &Vec<(u32, u32)> =
                        of_cells.get_or_insert_with(|| starts().collect());
                    let corners = cells.iter().flat_map(|cell| {
                        let (start, size) = of_cells[*cell as usize];
                        start..start + size
                    });
                    carried.at = Some(corners.collect());
                }
                results.on_corners.push(carried);
            }
        }
    }
    results.points = mesh.points;
    results.groups = mesh.groups;
    // Texts contain the origin of a file.
    let numbers = whole.iter().filter_map(|data| match &data.values {
        GlobalValues::Numbers(values) => Some((data, values)),
        GlobalValues::Text(_) => None,
    });
    let about = numbers.map(|(data, values)| ResultField {
        name: data.name.clone(),
        components: data.components,
        values: values.to_f64().into(),
        rest: values.rest(),
        at: None,
        scaled_by: None,
        single: matches!(values, Values::F32(_)),
    });
    results.whole = about.collect();
    if ghosts.len() == results.cell_count() {
        let ghosts: Vec<bool> = ghosts.iter().map(|mark| mark & 1 == 1).collect();
        results.ghosts = results.leave_out(&ghosts);
    }
    results
}

/// The engine of a file written by faceoff, without its version, if there is only one.
fn only_engine(whole: &[GlobalArray]) -> Option<&str> {
    let engines = whole.iter().find(|data| data.name == "engines")?;
    match &engines.values {
        GlobalValues::Text(texts) if texts.len() == 1 => Some(texts[0].rsplit_once(' ')?.0),
        _ => None,
    }
}

fn carry(field: Field, ours: bool) -> ResultField {
    let mut carried = ResultField {
        name: field.name,
        components: field.components,
        rest: field.values.rest(),
        single: matches!(field.values, Values::F32(_)),
        values: field.values.into_f64(),
        at: (!field.at.is_empty()).then_some(field.at),
        scaled_by: None,
    };
    if !ours {
        return carried;
    }
    let name = carried.name.clone();
    let (quantity, engines) = name.split_once(' ').unwrap_or((&name, ""));
    if let Some((_, of)) = engines.split_once(" - ") {
        carried.scaled_by = Some(format!("{quantity} {of}"));
    }
    if PARTIAL.contains(&quantity) {
        let rows = carried.values.chunks_exact(carried.components);
        let there = |row: &[f64]| !row.iter().all(|v| v.is_nan());
        let at = rows.zip(0..).filter(|(row, _)| there(row)).map(|(_, k)| k);
        carried.at = Some(at.collect());
        let rows = carried.values.chunks_exact(carried.components);
        carried.values = rows.filter(|row| there(row)).flatten().copied().collect();
    }
    carried
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::mesh::Array;

    #[test]
    fn what_is_lent_is_copied_only_to_be_owned() {
        let points = Arc::new(vec![[0.0; 3], [1.0, 0.0, 0.0]]);
        let (nodes, values) = (Arc::new(vec![0, 1]), Arc::new(vec![1.0, 2.0]));
        let u = Values::F64(Array::lent(values.clone()));
        let mesh = Mesh {
            points: Array::lent(points.clone()),
            blocks: vec![CellBlock {
                nodes: Array::lent(nodes.clone()),
                ..CellBlock::new(CellKind::Line, Vec::new())
            }],
            fields: vec![Field::new("u", Support::Points, 1, u)],
            ..Mesh::default()
        };
        let mut found = of_mesh("a".into(), mesh, &[]);
        let lent = |found: &Results| {
            let of = &found.on_points[0].values;
            [
                found.points.as_ptr() == points.as_ptr(),
                found.cells.as_ptr() == nodes.as_ptr(),
                of.as_ptr() == values.as_ptr(),
            ]
        };
        assert_eq!(lent(&found), [true; 3]);
        let before = found.clone();
        found.own();
        assert_eq!((lent(&found), found), ([false; 3], before));
    }

    #[test]
    fn what_a_face_does_not_carry_is_not_there_and_only_in_files_of_ours() {
        let on_cells = |name: &str, values: Vec<f64>| {
            Field::new(name, Support::Cells, 1, Values::F64(values.into()))
        };
        let mesh = Mesh {
            points: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].into(),
            blocks: vec![CellBlock::new(CellKind::Line, vec![0, 1, 1, 2])],
            fields: vec![
                on_cells("flux rust", vec![f64::NAN, 2.0]),
                on_cells("mean rust", vec![f64::NAN, 2.0]),
                on_cells("mean freefem - rust", vec![0.0, 1.0]),
            ],
            ..Mesh::default()
        };
        let ours = of_mesh(
            "a".into(),
            mesh.clone(),
            &[GlobalArray::text("faceoff", "1")],
        );
        assert_eq!(ours.on_cells[0].at, Some(vec![1]));
        assert_eq!(ours.on_cells[0].values, [2.0]);
        assert_eq!(ours.on_cells[1].at, None);
        assert_eq!(ours.on_cells[2].scaled_by.as_deref(), Some("mean rust"));
        let engines = |names: &[&str]| {
            let names = names.iter().map(|name| format!("{name} 1.2")).collect();
            vec![
                GlobalArray::text("faceoff", "1"),
                GlobalArray::texts("engines", names),
            ]
        };
        let names = |whole: &[GlobalArray]| -> Vec<String> {
            let fields = of_mesh("a".into(), mesh.clone(), whole).on_cells;
            fields.into_iter().map(|field| field.name).collect()
        };
        let whole = ["flux rust", "mean rust", "mean freefem - rust"];
        assert_eq!(names(&engines(&["rust"]))[..2], ["flux", "mean"]);
        assert_eq!(names(&engines(&["rust", "freefem"])), whole);
        assert_eq!(names(&engines(&["rust"])[1..]), whole);
        let theirs = of_mesh("a".into(), mesh, &[]);
        assert!(
            theirs
                .on_cells
                .iter()
                .all(|f| f.at.is_none() && f.scaled_by.is_none())
        );
    }
}
