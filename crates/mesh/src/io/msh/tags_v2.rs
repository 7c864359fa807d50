//! The tags of elements of MSH 1.0 and 2.x: group, entity, partitions.

use std::collections::HashMap;

use super::layout::Layout;
use crate::error::Result;
use crate::io::builder::EntityGroup;
use crate::io::scan::Scan;
use crate::mesh::CellPartitions;

/// The tags of one element, and how many elements had tags that are not kept as they are.
#[derive(Default)]
pub struct Tags {
    pub values: Vec<i32>,
    /// Elements whose further tags have no known meaning.
    pub odd: usize,
    /// How many elements of each entity have a minus sign before the number of their group.
    pub reversed: HashMap<EntityGroup, usize>,
}

impl Tags {
    #[inline]
    pub fn read(&mut self, scan: &mut Scan<'_>, count: usize) -> Result<()> {
        self.values.clear();
        for _ in 0..count {
            self.values.push(scan.i32()?);
        }
        Ok(())
    }

    /// The group of a physical tag, which may be negative, of `count` elements; 0 means none.
    #[inline]
    pub fn group(&mut self, dim: u8, entity: i32, physical: i32, count: usize) -> i64 {
        let group = i64::from(physical).abs();
        if physical < 0 {
            *self.reversed.entry((dim, entity, group)).or_insert(0) += count;
        }
        group
    }

    /// The partitions among the tags: in 2.2 their number, then each; negative for ghosts.
    pub fn partitions(&mut self, cell: u32, layout: Layout) -> Option<CellPartitions> {
        let ids = match (layout, self.values.get(2..)?) {
            (_, []) => return None,
            (Layout::V22, [count, ids @ ..]) if usize::try_from(*count) == Ok(ids.len()) => ids,
            (Layout::V2, ids @ [_]) => ids,
            _ => {
                self.odd += 1;
                return None;
            }
        };
        let (owners, ghosts): (Vec<i32>, Vec<i32>) =
            ids.iter().filter(|id| **id != 0).partition(|id| **id > 0);
        let ghosts: Vec<i32> = ghosts.into_iter().map(i32::wrapping_neg).collect();
        (!owners.is_empty() || !ghosts.is_empty()).then_some(CellPartitions {
            cell,
            owners,
            ghosts,
        })
    }
}
