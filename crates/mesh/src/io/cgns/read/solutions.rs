//! Solutions as fields.

use std::collections::BTreeMap;

use super::{Reader, Zone};
use crate::error::Result;
use crate::field::Tell;
use crate::io::cgns::tree::Node;
use crate::mesh::{Field, Support};

impl Reader {
    /// Solutions as fields, at the times that they are for.
    pub(super) fn solutions(&mut self, node: &Node<'_>, zone: &Zone, times: &[f64]) -> Result<()> {
        let mut steps: BTreeMap<String, usize> = BTreeMap::new();
        for data in node.labelled("ZoneIterativeData_t")? {
            for pointers in data.children()? {
                if pointers.name().starts_with("FlowSolution")
                    && pointers.name().ends_with("Pointers")
                {
                    let width = pointers.shape()?.first().copied().unwrap_or(32);
                    steps.extend(pointers.texts(width)?.into_iter().zip(0..));
                }
            }
        }
        for solution in node.labelled("FlowSolution_t")? {
            let location = solution
                .text_of("GridLocation")?
                .unwrap_or_else(|| "Vertex".into());
            let (on, items): (_, Vec<u32>) = match location.as_str() {
                "Vertex" => (Support::Points, zone.points.clone().collect()),
                "CellCenter" => (
                    Support::Cells,
                    zone.cells.0.iter().cloned().flatten().collect(),
                ),
                other => {
                    self.unread.tell(
                        solution.name(),
                        format!("the solution {:?} on each {other}", solution.name()),
                    );
                    continue;
                }
            };
            let step = steps.get(solution.name()).copied();
            let time = step.and_then(|step| times.get(step).copied());
            for array in solution.labelled("DataArray_t")? {
                let Some(values) = array
                    .values()?
                    .filter(|values| values.len() == items.len() && !items.is_empty())
                else {
                    self.unread.tell(
                        array.name(),
                        format!(
                            "{:?} of the solution {:?}, which is not of its size",
                            array.name(),
                            solution.name()
                        ),
                    );
                    continue;
                };
                let fields = &mut self.sets.mesh.fields;
                // The same of another zone continues a field.
                let same = |field: &&mut Field| {
                    (field.name.as_str(), field.on, field.time) == (array.name(), on, time)
                        && field
                            .at
                            .last()
                            .zip(items.first())
                            .is_some_and(|(last, first)| last < first)
                };
                if let Some(known) = fields.iter_mut().rev().find(same) {
                    known.at.extend(&items);
                    known.values = crate::mesh::Values::F64(
                        [known.values.to_f64(), values.to_f64()].concat().into(),
                    );
                    continue;
                }
                let taken = fields.iter().any(|field| {
                    (field.name.as_str(), field.on, field.time) == (array.name(), on, time)
                });
                let name = if taken {
                    format!("{} {}", solution.name(), array.name())
                } else {
                    array.name().to_owned()
                };
                // Cells of a section may have numbers that do not ascend with their places.
                let mut order: Vec<usize> = (0..items.len()).collect();
                order.sort_unstable_by_key(|&k| items[k]);
                let is_sorted = order.is_sorted();
                let values = match is_sorted {
                    true => values,
                    false => {
                        let all = values.to_f64();
                        crate::mesh::Values::F64(order.iter().map(|&k| all[k]).collect())
                    }
                };
                fields.push(Field {
                    at: order.iter().map(|&k| items[k]).collect(),
                    time,
                    step: step
                        .filter(|_| time.is_some())
                        .and_then(|step| i32::try_from(step + 1).ok()),
                    ..Field::new(name, on, 1, values)
                });
            }
        }
        Ok(())
    }
}
