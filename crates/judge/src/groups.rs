//! Compares the cells of the groups that both files have.

use super::comparison::{Comparison, On, Settings};
use super::keyed::Keyed;
use super::law::Tolerances;
use super::parts::Parts;
use super::sets::judge_sets;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::{ResultField, Results};
use faceoff_mesh::mesh::Group;

/// Adds a row for each group with the same number, name and dimension whose cells differ in the second file, and a note of groups that
/// only one of two files with groups has. Both sides come with the numbers by which their points are matched.
pub(super) fn judge_groups(
    [(a, of_a), (b, of_b)]: [(&Results, &[u32]); 2],
    near: f64,
    parts: &Parts,
    settings: &Settings,
    comparison: &mut Comparison,
) -> Result<()> {
    let is_same = |g: &Group, h: &Group| (g.dim, g.tag, &g.name) == (h.dim, h.tag, &h.name);
    let lacks = |side: &Results, group: &Group| !side.groups.iter().any(|g| is_same(g, group));
    if a.groups.is_empty() || b.groups.is_empty() || a.cell_count() != b.cell_count() {
        return Ok(());
    }
    for (side, other) in [(a, b), (b, a)] {
        let alone: Vec<String> = side
            .groups
            .iter()
            .filter(|group| lacks(other, group))
            .map(|group| format!("{:?}", title(group)))
            .collect();
        if !alone.is_empty() {
            let alone = alone.join(", ");
            let note = format!("only {} has the groups {alone}", side.source);
            comparison.notes.push(note);
        }
    }
    if of_a == of_b && a.cells == b.cells && a.groups == b.groups {
        return Ok(());
    }
    // One number per cell: whether it is in the group.
    let marks = |side: &Results, other: &Results| -> Vec<ResultField> {
        let shared = side.groups.iter().filter(|group| !lacks(other, group));
        let marks = shared.map(|group| {
            let mut values = vec![0.0; side.cell_count()];
            group
                .cells
                .iter()
                .for_each(|&cell| values[cell as usize] = 1.0);
            ResultField {
                name: format!("group {}, {}", title(group), group.dim),
                components: 1,
                values: values.into(),
                rest: Some(Vec::new()),
                at: None,
                scaled_by: None,
                single: false,
            }
        });
        marks.collect()
    };
    let (marks_a, marks_b) = (marks(a, b), marks(b, a));
    let sides = [
        Keyed::new(a, of_a, On::Cells, false)?.carrying(&marks_a),
        Keyed::new(b, of_b, On::Cells, false)?.carrying(&marks_b),
    ];
    let exact = Settings {
        tolerances: Tolerances::default(),
        ..settings.clone()
    };
    match judge_sets(On::Cells, sides, near, parts, &exact) {
        Ok((rows, _)) => {
            let others = rows.into_iter().filter(|row| !row.field.verdict.passes());
            comparison.fields.extend(others.map(|mut row| {
                let what = "a cell is in the group in only one file";
                row.field.reason.get_or_insert_with(|| what.into());
                row
            }));
        }
        Err(Error::Ended(cause)) => return Err(Error::Ended(cause)),
        Err(error) => {
            let note = format!("groups are not compared, as cells cannot be matched: {error}");
            comparison.notes.push(note);
        }
    }
    Ok(())
}

fn title(group: &Group) -> String {
    let number = || group.tag.to_string();
    group.name.clone().unwrap_or_else(number)
}
