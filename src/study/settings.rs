//! Settings beside their neighbours: what the Rust engine has measured already, with one thing else.

use super::Request;
use super::campaign::{Campaign, GAMMAS, RULES, SOLVERS, TOLERANCES, dimension};
use super::measure::Setting;
use super::row::Varied;
use super::subject::Subject;
use crate::contact::Method;
use crate::engine::Settings;
use crate::error::Result;
use crate::linear::{self, Precision, Solver};
use crate::quadrature;

/// The n near which settings are varied.
const USUAL: usize = 64;
/// Decades of the tolerances.
const DECADES: std::ops::RangeInclusive<i32> = 2..=12;
/// Decades of γ₀.
const GAMMA_DECADES: std::ops::RangeInclusive<i32> = -12..=12;

/// A neighbour of what is usual.
struct Variation {
    subject: Subject,
    n: usize,
    settings: Settings,
}

impl Variation {
    /// What is usual, of this track.
    fn none(request: &Request, subject: &Subject, n: usize) -> Self {
        Variation {
            subject: subject.clone(),
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
                    variation.subject.scene.gamma0 = 10.0_f64.powi(k);
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
                if !on_faces && subject.scene.data.f.is_zero() {
                    return Vec::new();
                }
                let dim = dimension(subject) - usize::from(on_faces);
                let of = |name: &&str| {
                    let mut variation = Variation::none(request, subject, n);
                    let scene = &mut variation.subject.scene;
                    let rule = if on_faces {
                        &mut scene.contact_quadrature
                    } else {
                        &mut scene.load_quadrature
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

    /// Measures the variations of each track as a whole.
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
            for method in methods {
                let Some((n, cost)) = self.base(&subject.scene.name, method) else {
                    continue;
                };
                let variations = variations(subject, n);
                if !self.allows(share, cost * variations.len() as f64) {
                    let what = format!("{}, {method}, n = {n}, {varied}", subject.scene.name);
                    self.leave_out(what, "the budget was spent");
                    continue;
                }
                for variation in variations {
                    self.add(&Setting {
                        subject: &variation.subject,
                        engine,
                        method: *method,
                        n: Some(variation.n),
                        varied,
                        settings: variation.settings,
                    })?;
                }
            }
        }
        Ok(())
    }

    /// The mesh of a track that settings are varied on, the finest up to the usual n; and what it cost.
    fn base(&self, scene: &str, method: &Method) -> Option<(usize, f64)> {
        let method = method.to_string();
        let rows = self.rows.iter().zip(&self.costs).filter(|(row, _)| {
            row.varied == Varied::Mesh && row.track() == (scene, "rust", &*method)
        });
        let fits = rows.filter(|(row, _)| row.n.is_some_and(|n| n <= USUAL));
        fits.max_by_key(|(row, _)| row.n)
            .and_then(|(row, cost)| Some((row.n?, *cost)))
    }
}

fn nitsche(request: &Request) -> Vec<Method> {
    let methods = request.methods.iter();
    methods.filter(|m| m.is_nitsche()).copied().collect()
}
