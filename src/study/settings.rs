//! Settings beside their neighbours: what the Rust engine has measured already, with one thing else.

use super::Request;
use super::campaign::{Campaign, GAMMAS, RULES, SOLVERS, TOLERANCES, dimension};
use super::measure::Setting;
use super::row::Varied;
use super::subject::Subject;
use crate::engine::Settings;
use faceoff_fem::contact::{Discretisation, Method};
use faceoff_fem::linear::{self, Precision, Solver};
use faceoff_fem::quadrature;
use faceoff_mesh::error::Result;

/// The n near which settings are varied.
const USUAL: usize = 64;
/// Decades of the tolerances.
const DECADES: std::ops::RangeInclusive<i32> = 2..=12;
/// Decades of γ₀.
const GAMMA_DECADES: std::ops::RangeInclusive<i32> = -12..=12;

/// A neighbour of what is usual.
struct Variation {
    /// Of any method.
    discretisation: Discretisation,
    n: usize,
    settings: Settings,
}

impl Variation {
    /// What is usual, of this track.
    fn none(request: &Request, subject: &Subject, n: usize) -> Self {
        Variation {
            discretisation: Discretisation::of(&subject.scene, Method::cr()),
            n,
            settings: request.settings.clone(),
        }
    }
}

impl Campaign<'_> {
    pub fn tolerances(&mut self) -> Result<()> {
        let request = self.request;
        self.vary(
            TOLERANCES,
            Varied::Tolerance,
            &request.methods,
            |subject, n| {
                let of = |k: i32| {
                    let mut variation = Variation::none(request, subject, n);
                    variation.settings.stop.increment = 10.0_f64.powi(-k);
                    variation
                };
                DECADES.map(of).collect()
            },
        )
    }

    /// 24 decades, of the penalty-free methods, on two meshes: the order of the error depends on γ₀ as well.
    pub fn gammas(&mut self) -> Result<()> {
        let request = self.request;
        let asked = |m: &Method| request.methods.contains(m);
        let methods = [Method::cr(), Method::cr_fc()];
        let methods: Vec<Method> = methods.into_iter().filter(asked).collect();
        self.vary(GAMMAS, Varied::Gamma0, &methods, |subject, n| {
            let half = Some(n / 2).filter(|half| subject.scene.has_mesh(*half));
            let meshes = half.into_iter().chain([n]);
            let of = |n: usize| {
                GAMMA_DECADES.map(move |k| {
                    let mut variation = Variation::none(request, subject, n);
                    variation.discretisation.gamma0 = 10.0_f64.powi(k);
                    variation
                })
            };
            meshes.flat_map(of).collect()
        })
    }

    pub fn rules(&mut self) -> Result<()> {
        let request = self.request;
        let methods = nitsche(request);
        for varied in [Varied::ContactQuadrature, Varied::LoadQuadrature] {
            let on_faces = varied == Varied::ContactQuadrature;
            self.vary(RULES, varied, &methods, |subject, n| {
                if !on_faces && subject.scene.data().f.is_zero() {
                    return Vec::new();
                }
                let dim = dimension(subject) - usize::from(on_faces);
                let of = |name: &&str| {
                    let mut variation = Variation::none(request, subject, n);
                    let rule = if on_faces {
                        &mut variation.discretisation.contact_quadrature
                    } else {
                        &mut variation.discretisation.load_quadrature
                    };
                    *rule = Some((*name).to_owned());
                    variation
                };
                quadrature::names(dim).iter().rev().map(of).collect()
            })?;
        }
        Ok(())
    }

    pub fn solvers(&mut self) -> Result<()> {
        let request = self.request;
        let methods = nitsche(request);
        self.vary(SOLVERS, Varied::Linear, &methods, |subject, n| {
            let all = [
                (Solver::Multifrontal, Precision::F64),
                (Solver::Multifrontal, Precision::F32Refined),
                (Solver::Faer, Precision::F64),
                (Solver::Iterative, Precision::F64),
            ];
            let of = |(solver, precision)| {
                let mut variation = Variation::none(request, subject, n);
                variation.settings.linear = linear::Settings { solver, precision };
                variation
            };
            all.map(of).into()
        })
    }

    /// Measures the variations of each track as a whole, on one mesh for all methods where the budget has room for that.
    fn vary(
        &mut self,
        share: f64,
        varied: Varied,
        methods: &[Method],
        variations: impl Fn(&Subject, usize) -> Vec<Variation>,
    ) -> Result<()> {
        let Some(engine) = self.rust() else {
            return Ok(());
        };
        for subject in &self.request.subjects {
            let meshes_of = |method| self.meshes_of(subject.scene.name(), method);
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
                for variation in variations {
                    self.add(&Setting {
                        subject,
                        engine,
                        discretisation: Discretisation {
                            method: *method,
                            ..variation.discretisation
                        },
                        n: Some(variation.n),
                        varied,
                        settings: variation.settings,
                    })?;
                }
            }
        }
        Ok(())
    }

    /// The meshes of a track up to the usual n, the finest first, and what each cost.
    fn meshes_of(&self, scene: &str, method: &Method) -> Vec<(usize, f64)> {
        let method = method.to_string();
        let rows = self.rows.iter().zip(&self.costs).filter(|(row, _)| {
            row.varied == Varied::Mesh && row.track() == (scene, "rust", &*method)
        });
        let meshes = rows.filter_map(|(row, cost)| Some((row.n?, *cost)));
        let mut meshes: Vec<_> = meshes.filter(|(n, _)| *n <= USUAL).collect();
        meshes.sort_by_key(|mesh| std::cmp::Reverse(mesh.0));
        meshes
    }
}

fn nitsche(request: &Request) -> Vec<Method> {
    let methods = request.methods.iter();
    methods.filter(|m| m.is_nitsche()).copied().collect()
}
