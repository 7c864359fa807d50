//! Reads values without cells of the domain: on faces, by vertex numbers, or by positions.

use super::{Foreign, Reader};
use faceoff_fem::element::{CR, Element, P1, P2, Space};
use faceoff_judge::partners;
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::Triangulation;

impl Reader<'_> {
    /// Values on the faces: those of CR at their midpoints.
    pub(super) fn faces(&self, mesh: Triangulation) -> Result<Foreign> {
        let held = self.held;
        let (on, field) = self.field(&[("faces", &held.on_cells)], &["u", "mean"])?;
        self.only(&CR, "values on faces are those of CR")?;
        let other = "give the mesh of the result by --mesh, or --n";
        // Numbers without coordinates are those of the mesh; coordinates determine them.
        let number: Option<Vec<Option<u32>>> = match held.points.is_empty() {
            true => None,
            false => Some(partners(&held.points, &mesh.points)?),
        };
        let vertex = |point: u32| match &number {
            None => Some(point),
            Some(number) => *number.get(point as usize)?,
        };
        let mut u = vec![None; mesh.face_count()];
        for cell in 0..held.cell_count() {
            cancel::check()?;
            let vertices: Option<Vec<u32>> = held.cell(cell).map(vertex).collect();
            let face = vertices.filter(|v| v.len() == mesh.dim).and_then(|mut v| {
                v.sort_unstable();
                mesh.find_face(&v)
            });
            let face = face.ok_or_else(|| {
                let points: Vec<u32> = held.cell(cell).collect();
                self.refuse(
                    format!("{points:?} is not a face of mesh {}", mesh.name),
                    other,
                )
            })?;
            let value = self.row(field, cell as u32, "face")?;
            if u[face].replace(value).is_some() {
                let what = format!("it has {} twice", mesh.face_label(face));
                return Err(self.refuse(what, "write each face once"));
            }
        }
        let lacks = u.iter().position(Option::is_none);
        if let Some(face) = lacks {
            let what = format!(
                "it has no value on {} of mesh {}",
                mesh.face_label(face),
                mesh.name
            );
            return Err(self.refuse(what, other));
        }
        let u = u.into_iter().flatten().collect();
        Ok(self.found(mesh, &CR, u, (on, field)))
    }

    /// Values by vertex numbers, or by positions: the nodes of an element.
    pub(super) fn table(&self, mesh: Triangulation) -> Result<Foreign> {
        let held = self.held;
        let (_, field) = self.field(&[("points", &held.on_points)], &["u"])?;
        let other = "give the mesh of the result by --mesh, or --n";
        let all: Vec<u32> = (0..held.point_count() as u32).collect();
        let items = field.at.as_ref().unwrap_or(&all);
        let every: [&'static dyn Element; 3] = [&P1, &CR, &P2];
        let spaces = every.map(|element| Space::new(&mesh, element));
        let by_number = held.points.is_empty();
        let asked = self.options.element.map(Element::name);
        let fits = spaces.iter().find(|space| {
            let name = space.element.name();
            space.dofs == items.len()
                && asked.is_none_or(|asked| asked == name)
                && (!by_number || name == P1.name())
        });
        let Some(space) = fits else {
            let counts = spaces
                .iter()
                .map(|s| format!("{} has {}", s.element.name(), s.dofs));
            let counts = counts.collect::<Vec<_>>().join(", ");
            let what = format!(
                "`{}` has {} values, and on mesh {} {counts}{}",
                field.name,
                items.len(),
                mesh.name,
                match by_number {
                    true => "; numbers of vertices are those of P1",
                    false => "",
                }
            );
            return Err(self.refuse(what, other));
        };
        let places: Vec<[f64; 3]>;
        let row_of: Vec<Option<u32>> = if by_number {
            let mut row_of = vec![None; space.dofs];
            for (item, row) in items.iter().zip(0..) {
                let id = held.ids[*item as usize];
                let slot = row_of.get_mut(id as usize).ok_or_else(|| {
                    let what = format!("mesh {} has no vertex {id}", mesh.name);
                    self.refuse(what, other)
                })?;
                *slot = Some(row);
            }
            row_of
        } else {
            places = items.iter().map(|i| held.points[*i as usize]).collect();
            let nodes: Vec<[f64; 3]> = space.points().collect();
            partners(&nodes, &places)?
        };
        let value = |(row, dof): (&Option<u32>, usize)| {
            let row = row.ok_or_else(|| {
                let [x, y, z] = space.point(dof);
                let (name, mesh) = (space.element.name(), &mesh.name);
                let what = format!(
                    "it has no single value at ({x}, {y}, {z}), a node of {name} on mesh {mesh}"
                );
                self.refuse(what, other)
            })?;
            Ok(field.values[row as usize])
        };
        let u = row_of.iter().zip(0..).map(value).collect::<Result<_>>()?;
        let element = space.element;
        let on = match by_number {
            true => "vertices",
            false => "places",
        };
        Ok(self.found(mesh, element, u, (on, field)))
    }

    fn only(&self, element: &'static dyn Element, why: &str) -> Result<()> {
        let asked = self.options.element.map(Element::name);
        match asked.filter(|asked| *asked != element.name()) {
            None => Ok(()),
            Some(asked) => {
                Err(self.refuse(format!("{why}, not of {asked}"), "leave out --element"))
            }
        }
    }
}
