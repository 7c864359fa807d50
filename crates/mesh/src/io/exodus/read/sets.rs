//! Sets of sides, nodes and elements.

use super::Reader;
use crate::error::Result;
use crate::field::Tell;
use crate::io::exodus::cells;
use crate::io::raw;
use crate::mesh::Shape;

impl Reader<'_> {
    pub(super) fn sides(&mut self) -> Result<()> {
        let mut ends = Vec::new();
        for block in &self.blocks {
            ends.push(ends.last().copied().unwrap_or(0) + block.count);
        }
        for (k, (tag, name)) in self
            .numbers_and_names("ss_prop1", "ss_names")?
            .into_iter()
            .enumerate()
        {
            let elements = self
                .integers(&format!("elem_ss{}", k + 1))?
                .unwrap_or_default();
            let numbers = self
                .integers(&format!("side_ss{}", k + 1))?
                .unwrap_or_default();
            let (mut sides, mut of_polytopes) = (Vec::with_capacity(elements.len()), 0);
            for (&element, &side) in elements.iter().zip(&numbers) {
                let cell = usize::try_from(element.wrapping_sub(1)).unwrap_or(usize::MAX);
                let block = self.blocks.get(ends.partition_point(|&end| end <= cell));
                if let Some(Shape::Polygon | Shape::Polyhedron) =
                    block.and_then(|block| block.shape)
                {
                    of_polytopes += 1;
                    continue;
                }
                let corners = block.and_then(|block| {
                    let all = cells::sides(block.shape?, block.is_shell);
                    all.get(usize::try_from(side.wrapping_sub(1)).ok()?)
                });
                let Some(corners) = corners else {
                    let what = format!(
                        "the side set {tag} names side {side} of element {element}, which is not there"
                    );
                    return Err(self.file.refuse(what));
                };
                sides.push((cell as u32, *corners));
            }
            let unknown = self.sets.sides(tag, &name, sides);
            for (count, of) in [
                (unknown, "cells of higher order"),
                (of_polytopes, "polygons and polyhedra"),
            ] {
                if count > 0 {
                    self.unread.tell(
                        &name,
                        format!("{count} sides of the side set {tag}, of {of}"),
                    );
                }
            }
        }
        Ok(())
    }

    pub(super) fn node_sets(&mut self) -> Result<()> {
        let points = self.sets.mesh.points.len();
        for (tag, name, nodes) in self.lists("ns", "node", points)? {
            self.sets.nodes(tag, &name, nodes);
        }
        Ok(())
    }

    pub(super) fn element_sets(&mut self) -> Result<()> {
        let all = self.blocks.iter().map(|block| block.count).sum();
        let dim = self.sets.mesh.dim();
        for (tag, name, elements) in self.lists("els", "elem", all)? {
            let cells = elements.into_iter().map(|cell| cell..cell + 1);
            self.sets.cells(dim, tag, &name, cells);
        }
        Ok(())
    }

    /// The number, the name and the members of each set of a kind; `count` is the number of possible members in the file.
    fn lists(&self, kind: &str, of: &str, count: usize) -> Result<Vec<(i64, String, Vec<u32>)>> {
        let known = self.numbers_and_names(&format!("{kind}_prop1"), &format!("{kind}_names"))?;
        let sets = known.into_iter().zip(1..).map(|((tag, name), k)| {
            let numbers = self.integers(&format!("{of}_{kind}{k}"))?;
            let index = |number: i64| {
                raw::index(number, count).ok_or_else(|| {
                    let thing = if of == "node" { "node" } else { "element" };
                    let what =
                        format!("the {thing} set {tag} names the {thing} {number} of {count}");
                    self.file.refuse(what)
                })
            };
            let members = numbers.unwrap_or_default().into_iter().map(index);
            Ok((tag, name, members.collect::<Result<_>>()?))
        });
        sets.collect()
    }
}
