//! From a scene to its mesh.

use super::{MeshSource, Scene};
use crate::error::{Error, Result};
use crate::mesh::generate::{Rectangle, SIDES, union_jack_on};
use crate::mesh::{Mesh, Triangulation};

/// No generated mesh is larger than this, so that a slip of the keyboard is not taken for a wish.
const LARGEST_N: usize = 16_384;

impl MeshSource {
    /// The refinement that the scene itself gives; none where a file has no such number.
    pub fn n(&self) -> Option<usize> {
        match self {
            MeshSource::UnionJack { n, .. } => Some(*n),
            MeshSource::File { n, .. } | MeshSource::Embedded { n, .. } => *n,
        }
    }
}

impl Scene {
    /// The scene's mesh at refinement `n`, ready for the solver; none: as the scene gives it.
    ///
    /// # Errors
    /// A file that cannot be read or holds no usable mesh, an `n` that the mesh cannot have.
    pub fn triangulation(&self, n: Option<usize>) -> Result<Triangulation> {
        let (name, mesh) = self.mesh(n)?;
        Triangulation::new(&name, &mesh)
    }

    /// The scene's mesh at refinement `n` with its name for messages; none: as the scene gives it.
    ///
    /// # Errors
    /// A file that cannot be read, an `n` that the mesh cannot have.
    pub fn mesh(&self, n: Option<usize>) -> Result<(String, Mesh)> {
        let refuse = |what: String, remedy: String| Error::Scene {
            scene: self.name.clone(),
            place: "n".into(),
            what,
            remedy,
        };
        if n == Some(0) {
            return Err(refuse(
                "a mesh with n = 0 has no cells".into(),
                "give n of at least 1".into(),
            ));
        }
        if let Some(n) = n.filter(|n| *n > LARGEST_N) {
            return Err(refuse(
                format!("n = {n} is beyond the largest mesh, {LARGEST_N}"),
                "give a smaller n".into(),
            ));
        }
        let (name, mesh, base) = match &self.mesh {
            MeshSource::UnionJack { n: own, rectangle } => {
                let n = n.unwrap_or(*own);
                if let Some(what) = split_misses(rectangle, n) {
                    let remedy = "give an n that puts a vertex there";
                    return Err(refuse(what, remedy.into()));
                }
                return Ok((format!("union-jack {n}"), union_jack_on(n, rectangle)));
            }
            MeshSource::File { path, n } => {
                (path.display().to_string(), crate::io::read(path)?, *n)
            }
            MeshSource::Embedded { name, bytes, n } => {
                let mesh = crate::io::parse(name.as_ref(), bytes, None)?.mesh;
                ((*name).to_owned(), mesh, *n)
            }
        };
        let times = match (n, base) {
            (None, _) => 0,
            (Some(n), Some(base)) if n % base == 0 && (n / base).is_power_of_two() => {
                (n / base).trailing_zeros()
            }
            (Some(n), Some(base)) => {
                return Err(refuse(
                    format!(
                        "mesh {name} counts as n = {base}, and refining it halves h: n = {n} is not among the meshes"
                    ),
                    format!("give {base}, {}, {}, …", 2 * base, 4 * base),
                ));
            }
            (Some(_), None) => {
                return Err(refuse(
                    format!("the scene does not say what n its mesh {name} counts as"),
                    "set n beside `file`, or leave --n away".into(),
                ));
            }
        };
        let mut mesh = mesh;
        for _ in 0..times {
            // Fields and geometry stay behind: the solver needs neither.
            (mesh, _) = crate::mesh::refine::refine(&mesh).map_err(|what| Error::Mesh {
                mesh: name.clone(),
                what,
                remedy: "give a mesh of linear triangles".into(),
            })?;
        }
        let name = match times {
            0 => name,
            _ => format!("{name} refined {times} times"),
        };
        Ok((name, mesh))
    }
}

/// What is wrong with the splits of a rectangle's sides at refinement `n`, if anything.
fn split_misses(rectangle: &Rectangle, n: usize) -> Option<String> {
    SIDES.iter().enumerate().find_map(|(side, name)| {
        let at = rectangle.splits[side]?;
        if rectangle.split_after(side, n).is_some() {
            return None;
        }
        Some(format!(
            "with n = {n} the {name} side has no vertex inside it at {} = {at}, where it is split",
            ["x", "y"][side % 2]
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_split_side_needs_a_vertex_where_it_is_split() {
        let scene = Scene::find("dirichlet-meets-contact").unwrap();
        assert!(scene.triangulation(Some(6)).is_ok());
        for n in [1, 7] {
            let refusal = scene.triangulation(Some(n)).unwrap_err().to_string();
            assert!(refusal.contains("at x = 0, where it is split"), "{refusal}");
        }
    }
}
