//! Scenes: a TOML file, or a built-in's name, made once into a valid [`Scene`].

mod boundary;
mod exact;
pub mod expression;
mod file;
mod load;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;

pub use boundary::{Boundary, GroupName, Part};
pub use expression::Expression;
pub(crate) use load::LARGEST_N;

use faceoff_mesh::error::{Error, Result, meant};
use faceoff_mesh::mesh::generate::Cuboid;

/// The problem (1.1) with its data and its mesh, valid by construction, and the defaults of its discretisation.
///
/// ```
/// use faceoff_fem::scene::{Data, Expression, Scene};
///
/// # fn main() -> faceoff_mesh::Result<()> {
/// let scene = Scene::parse(
///     r#"
///     name = "square"
///     [mesh]
///     generator = "union-jack"
///     n = 8
///     [boundary]
///     dirichlet = ["top"]
///     neumann = ["left", "right"]
///     contact = ["bottom"]
///     [data]
///     f = "-2*pi*sin(2*pi*x)"
///     "#,
/// )?;
/// assert_eq!(scene.triangulation(None)?.cell_count(), 2 * 8 * 8);
///
/// let psi = Expression::parse("0.01*x").expect("a formula");
/// let raised = scene.with_data(Data {
///     psi,
///     ..scene.data().clone()
/// });
/// assert_ne!(raised.data(), scene.data());
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Scene {
    name: String,
    source: MeshSource,
    boundary: Boundary,
    data: Data,
    gamma0: f64,
    h: HRule,
    load_quadrature: Option<String>,
    contact_quadrature: Option<String>,
    exact: Option<Exact>,
    compare: Option<Comparing>,
}

/// What is known about u.
#[derive(Debug, Clone, PartialEq)]
pub enum Exact {
    /// u in closed form.
    Formula(Expression),
    /// No formula, but a solution without a mesh.
    MeshFree(MeshFree),
}

/// Problems that [`crate::truth::Reference`] solves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeshFree {
    /// The paper's 6.1.
    OneZone,
}

impl Exact {
    /// The formula, where there is one.
    pub fn formula(&self) -> Option<&Expression> {
        match self {
            Exact::Formula(u) => Some(u),
            Exact::MeshFree(_) => None,
        }
    }
}

/// Tolerances of results that files hold, as far as a scene gives them.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparing {
    /// The tolerances of fields without separate ones.
    pub of_all: Bounds,
    /// By the names of fields.
    pub of_field: BTreeMap<String, Bounds>,
}

/// |a - b| ≤ max(rtol · largest value of the field, atol)
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bounds {
    /// Relative to the largest value of the field.
    pub rtol: Option<f64>,
    /// In the unit of the field.
    pub atol: Option<f64>,
}

/// Where the mesh comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum MeshSource {
    /// n × n cells of a rectangle or n × n × n of a box, cut Union-Jack style.
    Union {
        /// Cells along each side, before each is cut.
        n: usize,
        /// The rectangle or the box.
        cuboid: Cuboid,
    },
    /// A mesh file. `n` is the refinement that the file counts as; `2^k n` refines it k times. `dim`
    /// is the dimension that the scene is made for, where that is known.
    File {
        /// In any format that [`faceoff_mesh::io`] reads.
        path: PathBuf,
        /// At least 1; without it the mesh cannot be refined.
        n: Option<usize>,
        /// 2 or 3.
        dim: Option<usize>,
    },
    /// A mesh that the program carries with it.
    Embedded {
        /// Its file name, whose suffix gives the format.
        name: &'static str,
        /// The file.
        bytes: &'static [u8],
        /// The refinement that it counts as.
        n: Option<usize>,
    },
}

/// Data of (1.1), inhomogeneous.
#[derive(Debug, Clone, PartialEq)]
pub struct Data {
    /// -Δu = f in Ω
    pub f: Expression,
    /// u = g on Γ_D
    pub g: Expression,
    /// ∂ₙu = t on Γ_N
    pub t: Expression,
    /// u ≤ ψ on Γ_C
    pub psi: Expression,
}

