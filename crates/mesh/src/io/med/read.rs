//! Reads MED files.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::ops::Range;
use std::path::Path;

use super::cells;
use crate::error::Result;
use crate::field::{Tell, Unread};
use crate::io::hdf5::{self, Data, Group};
use crate::io::raw::{self, Nodes, index};
use crate::io::sets::Sets;
use crate::io::{Content, elements};
use crate::mesh::{CellBlock, CellKind, Field, Support, Values};

/// The groups of each family by its number, and the family's own name where it has none.
type Families = HashMap<i64, Vec<String>>;

/// Runs of points or cells, and the family of each run.
type Runs = Vec<(Range<u32>, i64)>;

/// Points or cells, and their values.
type Part = (Vec<u32>, Vec<f64>);

struct Reader {
    file: Group,
    mesh: String,
    sets: Sets,
    /// The cells of each kind.
    cells: BTreeMap<CellKind, Range<u32>>,
    unread: Vec<Unread>,
}

pub fn read(path: &Path, bytes: &[u8]) -> Result<Content> {
    let file = hdf5::open(path, bytes)?;
    let about = file.group("INFOS_GENERALES")?;
    let number = |name: &str| about.as_ref().and_then(|about| about.number(name));
    let version: Vec<String> = ["MAJ", "MIN", "REL"]
        .iter()
        .filter_map(|name| Some(number(name)?.to_string()))
        .collect();
    let meshes = file.groups_of("ENS_MAA")?;
    let Some((name, mesh)) = meshes.first() else {
        return Err(file.refuse("there is no mesh (ENS_MAA)"));
    };
    let mut reader = Reader {
        mesh: name.clone(),
        sets: Sets::default(),
        cells: BTreeMap::new(),
        unread: Vec::new(),
        file,
    };
    for (name, _) in meshes.iter().skip(1) {
        let what = format!("the mesh {name:?}, a further one");
        reader.unread.tell(name, what);
    }
    if mesh.number("TYP").is_some_and(|kind| kind == 1.0) {
        return Err(mesh.refuse("this is a structured mesh of MED, which is not read"));
    }
    // Meshes may change with time; before version 3 they did not.
    let steps = mesh.groups()?;
    let mut of_steps: Vec<&Group> = steps
        .iter()
        .filter(|(name, _)| !["NOE", "MAI", "FAC", "ARE", "JNT", "EQS"].contains(&name.as_str()))
        .map(|(_, step)| step)
        .collect();
    of_steps.sort_by(|a, b| a.name.cmp(&b.name));
    let at = match of_steps.first() {
        Some(step) => step,
        None => mesh,
    };
    let others = of_steps.len().saturating_sub(1);
    if others > 0 {
        reader
            .unread
            .tell("steps", format!("{others} further steps of the mesh"));
    }
    let families = reader.families()?;
    let of_nodes = reader.nodes(at, mesh)?;
    let of_cells = reader.cells(at)?;
    reader.groups(&families, of_nodes, of_cells);
    reader.fields()?;
    let name = |path: &str| {
        let mut parts = path.split('/').skip(1);
        let name = match (parts.next(), parts.next()) {
            (Some("CHA"), field) => field,
            (Some("ENS_MAA"), Some(mesh)) if mesh != reader.mesh => Some(mesh),
            _ => path.rsplit('/').next(),
        };
        name.map(str::to_owned)
    };
    reader.file.unread(&mut reader.unread, name)?;
    let (mesh, warnings) = reader.sets.finish();
    Ok(Content {
        mesh,
        version: Some(version.join(".")),
        encoding: "binary-little".into(),
        warnings,
        unread: reader.unread,
        ..Content::default()
    })
}

fn whole_numbers(data: &Data) -> Result<Vec<i64>> {
    data.raw(None)?.integers().ok_or_else(|| not_whole(data))
}

fn not_whole(data: &Data) -> crate::Error {
    data.refuse("it does not contain integers")
}

/// The families of `count` points or cells, numbered from `first` on; 0 if none is given.
fn families_of(group: &Group, first: u32, count: usize) -> Result<Runs> {
    let Some(data) = group.data("FAM")? else {
        return Ok(Runs::new());
    };
    let numbers = Some(data.raw(None)?).filter(|numbers| numbers.len() == count);
    let runs = numbers.map_or(Some(Default::default()), |numbers| numbers.runs(1));
    let (runs, families) = runs.ok_or_else(|| not_whole(&data))?;
    let cells = runs
        .into_iter()
        .map(|run| first + run.start..first + run.end);
    Ok(cells.zip(families).collect())
}

