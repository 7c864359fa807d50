//! Attributes as fields and data of the whole.

use super::{Grid, Reader};
use crate::error::Result;
use crate::field::{GlobalArray, Tell};
use crate::io::xdmf::GROUP;
use crate::io::xdmf::item::Item;
use crate::mesh::{Field, Support, Values};

impl Reader<'_> {
    pub(super) fn attributes(&mut self, grid: &Grid) -> Result<()> {
        for attribute in self.attributes_of(grid)? {
            let element = self.items.tree.at(attribute);
            let name = element.get("Name").unwrap_or("unnamed").to_owned();
            if element
                .get("ItemType")
                .is_some_and(|kind| kind.eq_ignore_ascii_case("FiniteElementFunction"))
            {
                if let Err(what) = self.function(grid, attribute, &name)? {
                    self.unread
                        .tell(&name, format!("the function {name:?}, {what}"));
                }
                continue;
            }
            let centre = element.get("Center").unwrap_or("Node").to_ascii_lowercase();
            let (on, range) = match centre.as_str() {
                "node" => (
                    Support::Points,
                    grid.geometry.as_ref().and_then(|key| self.points.get(key)),
                ),
                "cell" => (
                    Support::Cells,
                    grid.topology.as_ref().and_then(|key| self.cells.get(key)),
                ),
                "grid" => {
                    let item = self.items.only(attribute)?;
                    let (_, components) = item.rows();
                    let array = GlobalArray {
                        components: components.max(1),
                        ..GlobalArray::numbers(name, item.values())
                    };
                    if let Some(other) = array.join(&mut self.whole) {
                        let what = format!("{:?} of further grids, which differs", other.name);
                        self.unread.tell(&other.name, what);
                    }
                    continue;
                }
                other => {
                    self.unread
                        .tell(&name, format!("the attribute {name:?} on each {other}"));
                    continue;
                }
            };
            let range = range.ok_or_else(|| {
                self.refuse(grid, format!("{name:?} is on a mesh that is not there"))
            })?;
            let (range, item) = (range.clone(), self.items.only(attribute)?);
            if on == Support::Cells && name == GROUP && !item.numbers.number.is_float() {
                self.numbered(grid, range, &item)?;
                continue;
            }
            self.field(grid, name, on, range, item)?;
        }
        Ok(())
    }

    fn field(
        &mut self,
        grid: &Grid,
        name: String,
        on: Support,
        range: std::ops::Range<u32>,
        item: Item,
    ) -> Result<()> {
        let values = item.numbers.len();
        let rows = range.len();
        if rows == 0 && values == 0 {
            return Ok(());
        }
        if rows == 0 || values == 0 || !values.is_multiple_of(rows) {
            return Err(self.refuse(grid, format!("{name:?} has {values} values on {rows} {on}")));
        }
        let all = self.sets.mesh.items(on);
        let time = grid.time;
        // The parts of a spatial collection make one field.
        let fields = &mut self.sets.mesh.fields;
        let components = values / rows;
        let same = |field: &&mut Field| {
            (&field.name, field.on, field.time, field.components) == (&name, on, time, components)
                && field.at.last().is_some_and(|&last| last < range.start)
        };
        if let Some(known) = fields.iter_mut().rev().find(same) {
            known.at.extend(range);
            known.values = Values::F64(
                [known.values.to_f64(), item.values().to_f64()]
                    .concat()
                    .into(),
            );
            if known.at.len() == all {
                known.at.clear();
            }
            return Ok(());
        }
        let field = Field {
            time,
            ..Field::new(name, on, components, item.values())
        };
        fields.push(field.only(range.collect(), all));
        Ok(())
    }

    /// A function of dolfin: values of degrees of freedom, and those of each cell. Of degree 0 and 1 they are values on cells and
    /// at the corners of cells.
    fn function(
        &mut self,
        grid: &Grid,
        attribute: usize,
        name: &str,
    ) -> Result<Result<(), String>> {
        let element = self.items.tree.at(attribute);
        let family = element.get("ElementFamily").unwrap_or_default();
        let degree = element.get("ElementDegree").unwrap_or_default();
        let items = self.items.of(attribute)?;
        let Some(range) = grid
            .topology
            .as_ref()
            .and_then(|key| self.cells.get(key))
            .cloned()
        else {
            return Ok(Err("whose mesh is not there".into()));
        };
        let is_lagrange = ["CG", "DG", "P", "Lagrange", "Discontinuous Lagrange"].contains(&family);
        if !is_lagrange || !["0", "1"].contains(&degree) || items.len() < 4 {
            return Ok(Err(format!(
                "an element {family} of degree {degree}, which is not read"
            )));
        }
        let numbers = |item: usize| -> Result<Vec<usize>> {
            let values = self
                .items
                .read(item)?
                .numbers
                .integers()
                .unwrap_or_default();
            Ok(values
                .into_iter()
                .map(|n| usize::try_from(n).unwrap_or(usize::MAX))
                .collect())
        };
        let (dofs, starts, cells) = (numbers(items[0])?, numbers(items[2])?, numbers(items[3])?);
        let vector = self.items.read(items[1])?.values().to_f64();
        let mesh = &self.sets.mesh;
        let count = range.len();
        let mut rows: Vec<Vec<f64>> = vec![Vec::new(); count];
        for (k, &cell) in cells.iter().enumerate() {
            let of = starts
                .get(k)
                .zip(starts.get(k + 1))
                .and_then(|(&a, &b)| dofs.get(a..b));
            let values = of.and_then(|of| {
                of.iter()
                    .map(|&dof| vector.get(dof).copied())
                    .collect::<Option<Vec<f64>>>()
            });
            let (Some(values), Some(row)) = (values, rows.get_mut(cell)) else {
                return Ok(Err("whose degrees of freedom do not fit its cells".into()));
            };
            *row = values;
        }
        let sizes = range.clone().map(|cell| match degree {
            "0" => 1,
            _ => mesh.cell(cell).map_or(1, |(kind, _)| kind.points()),
        });
        let sizes: Vec<usize> = sizes.collect();
        let components = rows.first().map_or(1, |row| row.len() / sizes[0]).max(1);
        if rows
            .iter()
            .zip(&sizes)
            .any(|(row, &size)| row.len() != size * components)
        {
            return Ok(Err("whose degrees of freedom do not fit its cells".into()));
        }
        // The components follow one another in a cell.
        let turned = rows.iter().zip(&sizes).flat_map(|(row, &size)| {
            (0..size).flat_map(move |node| (0..components).map(move |c| row[c * size + node]))
        });
        let on = if degree == "0" {
            Support::Cells
        } else {
            Support::CellPoints
        };
        let values = Values::F64(turned.collect());
        let all = mesh.cell_count();
        let field = Field {
            time: grid.time,
            ..Field::new(name, on, components, values)
        };
        let field = field.only(range.collect(), all);
        self.sets.mesh.fields.push(field);
        Ok(Ok(()))
    }
}
