//! The table that gives the mesh of a face-off file or a form file.

use super::Source;
use super::tables::{MeshTable, Reader, Several};
use faceoff_form::elastic;
use faceoff_form::grid::Cells;
use faceoff_mesh::error::Result;
use faceoff_mesh::file::beneath;
use faceoff_mesh::mesh::generate::Cuboid;

impl Reader {
    pub fn mesh(&self, table: MeshTable) -> Result<(Option<Source>, Vec<usize>)> {
        let refuse = |what: &str, remedy: &str| self.refuse("mesh", what.to_owned(), remedy);
        let source = match (table.file, table.generator.as_deref()) {
            (Some(name), None) => {
                if table.size.is_some() || table.origin.is_some() {
                    return Err(refuse(
                        "the mesh of a file has its own size",
                        "leave size and origin out",
                    ));
                }
                let carried = || Some((elastic::mesh(&name)?, name.clone()));
                if let (true, Some((bytes, name))) = (self.is_carried, carried()) {
                    return Ok((
                        Some(Source::Carried(name, bytes)),
                        self.refinements(table.n)?,
                    ));
                }
                let path = beneath(&self.home, &name).ok_or_else(|| {
                    refuse(
                        &format!("{name} lies outside of the folder of this file"),
                        "keep the mesh in its folder",
                    )
                })?;
                Some(Source::File(path))
            }
            (None, Some(generator)) => {
                let (dim, cells) = match generator {
                    "union-jack" => (2, Cells::Simplices),
                    "union-cube" => (3, Cells::Simplices),
                    "quadrangles" => (2, Cells::Cubes),
                    "hexahedra" => (3, Cells::Cubes),
                    _ => {
                        let what = format!("there is no generator `{generator}`");
                        let remedy =
                            "take union-jack, union-cube, quadrangles, hexahedra, or a file";
                        return Err(refuse(&what, remedy));
                    }
                };
                let three = |given: Option<Vec<f64>>, default: f64| match given {
                    None => Ok([default; 3]),
                    Some(list) if list.len() == dim && list.iter().all(|x| x.is_finite()) => {
                        Ok([0, 1, 2].map(|k| list.get(k).copied().unwrap_or(default)))
                    }
                    Some(list) => Err(refuse(
                        &format!("{list:?} are not {dim} numbers"),
                        "give one for each dimension",
                    )),
                };
                let (origin, size) = (three(table.origin, 0.0)?, three(table.size, 1.0)?);
                if size.iter().any(|s| *s <= 0.0) {
                    return Err(refuse("a side has no length", "give sizes above 0"));
                }
                let cuboid = match dim {
                    2 => Cuboid::new([origin[0], origin[1]], [size[0], size[1]]),
                    _ => Cuboid::new(origin, size),
                };
                Some(Source::Generated(cuboid, cells))
            }
            (None, None) => None,
            (Some(_), Some(_)) => return Err(refuse("it has a file and a generator", "keep one")),
        };
        Ok((source, self.refinements(table.n)?))
    }

    /// Ascending.
    fn refinements(&self, n: Several<usize>) -> Result<Vec<usize>> {
        let mut n = n.list();
        n.sort_unstable();
        if n.windows(2).any(|pair| pair[0] == pair[1]) || n.first() == Some(&0) {
            let what = "n names a mesh twice, or one without cells".to_owned();
            return Err(self.refuse("mesh", what, "give different numbers from 1 on"));
        }
        Ok(n)
    }
}