/// The meaning of h in γ = γ₀ h.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HRule {
    /// The diameter of the cell behind the contact face.
    Local,
    /// The largest diameter of all cells.
    Global,
}

/// Built-in scenes by name, each in `builtin/NAME.toml`.
macro_rules! builtin {
    ($($name:literal),* $(,)?) => {
        &[$(($name, include_str!(concat!("builtin/", $name, ".toml")))),*]
    };
}

/// The 2D built-in scenes without a formula for u, in the order in which `verify` runs them.
const BUILTIN: &[(&str, &str)] = builtin!["one-zone", "three-zones", "five-zones", "plate"];

/// Those that are run only when they are named: the 3D ones take longer, and `l-shape` is there to be adapted to.
const NAMED: &[(&str, &str)] = builtin!["l-shape", "one-zone-3d", "block"];

/// Meshes that built-in scenes name.
const EMBEDDED: &[(&str, &[u8])] = &[
    (
        "l-shape.msh",
        include_bytes!("../../../../meshes/l-shape.msh"),
    ),
    ("plate.msh", include_bytes!("../../../../meshes/plate.msh")),
    ("block.msh", include_bytes!("../../../../meshes/block.msh")),
];

impl Scene {
    /// Its name, also in the names of files.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Where the mesh comes from.
    pub fn source(&self) -> &MeshSource {
        &self.source
    }

    /// The groups of each part of the boundary.
    pub fn boundary(&self) -> &Boundary {
        &self.boundary
    }

    /// f, g, t and ψ.
    pub fn data(&self) -> &Data {
        &self.data
    }

    /// The reason that limits the order of any method for this scene, if known.
    pub fn regularity(&self) -> Option<crate::truth::exact::Regularity> {
        exact::regularity(self)
    }

    /// What is known about u.
    pub fn exact(&self) -> Option<&Exact> {
        self.exact.as_ref()
    }

    /// The tolerances of `faceoff compare` for results of this scene.
    pub fn compare(&self) -> Option<&Comparing> {
        self.compare.as_ref()
    }

    /// The default of γ₀ in γ = γ₀ h.
    pub fn gamma0(&self) -> f64 {
        self.gamma0
    }

    /// The default of what h means.
    pub fn h(&self) -> HRule {
        self.h
    }

    /// The default rule for (f, v), by name; none: that of the dimension.
    pub fn load_quadrature(&self) -> Option<&str> {
        self.load_quadrature.as_deref()
    }

    /// The same for Γ_C and Γ_N.
    pub fn contact_quadrature(&self) -> Option<&str> {
        self.contact_quadrature.as_deref()
    }

    /// The same problem by another name.
    ///
    /// # Errors
    /// A name that cannot name files.
    pub fn renamed(&self, name: &str) -> Result<Self> {
        check_name(name, &self.name)?;
        Ok(Scene {
            name: name.to_owned(),
            ..self.clone()
        })
    }

    /// With other data. Nothing is known of their solution.
    pub fn with_data(&self, data: Data) -> Self {
        Scene {
            data,
            exact: None,
            ..self.clone()
        }
    }

    /// With other parts of the boundary. Nothing is known of the solution then.
    pub fn with_boundary(&self, boundary: Boundary) -> Self {
        Scene {
            boundary,
            exact: None,
            ..self.clone()
        }
    }

    /// With another mesh, on which a formula still holds. A mesh-free solution belongs to its own domain, which the
    /// mesh need not have.
    ///
    /// # Errors
    /// A mesh that cannot be generated.
    pub fn with_source(&self, source: MeshSource) -> Result<Self> {
        if let Some(what) = source.fault() {
            return Err(Error::Scene {
                scene: self.name.clone(),
                place: "mesh".into(),
                what,
                remedy: "give n of at least 1, and positive lengths".into(),
            });
        }
        let known = self.exact.clone();
        Ok(Scene {
            source,
            exact: known.filter(|known| known.formula().is_some()),
            ..self.clone()
        })
    }

