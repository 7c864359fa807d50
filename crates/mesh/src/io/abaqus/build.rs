//! The mesh of all instances.

use std::collections::HashMap;

use nalgebra::{Rotation3, Unit, Vector3};

use super::elements;
use super::model::{Element, Instance, Member, Part, Set, Surface};
use crate::error::Result;
use crate::field::{Tell, Unread};
use crate::io::builder::{Builder, Lookup, Numbering, points_in_order};
use crate::io::scan::Scan;
use crate::io::sides::side;
use crate::memory;
use crate::mesh::{CellKind, Mesh};

/// The contents of the files.
#[derive(Default)]
pub struct Model {
    pub root: Part,
    pub parts: Vec<Part>,
    pub instances: Vec<Instance>,
    /// Bytes of all files.
    pub bytes: usize,
}

/// Where the nodes and elements of an instance are in the mesh.
struct Placed {
    first_point: u32,
    first_cell: u32,
    points: Lookup,
    cells: Lookup,
    shells: Vec<bool>,
}

/// Sets that are resolved: by instance, none for the assembly, kind and name in capitals; points or cells.
type Sets = HashMap<(Option<String>, bool, String), Vec<u32>>;

struct Building<'a> {
    builder: Builder,
    placed: HashMap<String, Placed>,
    sets: Sets,
    scan: &'a Scan<'a>,
    unread: &'a mut Vec<Unread>,
    /// How many members sets may still have: a few lines can mean sets of everything.
    left: usize,
}

/// The instance of what is in none.
const ROOT: &str = "";

impl Model {
    pub fn build(mut self, scan: &Scan<'_>, unread: &mut Vec<Unread>) -> Result<Mesh> {
        let missing: Vec<Instance> = match self.instances.is_empty() {
            // A file with only parts.
            true => self
                .parts
                .iter()
                .map(|part| Instance {
                    name: part.name.clone(),
                    part: part.name.to_ascii_uppercase(),
                    ..Instance::default()
                })
                .collect(),
            false => Vec::new(),
        };
        self.instances.extend(missing);
        let parts: HashMap<String, &Part> = self
            .parts
            .iter()
            .map(|part| (part.name.to_ascii_uppercase(), part))
            .collect();
        let alone = self.instances.len() + usize::from(!self.root.points.is_empty()) == 1;
        let mut building = Building {
            builder: Builder::default(),
            placed: HashMap::new(),
            sets: Sets::new(),
            scan,
            unread,
            left: self.bytes.saturating_mul(16).saturating_add(1 << 20),
        };
        let mut numbers = Numbering::default();
        let nothing = Part::default();
        let root = Instance::default();
        let mut all = vec![(ROOT.to_owned(), vec![&self.root], &root)];
        for instance in &self.instances {
            let base = parts.get(&instance.part).copied();
            if base.is_none() && !instance.part.is_empty() {
                return Err(scan.error(format!(
                    "the instance {:?} is of the part {:?}, which does not exist",
                    instance.name, instance.part
                )));
            }
            all.push((
                instance.name.to_ascii_uppercase(),
                vec![base.unwrap_or(&nothing), &instance.own],
                instance,
            ));
        }
        for (key, pieces, instance) in &all {
            building.place(key, pieces, instance, alone, &mut numbers)?;
        }
        building.finish_points(numbers, alone)?;
        for (key, pieces, instance) in &all {
            building.cells(key, pieces, instance, alone)?;
        }
        for (key, pieces, instance) in all.iter().rev() {
            let scope = Some(key.clone()).filter(|key| key != ROOT);
            let prefix = match alone || scope.is_none() {
                true => String::new(),
                false => format!("{}.", instance.name),
            };
            for piece in pieces {
                for set in &piece.sets {
                    building.set(scope.as_ref(), &prefix, set)?;
                }
            }
            for piece in pieces {
                for surface in &piece.surfaces {
                    building.surface(scope.as_ref(), &prefix, surface)?;
                }
            }
        }
        building.builder.finish_cells(scan)?;
        Ok(building.builder.finish())
    }
}

