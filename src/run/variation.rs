//! One changed setting: what a study compares, what stress takes to extremes, and what a code with a different answer
//! may have done.

use std::sync::Arc;

use crate::engine::{Case, Settings};
use faceoff_fem::contact::{Discretisation, Method, Problem};
use faceoff_fem::linear;
use faceoff_fem::scene::{Data, Expression, HRule, Scene};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::{Mesh, Triangulation};

/// Everything that an answer depends on except the engine.
#[derive(Debug, Clone)]
pub struct Setup {
    /// The problem.
    pub scene: Scene,
    /// The refinement, if the scene has one.
    pub n: Option<usize>,
    /// The scene's mesh at n, or a variation of it.
    pub mesh: Arc<Triangulation>,
    /// The scheme.
    pub discretisation: Discretisation,
    /// The settings that all engines must share.
    pub settings: Settings,
}

/// One changed setting.
#[derive(Debug, Clone, PartialEq)]
pub enum Variation {
    /// γ₀, instead of the scene's.
    Gamma0(f64),
    /// The meaning of h in γ = γ₀ h.
    H(HRule),
    /// The rule for (f, v).
    LoadRule(String),
    /// The rule on Γ_C and Γ_N.
    ContactRule(String),
    /// Element and contact law.
    Method(Method),
    /// A datum with the opposite sign.
    Negated(Datum),
    /// A datum that is 0.
    Zero(Datum),
    /// A datum times a factor.
    Scaled(Datum, f64),
    /// A datum plus a constant.
    Shifted(Datum, f64),
    /// f = -1 and t = 0, which every rule integrates exactly.
    ConstantLoad,
    /// Two of Γ_D, Γ_N and Γ_C (0, 1, 2), interchanged.
    Swapped(usize, usize),
    /// The increment of the stopping criterion, with more iterations allowed for.
    Increment(f64, usize),
    /// The solver of the linear systems.
    Linear(linear::Settings),
    /// The cells of the mesh in reverse order.
    CellsReversed,
}

/// One of the data of (1.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Datum {
    /// -Δu = f
    F,
    /// u = g on Γ_D
    G,
    /// ∂ₙu = t on Γ_N
    T,
    /// u ≤ ψ on Γ_C
    Psi,
}

impl Datum {
    /// All of them.
    pub const ALL: [Datum; 4] = [Datum::F, Datum::G, Datum::T, Datum::Psi];

    /// The symbol in formulas.
    pub fn name(self) -> &'static str {
        match self {
            Datum::F => "f",
            Datum::G => "g",
            Datum::T => "t",
            Datum::Psi => "ψ",
        }
    }

    /// Its expression.
    pub fn of(self, data: &Data) -> &Expression {
        match self {
            Datum::F => &data.f,
            Datum::G => &data.g,
            Datum::T => &data.t,
            Datum::Psi => &data.psi,
        }
    }

    fn of_mut(self, data: &mut Data) -> &mut Expression {
        match self {
            Datum::F => &mut data.f,
            Datum::G => &mut data.g,
            Datum::T => &mut data.t,
            Datum::Psi => &mut data.psi,
        }
    }
}

impl Setup {
    /// A scene on the mesh of its refinement `n`, by a method, with the scene's settings.
    ///
    /// # Errors
    /// A mesh that cannot be made.
    pub fn new(
        scene: &Scene,
        n: Option<usize>,
        method: Method,
        settings: &Settings,
    ) -> Result<Self> {
        let mesh = Arc::new(scene.triangulation(n)?);
        Ok(Setup::on(mesh, scene, n, method, settings))
    }

    /// The same on a given mesh.
    pub fn on(
        mesh: Arc<Triangulation>,
        scene: &Scene,
        n: Option<usize>,
        method: Method,
        settings: &Settings,
    ) -> Self {
        Setup {
            scene: scene.clone(),
            n,
            mesh,
            discretisation: Discretisation::of(scene, method),
            settings: settings.clone(),
        }
    }

    /// A copy, or a variation.
    ///
    /// # Errors
    /// Those of [`Setup::with`].
    pub fn varied(self, variation: Option<&Variation>) -> Result<Self> {
        match variation {
            Some(variation) => self.with(variation),
            None => Ok(self),
        }
    }