    /// With other knowledge of u.
    pub fn with_exact(&self, exact: Option<Exact>) -> Self {
        Scene {
            exact,
            ..self.clone()
        }
    }

    /// The names of the scenes that `verify` runs when none is named.
    pub fn builtin_names() -> impl Iterator<Item = &'static str> {
        BUILTIN.iter().map(|(name, _)| *name)
    }

    /// The names of the further built-in scenes without a known solution.
    pub fn further_names() -> impl Iterator<Item = &'static str> {
        NAMED.iter().map(|(name, _)| *name)
    }

    /// The names of the built-in 2D scenes whose solution is known.
    pub fn exact_names() -> Vec<&'static str> {
        exact::names(2)
    }

    /// The names of those in 3D.
    pub fn exact_names_3d() -> Vec<&'static str> {
        exact::names(3)
    }

    /// The names of all built-in scenes, each with what it is for: those that `verify` runs first, those with a known solution
    /// last.
    pub fn catalogue() -> Vec<(&'static str, String)> {
        let texts = BUILTIN.iter().chain(NAMED);
        let texts = texts.map(|(name, text)| (*name, purpose(text)));
        texts.chain(exact::purposes()).collect()
    }

    fn names() -> impl Iterator<Item = &'static str> {
        let exact = [2, 3].into_iter().flat_map(exact::names);
        Scene::builtin_names()
            .chain(Scene::further_names())
            .chain(exact)
    }

    /// A scene from its text in TOML, of which a mesh file would be one that the program carries.
    ///
    /// # Errors
    /// A scene that is not valid.
    pub fn parse(text: &str) -> Result<Self> {
        file::parse("in TOML", text, None, false)
    }

    /// Finds a scene by a built-in's name or by the path of a TOML file.
    ///
    /// # Errors
    /// A name that is neither, or a scene that is not valid or names a mesh outside its own folder: it may be
    /// untrusted, and the contents of a file may show in messages and reports.
    pub fn find(name: &str) -> Result<Self> {
        Self::find_by(name, false)
    }

    /// [`Scene::find`] for a scene that one trusts: its mesh may be anywhere.
    ///
    /// # Errors
    /// The errors of [`Scene::find`] but for the place of the mesh.
    pub fn find_anywhere(name: &str) -> Result<Self> {
        Self::find_by(name, true)
    }

    fn find_by(name: &str, anywhere: bool) -> Result<Self> {
        let mut builtin = BUILTIN.iter().chain(NAMED);
        if let Some((name, text)) = builtin.find(|(builtin, _)| *builtin == name) {
            return file::parse(name, text, None, anywhere);
        }
        if let Some(scene) = exact::find(name) {
            return scene;
        }
        let path = Path::new(name);
        if path.extension().is_some_and(|e| e == "toml") {
            let text = faceoff_mesh::file::text(path)?;
            return file::parse(name, &text, path.parent(), anywhere);
        }
        let names = Scene::names();
        Err(Error::usage(
            format!("there is no scene `{name}`"),
            format!(
                "{}give a TOML file or a built-in scene, which `faceoff scenes` lists",
                meant(name, names)
            ),
        ))
    }
}

/// The first sentence of the comment at the head of a scene's text.
fn purpose(text: &str) -> String {
    let lines = text.lines().map_while(|line| line.strip_prefix('#'));
    let comment: Vec<&str> = lines.map(str::trim).collect();
    let comment = comment.join(" ");
    let sentence = comment
        .split_once(". ")
        .map_or(&*comment, |(first, _)| first);
    sentence.trim_end_matches('.').to_owned()
}

/// Names are parts of those of files.
fn check_name(name: &str, scene: &str) -> Result<()> {
    let is_usual = |c: char| c.is_alphanumeric() || "-_.".contains(c);
    if !name.is_empty() && !name.starts_with('.') && name.chars().all(is_usual) {
        return Ok(());
    }
    Err(Error::Scene {
        scene: scene.to_owned(),
        place: "name".into(),
        what: format!("`{name}` cannot name output files"),
        remedy: "use letters, digits, `-`, `_` and `.`".into(),
    })
}