/// The integers of a data set, if it is there.
fn numbers_of(group: &Group, name: &str) -> Result<Option<Vec<i64>>> {
    group
        .data(name)?
        .map(|data| whole_numbers(&data))
        .transpose()
}

impl Reader {
    fn families(&self) -> Result<Families> {
        let mut families = Families::new();
        let Some(all) = self.file.group(&format!("FAS/{}", self.mesh))? else {
            return Ok(families);
        };
        let mut found = all.groups()?;
        for folder in ["ELEME", "NOEUD"] {
            found.extend(all.groups_of(folder)?);
        }
        for (name, family) in found {
            let Some(number) = family
                .integers("NUM")
                .and_then(|numbers| numbers.first().copied())
            else {
                continue;
            };
            let mut groups = Vec::new();
            if let Some(names) = family.data("GRO/NOM")? {
                groups = texts(&names)?;
            }
            groups.retain(|group| !group.is_empty());
            if groups.is_empty() && number != 0 {
                groups.push(name);
            }
            families.insert(number, groups);
        }
        Ok(families)
    }

    /// Reads the points; their families.
    fn nodes(&mut self, at: &Group, mesh: &Group) -> Result<Runs> {
        let nodes = at
            .group("NOE")?
            .ok_or_else(|| at.refuse("there are no nodes (NOE)"))?;
        let data = nodes.needed("COO")?;
        let values = data.raw(None)?;
        let space = mesh
            .number("ESP")
            .or(mesh.number("DIM"))
            .map_or(3, |n| n as usize);
        if !(1..=3).contains(&space) || !values.len().is_multiple_of(space) {
            return Err(data.refuse(format!("{} coordinates of {space} axes", values.len())));
        }
        let count = values.len() / space;
        let columns: Vec<_> = (0..space).map(|axis| (&values, axis * count)).collect();
        self.sets.mesh.points = raw::points(&columns, count);
        let own = numbers_of(&nodes, "NUM")?.filter(|own| own.len() == count);
        if let Some(own) = own.filter(|own| !own.iter().zip(1..).all(|(&n, k)| n == k)) {
            self.sets.mesh.point_tags = own.into_iter().map(|n| n.max(0) as u64).collect();
        }
        families_of(&nodes, 0, count)
    }

    /// Reads the cells; the family of each.
    fn cells(&mut self, at: &Group) -> Result<Runs> {
        let points = self.sets.mesh.points.len();
        let mut families = Vec::new();
        for (name, group) in at.groups_of("MAI")? {
            let known = kind_of(&name);
            let polygons = ["POG", "PO2"].contains(&name.as_str());
            let first = self.sets.mesh.cell_count() as u32;
            let count;
            match known {
                Some(kind) => {
                    let data = group.needed("NOD")?;
                    let (numbers, width) = (data.raw(None)?, kind.points());
                    count = numbers.len() / width;
                    if !numbers.len().is_multiple_of(width) {
                        return Err(data
                            .refuse(format!("{} nodes do not make {kind} cells", numbers.len())));
                    }
                    let nodes = numbers.nodes(&Nodes {
                        base: 1,
                        points: 0..points as u32,
                        width,
                        order: &cells::order(kind),
                        by_place: true,
                    });
                    let mut block = CellBlock::of(kind, nodes.map_err(|what| data.refuse(what))?);
                    if let Some(own) = numbers_of(&group, "NUM")?
                        && own.len() == count
                    {
                        block.tags = own.into_iter().map(|n| n.max(0) as u64).collect();
                    }
                    let cells = self.sets.block(block);
                    self.cells.insert(kind, cells);
                }
                None if polygons => {
                    let data = group.needed("NOD")?;
                    let (numbers, ends) =
                        (whole_numbers(&data)?, whole_numbers(&group.needed("INN")?)?);
                    count = ends.len().saturating_sub(1);
                    for pair in ends.windows(2) {
                        let range = index(pair[0], numbers.len() + 1)
                            .zip(index(pair[1], numbers.len() + 1));
                        let of = range
                            .and_then(|(a, b)| numbers.get(a as usize..b as usize))
                            .filter(|of| !of.is_empty());
                        let of = of.ok_or_else(|| {
                            data.refuse("INN does not say where its polygons end")
                        })?;
                        let mut nodes = Vec::with_capacity(of.len());
                        for &node in of {
                            nodes.push(
                                index(node, points).ok_or_else(|| beyond(&data, node, points))?,
                            );
                        }
                        let kind = match nodes.len() {
                            3 => CellKind::Triangle,
                            4 => CellKind::Quadrangle,
                            many => CellKind::Polygon(many as u32),
                        };
                        match self.sets.mesh.blocks.last_mut() {
                            Some(last) if last.kind == kind && last.tags.is_empty() => {
                                last.nodes.to_mut().extend(nodes)
                            }
                            _ => drop(self.sets.block(CellBlock::new(kind, nodes))),
                        }
                    }
                }
                None => {
                    self.unread.tell(
                        &*name,
                        format!("the cells {name}, of a kind that is not read"),
                    );
                    continue;
                }
            }
            families.extend(families_of(&group, first, count)?);
        }
        // Numbers are those of all blocks or of none.
        let blocks = &mut self.sets.mesh.blocks;
        let some_lack = blocks.iter().any(|block| block.tags.is_empty());
        let mut all = blocks.iter().flat_map(|block| &block.tags).zip(1..);
        if some_lack || all.all(|(&tag, k)| tag == k) {
            blocks.iter_mut().for_each(|block| block.tags.clear());
        }
        Ok(families)
    }

