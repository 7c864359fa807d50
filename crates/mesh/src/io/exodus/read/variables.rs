//! Variables on nodes and elements, and of the whole.

use super::Reader;
use crate::error::Result;
use crate::field::{GlobalArray, Tell};
use crate::mesh::{Field, Support, Values};

impl Reader<'_> {
    /// A variable of the k-th of several; the old files have all of them in one.
    fn variable(&self, one: &str, all: &str, k: usize, step: usize) -> Result<Option<Values>> {
        if let Some(values) = self.file.row(one, step)? {
            return Ok(Some(values));
        }
        let shape = self.file.shape(all)?.unwrap_or_default();
        let [_, count, width] = shape[..] else {
            return Ok(None);
        };
        let values = self.file.row(all, step)?;
        Ok(values.filter(|_| k < count).map(|values| {
            Values::F64(
                values
                    .to_f64()
                    .into_iter()
                    .skip(k * width)
                    .take(width)
                    .collect(),
            )
        }))
    }

    pub(super) fn on_nodes(&mut self, step: usize, time: Option<f64>) -> Result<()> {
        let points = self.sets.mesh.points.len();
        let names = self.file.texts("name_nod_var")?.unwrap_or_default();
        for (k, name) in names.into_iter().enumerate() {
            let values =
                self.variable(&format!("vals_nod_var{}", k + 1), "vals_nod_var", k, step)?;
            match values.filter(|values| values.len() == points && points > 0) {
                Some(values) => self.add(Field::new(name, Support::Points, 1, values), step, time),
                None => self.unread.tell_once(
                    &name,
                    format!("the variable {name:?} on nodes, whose values are not there"),
                ),
            }
        }
        Ok(())
    }

    fn add(&mut self, field: Field, step: usize, time: Option<f64>) {
        self.sets.mesh.fields.push(Field {
            time,
            step: time.and(i32::try_from(step + 1).ok()),
            ..field
        });
    }

    pub(super) fn on_elements(&mut self, step: usize, time: Option<f64>) -> Result<()> {
        let names = self.file.texts("name_elem_var")?.unwrap_or_default();
        for (k, name) in names.into_iter().enumerate() {
            let (mut at, mut parts, mut odd) = (Vec::new(), Vec::new(), 0);
            let mut first = 0;
            for (b, block) in self.blocks.iter().enumerate() {
                let cells = first..first + block.count as u32;
                first = cells.end;
                // Where the truth table is false, there is no such variable.
                let found = self
                    .file
                    .row(&format!("vals_elem_var{}eb{}", k + 1, b + 1), step)?;
                match found {
                    Some(values) if values.len() == block.count => {
                        at.extend(cells);
                        parts.push(values);
                    }
                    Some(_) => odd += 1,
                    None => {}
                }
            }
            if at.is_empty() || odd > 0 {
                let what = format!(
                    "the variable {name:?} on elements, whose values are not there or not one an element"
                );
                self.unread.tell_once(&name, what);
                continue;
            }
            let field = Field::new(name, Support::Cells, 1, joined(parts));
            self.add(field.only(at, first as usize), step, time);
        }
        Ok(())
    }

    /// Variables of the whole: at one time, or a row for each time.
    pub(super) fn globals(
        &mut self,
        times: &[f64],
        time: Option<f64>,
        whole: &mut Vec<GlobalArray>,
    ) -> Result<()> {
        let names = self.file.texts("name_glo_var")?.unwrap_or_default();
        let values = self.file.floats("vals_glo_var")?;
        let kept = |row: &usize| time.is_none() || times.get(*row).copied() == time;
        for (k, name) in names.iter().enumerate() {
            let rows = values.chunks_exact(names.len()).enumerate();
            let column = rows.filter(|(row, _)| kept(row)).map(|(_, row)| row[k]);
            whole.push(GlobalArray::numbers(name, Values::F64(column.collect())));
        }
        Ok(())
    }
}

/// Parts of one type one after another, of several as binary64.
fn joined(mut parts: Vec<Values>) -> Values {
    if parts.len() == 1 {
        return parts.remove(0);
    }
    if parts.iter().all(|part| matches!(part, Values::F32(_))) {
        let parts = parts.iter().filter_map(|part| match part {
            Values::F32(values) => Some(values),
            _ => None,
        });
        return Values::F32(parts.flatten().copied().collect());
    }
    Values::F64(parts.iter().flat_map(Values::to_f64).collect())
}
