//! From a scene to its mesh.

use super::{MeshSource, Scene};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::generate::{Cuboid, sides, union_mesh};
use faceoff_mesh::mesh::{Mesh, Triangulation};

/// No generated mesh is larger than this, so that a slip of the keyboard is not taken for a wish:
/// 5e8 triangles, 8e8 tetrahedra.
pub(crate) const LARGEST_N: usize = 16_384;
const LARGEST_SOLID_N: usize = 512;

impl MeshSource {
    /// The refinement that the scene itself gives; none where a file has no such number.
    pub fn n(&self) -> Option<usize> {
        match self {
            MeshSource::Union { n, .. } => Some(*n),
            MeshSource::File { n, .. } | MeshSource::Embedded { n, .. } => *n,
        }
    }

    /// The dimension of what the scene is made for; none where that is not known.
    pub fn dim(&self) -> Option<usize> {
        let of = |mesh: Result<Mesh>| mesh.ok().map(|mesh| mesh.dim().into());
        match self {
            MeshSource::Union { cuboid, .. } => Some(cuboid.dim),
            MeshSource::File { dim: Some(dim), .. } => Some(*dim),
            MeshSource::File { path, .. } => of(faceoff_mesh::io::read(path)),
            MeshSource::Embedded { name, bytes, .. } => {
                of(faceoff_mesh::io::parse(name.as_ref(), bytes, None).map(|content| content.mesh))
            }
        }
    }

    /// The reason why it is not a mesh, as far as can be seen without making it.
    pub(super) fn fault(&self) -> Option<String> {
        if self.n() == Some(0) {
            return Some("a mesh with n = 0 has no cells".into());
        }
        let MeshSource::Union { cuboid, .. } = self else {
            return None;
        };
        if !(2..=3).contains(&cuboid.dim) {
            return Some(format!("there is no mesh of dimension {}", cuboid.dim));
        }
        let [origin, size] = [cuboid.origin, cuboid.size].map(|v| v[..cuboid.dim].to_vec());
        let fits = size.iter().all(|s| *s > 0.0 && s.is_finite());
        if fits && origin.iter().all(|x| x.is_finite()) {
            return None;
        }
        Some(format!(
            "there is no rectangle or box at {origin:?} of size {size:?}"
        ))
    }
}

impl Scene {
    /// The scene's mesh at refinement `n`, ready for the solver; none: as the scene gives it.
    ///
    /// # Errors
    /// A file that cannot be read or holds no usable mesh, an `n` that the mesh cannot have.
    pub fn triangulation(&self, n: Option<usize>) -> Result<Triangulation> {
        let (name, mesh) = self.mesh(n)?;
        if let MeshSource::File { dim: Some(dim), .. } = self.source
            && dim != usize::from(mesh.dim())
        {
            let (what, remedy) = match dim {
                2 => (
                    format!("the scene is 2D, and mesh {name} is 3D"),
                    "give a mesh of triangles, or a 3D scene",
                ),
                _ => (
                    format!("the scene is 3D, and mesh {name} has no tetrahedra"),
                    "mesh the volume: a surface is not enough",
                ),
            };
            return Err(Error::Scene {
                scene: self.name.clone(),
                place: "mesh".into(),
                what,
                remedy: remedy.into(),
            });
        }
        Triangulation::new(&name, &mesh)
    }

    /// Whether the generator has a mesh for this n. Split sides need a vertex where they are split.
    pub fn has_mesh(&self, n: usize) -> bool {
        match &self.source {
            MeshSource::Union { cuboid, .. } => split_misses(cuboid, n).is_none(),
            _ => self.mesh(Some(n)).is_ok(),
        }
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
        let largest = match &self.source {
            MeshSource::Union { cuboid, .. } if cuboid.dim == 3 => LARGEST_SOLID_N,
            _ => LARGEST_N,
        };
        if let Some(n) = n.filter(|n| *n > largest) {
            return Err(refuse(
                format!("n = {n} is beyond the largest mesh, {largest}"),
                "give a smaller n".into(),
            ));
        }
        let (name, mesh, base) = match &self.source {
            MeshSource::Union { n: own, cuboid } => {
                let n = n.unwrap_or(*own);
                if let Some(what) = split_misses(cuboid, n) {
                    let remedy = "give an n that puts a vertex there";
                    return Err(refuse(what, remedy.into()));
                }
                let name = ["union-jack", "union-cube"][cuboid.dim - 2];
                return Ok((format!("{name} {n}"), union_mesh(n, cuboid)?));
            }
            MeshSource::File { path, n, .. } => (
                path.display().to_string(),
                faceoff_mesh::io::read(path)?,
                *n,
            ),
            MeshSource::Embedded { name, bytes, n } => {
                let mesh = faceoff_mesh::io::parse(name.as_ref(), bytes, None)?.mesh;
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
                    "set n next to `file`, or omit --n".into(),
                ));
            }
        };
        let mut mesh = mesh;
        for _ in 0..times {
            // Fields and geometry stay behind: the solver needs neither.
            (mesh, _) = faceoff_mesh::mesh::refine::refine(&name, &mesh)?;
        }
        let name = match times {
            0 => name,
            _ => format!("{name} refined {times} times"),
        };
        Ok((name, mesh))
    }
}

/// The error in the splits of a rectangle's sides at refinement `n`, if any.
fn split_misses(cuboid: &Cuboid, n: usize) -> Option<String> {
    cuboid.splits.iter().enumerate().find_map(|(side, at)| {
        let at = (*at)?;
        if cuboid.split_after(side, n).is_some() {
            return None;
        }
        Some(format!(
            "with n = {n} the {} side has no vertex inside it at {} = {at}, where it is split",
            sides(2)[side],
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