    /// The groups of nodes and cells, numbered in the order of their names.
    fn groups(&mut self, families: &Families, of_nodes: Runs, of_cells: Runs) {
        let by_name = |of: Runs| {
            let mut members: BTreeMap<&str, Vec<Range<u32>>> = BTreeMap::new();
            for (run, family) in of {
                for name in families.get(&family).into_iter().flatten() {
                    members.entry(name).or_default().push(run.clone());
                }
            }
            members
        };
        let cells = by_name(of_cells);
        let nodes = by_name(of_nodes);
        // A group that nothing is in is there all the same.
        let used = cells.keys().chain(nodes.keys());
        let used: HashSet<&str> = used.copied().collect();
        let all = families.values().flatten().map(String::as_str);
        let empty: BTreeSet<&str> = all.filter(|name| !used.contains(name)).collect();
        let dim = self.sets.mesh.dim();
        let mut tag = 0;
        for (name, cells) in cells
            .into_iter()
            .chain(empty.into_iter().map(|name| (name, Vec::new())))
        {
            tag += 1;
            self.sets.cells(dim, tag, name, cells);
        }
        for (name, nodes) in nodes {
            tag += 1;
            self.sets.nodes(tag, name, nodes.into_iter().flatten());
        }
    }

    fn fields(&mut self) -> Result<()> {
        for (name, field) in self.file.groups_of("CHA")? {
            let components = field.number("NCO").map_or(1, |n| n as usize).max(1);
            if field.text("MAI").is_some_and(|mesh| mesh != self.mesh) {
                self.unread.tell(
                    &*name,
                    format!("the field {name:?}, which is on another mesh"),
                );
                continue;
            }
            let mut steps = field.groups()?;
            steps.sort_by(|a, b| a.0.cmp(&b.0));
            for (_, step) in steps {
                self.step(&name, components, &step)?;
            }
        }
        Ok(())
    }