impl Building<'_> {
    /// Places the nodes of an instance.
    fn place(
        &mut self,
        key: &str,
        pieces: &[&Part],
        instance: &Instance,
        alone: bool,
        numbers: &mut Numbering,
    ) -> Result<()> {
        let count: usize = pieces
            .iter()
            .map(|piece| piece.points.len() + piece.elements.len())
            .sum();
        memory::require(
            200.0 * count as f64,
            &format!("the instance {:?}", instance.name),
        )?;
        let turn = instance.turn.map(|[ax, ay, az, bx, by, bz, angle]| {
            let a = Vector3::new(ax, ay, az);
            let axis =
                Unit::try_new(Vector3::new(bx, by, bz) - a, 0.0).unwrap_or(Vector3::z_axis());
            (a, Rotation3::from_axis_angle(&axis, angle.to_radians()))
        });
        let first_point = self.builder.mesh.points.len() as u32;
        for point in pieces.iter().flat_map(|piece| &piece.points) {
            let mut point = Vector3::from(*point) + Vector3::from(instance.shift);
            if let Some((origin, turn)) = turn {
                point = origin + turn * (point - origin);
            }
            self.builder.mesh.points.to_mut().push(point.into());
        }
        let own: Vec<u64> = pieces
            .iter()
            .flat_map(|piece| piece.numbers.iter().copied())
            .collect();
        for (&number, next) in own.iter().zip(u64::from(first_point) + 1..) {
            numbers.push(if alone { number } else { next });
        }
        let twice = |tag| self.scan.error(format!("node {tag} appears twice"));
        let placed = Placed {
            first_point,
            first_cell: 0,
            points: Lookup::new(&own).map_err(twice)?,
            cells: Lookup::Dense { first: 1, count: 0 },
            shells: Vec::new(),
        };
        if self.placed.insert(key.to_owned(), placed).is_some() {
            return Err(self
                .scan
                .error(format!("two instances are called {:?}", instance.name)));
        }
        Ok(())
    }

    fn finish_points(&mut self, numbers: Numbering, alone: bool) -> Result<()> {
        if !alone {
            self.unread.tell(
                "numbers",
                "the numbers of nodes and elements, which several instances share",
            );
        }
        if numbers.len() == 0 {
            return Err(self.scan.error_with(
                "the file has no nodes",
                "give the file with the mesh, or put the included files next to it",
            ));
        }
        self.builder.finish_points(self.scan, numbers)
    }

    /// Adds the elements of an instance.
    fn cells(
        &mut self,
        key: &str,
        pieces: &[&Part],
        instance: &Instance,
        alone: bool,
    ) -> Result<()> {
        let Some(placed) = self.placed.get_mut(key) else {
            return Ok(());
        };
        placed.first_cell = self.builder.cell_count();
        let elements: Vec<&Element> = pieces.iter().flat_map(|piece| &piece.elements).collect();
        for element in &elements {
            let kind = element.kind;
            let point = |node| Some(placed.first_point + placed.points.get(node)?);
            let order = elements::order(kind);
            let nodes = points_in_order(self.scan, element.number, &element.nodes, &order, point)?;
            let number = if alone {
                element.number
            } else {
                self.builder.new_number()
            };
            self.builder.cell(kind, &nodes, number, 0);
        }
        let numbers: Vec<u64> = elements.iter().map(|element| element.number).collect();
        let twice = |tag| self.scan.error(format!("element {tag} appears twice"));
        placed.cells = Lookup::new(&numbers).map_err(twice)?;
        placed.shells = elements.iter().map(|element| element.shell).collect();
        if !alone && !instance.name.is_empty() {
            let first = placed.first_cell;
            self.builder
                .set(&instance.name, first..first + numbers.len() as u32);
        }
        Ok(())
    }

    /// The points or the cells of a member, by where it is used.
    fn members(
        &mut self,
        scope: Option<&String>,
        of_nodes: bool,
        member: &Member,
    ) -> Result<Option<Vec<u32>>> {
        let within = |instance: &Option<String>| {
            let name = instance.as_ref().or(scope).map_or(ROOT, String::as_str);
            let first = |placed: &Placed| {
                if of_nodes {
                    placed.first_point
                } else {
                    placed.first_cell
                }
            };
            let placed = self.placed.get(name)?;
            Some((
                first(placed),
                if of_nodes {
                    &placed.points
                } else {
                    &placed.cells
                },
            ))
        };
        let found = match member {
            Member::Number(instance, number) => within(instance)
                .and_then(|(first, lookup)| Some(vec![first + lookup.get(*number)?])),
            Member::Range(instance, [low, high, step]) => {
                within(instance).map(|(first, lookup)| {
                    let most = self.left;
                    let numbers = (*low..=*high)
                        .step_by(usize::try_from(*step).unwrap_or(usize::MAX))
                        .take(most);
                    numbers
                        .filter_map(|number| Some(first + lookup.get(number)?))
                        .collect()
                })
            }
            Member::Set(instance, name) => {
                let scope = instance.clone().or(scope.cloned());
                self.sets.get(&(scope, of_nodes, name.clone())).cloned()
            }
        };
        let more = match member {
            Member::Range(_, [low, high, step]) => {
                usize::try_from(high.saturating_sub(*low) / step).unwrap_or(usize::MAX)
            }
            _ => 0,
        };
        let taken = found.as_ref().map_or(1, Vec::len).max(more);
        self.spend(taken)?;
        Ok(found)
    }

    /// Counts members of sets, and what their names take.
    fn spend(&mut self, members: usize) -> Result<()> {
        self.left = self.left.checked_sub(members).ok_or_else(|| {
            self.scan
                .error("the sets have more members than is plausible for a file of this size")
        })?;
        Ok(())
    }

    fn set(&mut self, scope: Option<&String>, prefix: &str, set: &Set) -> Result<()> {
        self.spend(8 + prefix.len() + set.name.len())?;
        let (mut all, mut missing) = (Vec::new(), 0);
        for member in &set.members {
            match self.members(scope, set.of_nodes, member)? {
                Some(found) => all.extend(found),
                None => missing += 1,
            }
        }
        if missing > 0 {
            let what = if set.of_nodes { "nodes" } else { "elements" };
            self.unread.tell(
                &set.name,
                format!(
                    "{missing} members of the set {:?} of {what}, which do not exist",
                    set.name
                ),
            );
        }
        all.sort_unstable();
        all.dedup();
        let name = format!("{prefix}{}", set.name);
        match set.of_nodes {
            true => self.vertices(&name, &all),
            false => self.builder.set(&name, all.iter().copied()),
        }
        self.sets.insert(
            (scope.cloned(), set.of_nodes, set.name.to_ascii_uppercase()),
            all,
        );
        Ok(())
    }

    fn vertices(&mut self, name: &str, points: &[u32]) {
        let builder = &mut self.builder;
        let cells: Vec<u32> = points
            .iter()
            .map(|&point| builder.side(CellKind::Vertex, &[point]))
            .collect();
        builder.set(name, cells);
    }

    fn surface(&mut self, scope: Option<&String>, prefix: &str, surface: &Surface) -> Result<()> {
        self.spend(8 + prefix.len() + surface.name.len())?;
        let name = format!("{prefix}{}", surface.name);
        let mut lost = 0;
        for (member, label) in &surface.sides {
            let Some(found) = self.members(scope, surface.of_nodes, member)? else {
                lost += 1;
                continue;
            };
            if surface.of_nodes {
                self.vertices(&name, &found);
                continue;
            }
            let sides: Vec<u32> = found
                .iter()
                .filter_map(|&cell| self.side_of(cell, label))
                .collect();
            lost += found.len() - sides.len();
            self.builder.set(&name, sides);
        }
        if lost > 0 {
            self.unread.tell(
                &surface.name,
                format!(
                    "{lost} members of the surface {:?}, which are not sides of elements",
                    surface.name
                ),
            );
        }
        Ok(())
    }

    /// The cell that is a side of another.
    fn side_of(&mut self, cell: u32, label: &str) -> Option<u32> {
        let shell = self.placed.values().find_map(|placed| {
            placed
                .shells
                .get(cell.checked_sub(placed.first_cell)? as usize)
                .copied()
        });
        let (kind, nodes) = self.builder.mesh.cell(cell)?;
        match elements::side(kind.shape(), shell?, label)? {
            None => Some(cell),
            Some(corners) => {
                let (kind, nodes) = side(kind, nodes, corners)?;
                Some(self.builder.side(kind, &nodes))
            }
        }
    }
}