    /// The case, assembled.
    ///
    /// # Errors
    /// Those of [`Problem::new`].
    pub fn case(&self) -> Result<Case<'_>> {
        Ok(Case {
            n: self.n,
            problem: Problem::new(&self.scene, &self.mesh, &self.discretisation)?,
        })
    }

    /// A copy with one change.
    ///
    /// # Errors
    /// A variation that this scene does not have.
    pub fn with(&self, variation: &Variation) -> Result<Self> {
        let mut setup = self.clone();
        let data = |change: &dyn Fn(&mut Data)| {
            let mut data = self.scene.data().clone();
            change(&mut data);
            self.scene.with_data(data)
        };
        let rewritten = |datum: Datum, text: String| -> Result<Scene> {
            let parsed = Expression::parse(&text).map_err(|e| {
                let what = format!("{} is too long to be changed: {}", datum.name(), e.what);
                Error::usage(what, "shorten the formula")
            })?;
            Ok(data(&|data| *datum.of_mut(data) = parsed.clone()))
        };
        let formula = |datum: Datum| datum.of(self.scene.data()).text();
        match variation {
            Variation::Gamma0(gamma0) => setup.discretisation.gamma0 = *gamma0,
            Variation::H(h) => setup.discretisation.h = *h,
            Variation::LoadRule(rule) => setup.discretisation.load_quadrature = Some(rule.clone()),
            Variation::ContactRule(rule) => {
                setup.discretisation.contact_quadrature = Some(rule.clone())
            }
            Variation::Method(method) => setup.discretisation.method = *method,
            Variation::Negated(datum) => {
                setup.scene = rewritten(*datum, format!("-({})", formula(*datum)))?;
            }
            Variation::Scaled(datum, factor) => {
                setup.scene = rewritten(*datum, format!("({factor:e})*({})", formula(*datum)))?;
            }
            Variation::Shifted(datum, by) => {
                setup.scene = rewritten(*datum, format!("({})+({by:e})", formula(*datum)))?;
            }
            Variation::Zero(datum) => {
                setup.scene = data(&|data| *datum.of_mut(data) = Expression::constant(0.0));
            }
            Variation::ConstantLoad => {
                setup.scene = data(&|data| {
                    data.f = Expression::constant(-1.0);
                    data.t = Expression::constant(0.0);
                });
            }
            Variation::Swapped(i, k) => {
                let mut boundary = self.scene.boundary().clone();
                let mut parts = [
                    &mut boundary.dirichlet,
                    &mut boundary.neumann,
                    &mut boundary.contact,
                ]
                .map(std::mem::take);
                parts.swap(*i, *k);
                [boundary.dirichlet, boundary.neumann, boundary.contact] = parts;
                setup.scene = self.scene.with_boundary(boundary);
            }
            Variation::Increment(increment, more) => {
                setup.settings.stop.increment = *increment;
                setup.settings.stop.max_iterations *= more;
            }
            Variation::Linear(linear) => setup.settings.linear = *linear,
            Variation::CellsReversed => {
                let (name, mut mesh) = self.scene.mesh(self.n)?;
                reverse_cells(&mut mesh);
                setup.mesh = Arc::new(Triangulation::new(&name, &mesh)?);
            }
        }
        Ok(setup)
    }
}

/// The points in reverse order, renumbered everywhere; data stored by point are dropped.
pub fn reverse_points(mesh: &mut Mesh) {
    let last = mesh.points.len().saturating_sub(1) as u32;
    mesh.points.to_mut().reverse();
    for node in mesh
        .blocks
        .iter_mut()
        .flat_map(|block| block.nodes.to_mut())
    {
        *node = last - *node;
    }
    mesh.fields.clear();
}

/// Each block's cells in reverse order, and the groups with them.
pub fn reverse_cells(mesh: &mut Mesh) {
    let mut start = 0;
    let mut moved: Vec<u32> = Vec::with_capacity(mesh.cell_count());
    for block in &mut mesh.blocks {
        let (count, points) = (block.len() as u32, block.kind.points());
        let nodes = block.nodes.chunks_exact(points).rev().flatten();
        block.nodes = nodes.copied().collect();
        block.tags.reverse();
        block.entities.reverse();
        moved.extend((0..count).rev().map(|k| start + k));
        start += count;
    }
    for group in &mut mesh.groups {
        group
            .cells
            .iter_mut()
            .for_each(|cell| *cell = moved[*cell as usize]);
        group.cells.sort_unstable();
    }
    mesh.fields.clear();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reversed_cells_keep_their_groups() {
        let scene = Scene::find("one-zone").unwrap();
        let (name, mut mesh) = scene.mesh(Some(4)).unwrap();
        let before = Triangulation::new(&name, &mesh).unwrap();
        reverse_cells(&mut mesh);
        let after = Triangulation::new(&name, &mesh).unwrap();
        assert_ne!(before.cell(0), after.cell(0));
        let parts = |mesh: &Triangulation| {
            let mut parts: Vec<_> = (0..mesh.face_count())
                .map(|f| (mesh.face(f).to_vec(), scene.parts(mesh).unwrap()[f]))
                .collect();
            parts.sort_by(|a, b| a.0.cmp(&b.0));
            parts
        };
        assert_eq!(parts(&before), parts(&after));
    }
}