    /// The values of a field at a step: on nodes, on cells of each kind, or at the nodes of these.
    fn step(&mut self, name: &str, components: usize, step: &Group) -> Result<()> {
        let number = step
            .integers("NDT")
            .and_then(|n| n.first().copied())
            .filter(|&n| n >= 0);
        let time = step
            .number("PDT")
            .filter(|time| number.is_some() && time.is_finite());
        let number = number.and_then(|n| i32::try_from(n).ok());
        let mut parts: BTreeMap<Support, Vec<Part>> = BTreeMap::new();
        for (place, support) in step.groups()? {
            let (on, kind) = match place.split_once('.') {
                None if place == "NOE" => (Support::Points, None),
                Some(("MAI", kind)) => (Support::Cells, Some(kind)),
                Some(("NOE" | "NOM", kind)) => (Support::CellPoints, Some(kind)),
                _ => {
                    self.unread
                        .tell(name, format!("the field {name:?} on {place}"));
                    continue;
                }
            };
            let range = match kind {
                None => Some((0..self.sets.mesh.points.len() as u32, CellKind::Vertex)),
                Some(kind) => {
                    kind_of(kind).and_then(|kind| Some((self.cells.get(&kind)?.clone(), kind)))
                }
            };
            let Some((range, kind)) = range else {
                self.unread
                    .tell(name, format!("the field {name:?} on {place}"));
                continue;
            };
            for (profile, values) in support.groups()? {
                let Some(data) = values.data("CO")? else {
                    continue;
                };
                let gauss = values.number("NGA").map_or(1, |n| n as usize).max(1);
                let per = if on == Support::CellPoints {
                    kind.points()
                } else {
                    1
                };
                if gauss != per {
                    self.unread.tell(
                        name,
                        format!("the field {name:?} on {place}, with {gauss} values in a cell"),
                    );
                    continue;
                }
                let items = self.profile(&profile, &range)?;
                let numbers = data.values()?.to_f64();
                let rows = items.len() * per;
                if numbers.len() != rows * components || rows == 0 {
                    let what = format!(
                        "{} values for {components} components of {rows} places",
                        numbers.len()
                    );
                    return Err(data.refuse(what));
                }
                let order = if per > 1 { cells::order(kind) } else { vec![0] };
                let mut turned = vec![0.0; numbers.len()];
                for (c, column) in numbers.chunks_exact(rows).enumerate() {
                    for (k, &value) in column.iter().enumerate() {
                        turned[(k / per * per + order[k % per]) * components + c] = value;
                    }
                }
                parts.entry(on).or_default().push((items, turned));
            }
        }
        for (on, mut parts) in parts {
            parts.sort_by(|a, b| a.0.first().cmp(&b.0.first()));
            let at: Vec<u32> = parts
                .iter()
                .flat_map(|(at, _)| at.iter().copied())
                .collect();
            if !at.is_sorted_by(|a, b| a < b) {
                self.unread.tell(
                    name,
                    format!("the field {name:?} on {on} in parts that overlap"),
                );
                continue;
            }
            let values = parts.into_iter().flat_map(|(_, values)| values).collect();
            let field = Field {
                time,
                step: number,
                ..Field::new(name, on, components, Values::F64(values))
            };
            let all = self.sets.mesh.items(on);
            self.sets.mesh.fields.push(field.only(at, all));
        }
        Ok(())
    }

    /// The points or cells that have values, ascending.
    fn profile(&self, name: &str, range: &Range<u32>) -> Result<Vec<u32>> {
        let Some(data) = self.file.data(&format!("PROFILS/{name}/PFL"))? else {
            return Ok(range.clone().collect());
        };
        let numbers = whole_numbers(&data)?;
        let items = numbers.into_iter().map(|n| {
            index(n, range.len())
                .map(|n| range.start + n)
                .ok_or_else(|| beyond(&data, n, range.len()))
        });
        let items: Vec<u32> = items.collect::<Result<_>>()?;
        match items.is_sorted_by(|a, b| a < b) {
            true => Ok(items),
            false => Err(data.refuse("a profile that is not ascending is not read")),
        }
    }
}

fn kind_of(name: &str) -> Option<CellKind> {
    elements::kind(|element| element.med, name)
}

fn beyond(data: &Data, number: i64, count: usize) -> crate::Error {
    data.refuse(format!("it names {number} of {count}"))
}

/// Names of 80 bytes each, as numbers or as texts.
fn texts(data: &Data) -> Result<Vec<String>> {
    if data.is_text() && data.shape().len() < 2 {
        return data.texts();
    }
    let bytes: Vec<u8> = data
        .values()?
        .to_f64()
        .into_iter()
        .map(|byte| byte as i64 as u8)
        .collect();
    let name = |bytes: &[u8]| {
        let text = bytes.split(|&byte| byte == 0).next().unwrap_or_default();
        String::from_utf8_lossy(text).trim_end().to_owned()
    };
    Ok(bytes.chunks(80).map(name).collect())
}
