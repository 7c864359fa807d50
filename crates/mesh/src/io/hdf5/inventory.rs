//! Unread parts of a file: data sets, and links that lead out of the file or nowhere. The library lists neither
//! kind of link, so the links of a group are taken from where the file stores them.

use std::collections::HashSet;

use hdf5_reader::btree_v1::collect_btree_v1_leaves_storage as leaves_v1;
use hdf5_reader::btree_v2::{self, BTreeV2Header, BTreeV2Record};
use hdf5_reader::error::Error as Inner;
use hdf5_reader::fractal_heap::FractalHeap;
use hdf5_reader::io::Cursor;
use hdf5_reader::local_heap::LocalHeap;
use hdf5_reader::messages::HdfMessage;
use hdf5_reader::messages::link::{LinkTarget, parse};
use hdf5_reader::messages::symbol_table_msg::SymbolTableMessage;
use hdf5_reader::symbol_table::SymbolTableNode;

use super::{Data, Group};
use crate::cancel;
use crate::error::Result;
use crate::field::{Tell, Unread};

impl Group {
    /// Adds everything below that has not been read, by the name that `name` makes of its path; without one it is harmless, and
    /// for a name that already exists the reader has reported why.
    pub fn unread(
        &self,
        unread: &mut Vec<Unread>,
        name: impl Fn(&str) -> Option<String>,
    ) -> Result<()> {
        let (mut left, mut seen) = (Vec::new(), HashSet::new());
        self.walk(&mut left, &mut seen)?;
        let told: HashSet<String> = unread.iter().map(|one| one.name.clone()).collect();
        for (path, target) in left {
            if let Some(name) = name(&path).filter(|name| !told.contains(name)) {
                match target {
                    None => {
                        let what = format!("the data set {path}, which has no place in a mesh");
                        unread.tell(name, what);
                    }
                    Some(target) => {
                        let what = format!("the link {path} to {target}");
                        unread.push(Unread::outside(name, what));
                    }
                }
            }
        }
        Ok(())
    }

    /// The paths of data sets, and of links with their targets.
    fn walk(
        &self,
        left: &mut Vec<(String, Option<String>)>,
        seen: &mut HashSet<u64>,
    ) -> Result<()> {
        if !seen.insert(self.group.address()) {
            return Ok(());
        }
        let (groups, sets) = self.names()?;
        for name in sets {
            // One that cannot be opened, as a virtual one, was not read either.
            let is_unread = match self.data(&name) {
                Ok(data) => data.is_none_or(|data| data.is_unread()),
                Err(_) => true,
            };
            if is_unread {
                left.push((self.below(&name), None));
            }
        }
        for (name, target) in self.links()? {
            left.push((self.below(&name), Some(target)));
        }
        for name in groups {
            if let Some(group) = self.group(&name)? {
                group.walk(left, seen)?;
            }
        }
        Ok(())
    }

    /// The links in this group that lead out of the file or nowhere, with their targets.
    pub fn links(&self) -> Result<Vec<(String, String)>> {
        cancel::check()?;
        let (groups, sets) = self.names()?;
        let known: HashSet<&String> = groups.iter().chain(&sets).collect();
        let mut links = self.stored().map_err(|e| self.refuse(e.to_string()))?;
        links.retain(|(name, _)| !known.contains(name));
        Ok(links)
    }

    /// All soft and external links in this group.
    fn stored(&self) -> Result<Vec<(String, String)>, Inner> {
        let Some(opened) = &self.file.opened else {
            return Ok(Vec::new());
        };
        let header = opened.get_or_parse_header(self.group.address())?;
        let (storage, group) = (self.group.storage(), &self.group);
        let (offset, length) = (group.offset_size(), group.length_size());
        let mut links = Vec::new();
        let mut add = |name: &str, target: &LinkTarget| match target {
            LinkTarget::Hard { .. } => {}
            LinkTarget::Soft { path } => links.push((name.to_owned(), path.clone())),
            LinkTarget::External { filename, path } => {
                links.push((name.to_owned(), format!("{path} of the file {filename}")));
            }
        };
        for message in &header.messages {
            match message {
                HdfMessage::Link(link) => add(&link.name, &link.target),
                HdfMessage::LinkInfo(info)
                    if !Cursor::is_undefined_offset(info.fractal_heap_address, offset) =>
                {
                    let heap = info.fractal_heap_address;
                    let heap = FractalHeap::parse_at_storage(storage, heap, offset, length)?;
                    let tree = info.btree_name_index_address;
                    let tree = BTreeV2Header::parse_at_storage(storage, tree, offset, length)?;
                    let records = btree_v2::collect_btree_v2_records_storage(
                        storage,
                        &tree,
                        offset,
                        length,
                        None,
                        &[],
                        None,
                    )?;
                    for record in &records {
                        if let BTreeV2Record::LinkNameHash { heap_id, .. }
                        | BTreeV2Record::CreationOrder { heap_id, .. } = record
                        {
                            let bytes =
                                heap.get_object_storage(heap_id, storage, offset, length)?;
                            let mut cursor = Cursor::new(&bytes);
                            let link = parse(&mut cursor, offset, length, bytes.len())?;
                            add(&link.name, &link.target);
                        }
                    }
                }
                HdfMessage::SymbolTable(table) => {
                    for (name, path) in self.old_links(table)? {
                        add(&name, &LinkTarget::Soft { path });
                    }
                }
                _ => {}
            }
        }
        Ok(links)
    }

    /// The soft links of a group of the old kind.
    fn old_links(&self, table: &SymbolTableMessage) -> Result<Vec<(String, String)>, Inner> {
        let (storage, group) = (self.group.storage(), &self.group);
        let (offset, length) = (group.offset_size(), group.length_size());
        let heap = LocalHeap::parse_at_storage(storage, table.heap_address, offset, length)?;
        let leaves = leaves_v1(
            storage,
            table.btree_address,
            offset,
            length,
            None,
            &[],
            None,
        )?;
        let mut links = Vec::new();
        for (_, address) in leaves {
            // A signature, a version and the number of entries, then entries of two addresses and 24 bytes.
            let head = storage.read_range(address, 8)?;
            let [.., low, high] = *head.as_ref() else {
                continue;
            };
            let size =
                8 + usize::from(u16::from_le_bytes([low, high])) * (2 * usize::from(offset) + 24);
            let node = storage.read_range(address, size)?;
            let node = SymbolTableNode::parse(&mut Cursor::new(node.as_ref()), offset, length)?;
            for entry in node.entries.iter().filter(|entry| entry.cache_type == 2) {
                let [a, b, c, d, ..] = entry.scratch;
                let target = u64::from(u32::from_le_bytes([a, b, c, d]));
                links.push((
                    heap.get_string_storage(entry.link_name_offset, storage)?,
                    heap.get_string_storage(target, storage)?,
                ));
            }
        }
        Ok(links)
    }
}

impl Data {
    /// Whether it has values that have not been read.
    pub fn is_unread(&self) -> bool {
        let read = self.file.read.borrow();
        !self.shape().contains(&0) && !read.contains(&self.data.address())
    }
}
