//! Variations of settings: repeats measurements of the Rust engine with one setting changed.

use super::StudyRequest;
use super::campaign::{Campaign, GAMMAS, RULES, SOLVERS, TOLERANCES, dimension};
use super::measure::Setting;
use super::row::Varied;
use super::subject::Subject;
use crate::run::Variation;
use faceoff_fem::contact::Method;
use faceoff_fem::linear::{self, Precision, Solver};
use faceoff_fem::quadrature;
use faceoff_mesh::error::Result;

/// Settings are varied near this n.
const USUAL: usize = 64;
/// Decades of the tolerances.
const DECADES: std::ops::RangeInclusive<i32> = 2..=12;
/// Decades of γ₀.
const GAMMA_DECADES: std::ops::RangeInclusive<i32> = -12..=12;

impl Campaign<'_> {
    pub fn tolerances(&mut self) -> Result<()> {
        let methods = &self.request.methods;
        self.vary(TOLERANCES, Varied::Tolerance, methods, |_, n| {
            let of = |k: i32| (n, Variation::Increment(10.0_f64.powi(-k), 1));
            DECADES.map(of).collect()
        })
    }

    /// 24 decades for the penalty-free methods, on two meshes: the order of the error depends on γ₀ as well.
    pub fn gammas(&mut self) -> Result<()> {
        let request = self.request;
        let asked = |m: &Method| request.methods.contains(m);
        let methods = [Method::cr(), Method::cr_fc()];
        let methods: Vec<Method> = methods.into_iter().filter(asked).collect();
        self.vary(GAMMAS, Varied::Gamma0, &methods, |subject, n| {
            let half = Some(n / 2).filter(|half| subject.scene.has_mesh(*half));
            let of =
                |n: usize| GAMMA_DECADES.map(move |k| (n, Variation::Gamma0(10.0_f64.powi(k))));
            half.into_iter().chain([n]).flat_map(of).collect()
        })
    }

    pub fn rules(&mut self) -> Result<()> {
        let methods = nitsche(self.request);
        let on_faces = |name: &str| Variation::ContactRule(name.into());
        self.vary(RULES, Varied::ContactQuadrature, &methods, |subject, n| {
            let names = quadrature::names(dimension(subject) - 1).iter().rev();
            names.map(|name| (n, on_faces(name))).collect()
        })?;
        let of_load = |name: &str| Variation::LoadRule(name.into());
        self.vary(RULES, Varied::LoadQuadrature, &methods, |subject, n| {
            if subject.scene.data().f.is_zero() {
                return Vec::new();
            }
            let names = quadrature::names(dimension(subject)).iter().rev();
            names.map(|name| (n, of_load(name))).collect()
        })
    }

    pub fn solvers(&mut self) -> Result<()> {
        let methods = nitsche(self.request);
        self.vary(SOLVERS, Varied::Linear, &methods, |_, n| {
            let all = [
                (Solver::Multifrontal, Precision::F64),
                (Solver::Multifrontal, Precision::F32Refined),
                (Solver::Faer, Precision::F64),
                (Solver::Iterative, Precision::F64),
            ];
            let of = |(solver, precision)| {
                (n, Variation::Linear(linear::Settings { solver, precision }))
            };
            all.map(of).into()
        })
    }

    /// Measures the variations of each track as a whole, on the same mesh for all methods if the budget allows that.
    fn vary(
        &mut self,
        share: f64,
        varied: Varied,
        methods: &[Method],
        variations: impl Fn(&Subject, usize) -> Vec<(usize, Variation)>,
    ) -> Result<()> {
        let Some(engine) = self.rust() else {
            return Ok(());
        };
        for subject in &self.request.subjects {
            let meshes_of = |method: &Method| self.meshes_of(subject, *method);
            let all: Vec<_> = methods.iter().map(meshes_of).collect();
            let together = |&n: &usize| {
                let cost_of = |meshes: &Vec<(usize, f64)>| {
                    let there = meshes.iter().find(|mesh| mesh.0 == n);
                    there.map_or(0.0, |mesh| mesh.1)
                };
                let cost: f64 = all.iter().map(cost_of).sum();
                self.allows(share, cost * variations(subject, n).len() as f64)
            };
            let mut sizes: Vec<usize> = all.iter().flatten().map(|mesh| mesh.0).collect();
            sizes.sort_unstable_by_key(|n| std::cmp::Reverse(*n));
            let finest = sizes.into_iter().find(together);
            for (method, mut meshes) in methods.iter().zip(all) {
                if meshes.is_empty() {
                    continue;
                }
                meshes.retain(|(n, _)| finest.is_none_or(|finest| *n <= finest));
                let of = |&(n, cost): &(usize, f64)| (variations(subject, n), cost);
                let mut chosen = meshes.iter().map(of);
                let chosen = chosen.find(|(all, cost)| self.allows(share, cost * all.len() as f64));
                let Some((variations, _)) = chosen else {
                    let what = format!("{}, {method}, {varied}", subject.scene.name());
                    self.leave_out(what, "the budget was spent");
                    continue;
                };
                for (n, variation) in variations {
                    self.add(&Setting {
                        subject,
                        engine,
                        method: *method,
                        n: Some(n),
                        varied,
                        variation: Some(variation),
                        settings: self.request.settings.clone(),
                    })?;
                }
            }
        }
        Ok(())
    }

    /// The meshes of a track up to the usual n, the finest first, with their times.
    fn meshes_of(&self, subject: &Subject, method: Method) -> Vec<(usize, f64)> {
        let rows = self.of(subject, method, Varied::Mesh);
        let meshes = rows.filter_map(|(row, cost)| Some((row.n?, cost)));
        let mut meshes: Vec<_> = meshes.filter(|(n, _)| *n <= USUAL).collect();
        meshes.sort_by_key(|mesh| std::cmp::Reverse(mesh.0));
        meshes
    }
}

fn nitsche(request: &StudyRequest) -> Vec<Method> {
    let methods = request.methods.iter();
    methods.filter(|m| m.is_nitsche()).copied().collect()
}
