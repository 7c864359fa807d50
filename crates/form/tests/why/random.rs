//! Random changes, one or two at once.

use faceoff_form::Problem;
use faceoff_form::judge::{Cause, Change, Interpolated};
use faceoff_form::problem::{Element, Space};

use super::{ELASTICITY, PENALTY, STOKES, SURFACE, diffusion, parse, put, square};

/// A change that is planted, with the factor that is told; of a term, a parameter, a datum, or all rules on cells.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Plant {
    Factor(usize, f64),
    Parameter(usize, f64),
    Data(usize, u8),
    Rules,
}

impl Plant {
    fn apply(self, p: &mut Problem) {
        match self {
            Plant::Factor(term, factor) => {
                let factor = p.scalars.number(factor);
                for value in p.integrals[term].terms.values_mut() {
                    *value = p.scalars.multiply(*value, factor);
                }
            }
            Plant::Parameter(k, value) => p.parameters[k].value = value,
            Plant::Data(k, degree) => {
                let element = match degree {
                    0 => Element::Broken(0),
                    _ => Element::Continuous(degree),
                };
                let size = p.data[k].shape.first().copied();
                p.data[k].space = Some(Space { element, size });
            }
            Plant::Rules => p.degree = 2,
        }
    }

    /// Is it what a cause says?
    fn is(self, cause: &Cause) -> bool {
        let near = |a: f64, b: f64, of: f64| (a - b).abs() < 1e-5 * (b - of).abs() + 1e-11;
        match (self, &cause.change) {
            (Plant::Factor(k, f), Change::Factor { term }) => {
                k == *term && near(cause.factor, f, 1.0)
            }
            (Plant::Parameter(k, x), Change::Parameter { parameter }) => {
                k == *parameter && near(cause.factor, x, 0.0)
            }
            (Plant::Data(k, degree), Change::Data { datum, by, .. }) => {
                k == *datum && *by == Interpolated::Degree(degree)
            }
            (Plant::Rules, Change::Rule { rule, term: None }) => *rule == "edges-3",
            _ => false,
        }
    }
}

/// One or two changes, numbers from 1e-6 off to half or double; `FACEOFF_SCENES` asks for more of them, `FACEOFF_SEED` for others.
#[test]
fn random_changes_are_named() {
    let number = |name: &str, usual: u64| {
        let text = std::env::var(name).ok();
        text.map_or(usual, |text| text.parse().expect("a number"))
    };
    let mut state = number("FACEOFF_SEED", 1);
    let mut draw = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let count = 20 * number("FACEOFF_SCENES", 1);
    let (mut tried, mut missed) = (0, Vec::new());
    let (p1, p2) = (diffusion("P1"), diffusion("P2"));
    // The terms that have a factor of their own: that of an equation of one term changes nothing, and of two terms one tells of the other. The
    // data whose values elsewhere are others.
    let forms: [(&str, &[usize], &[usize]); 6] = [
        (&p1, &[0, 1, 2, 3, 4], &[0, 2]),
        (&p2, &[0, 1, 2, 3, 4], &[0, 2]),
        (ELASTICITY, &[0, 1, 2, 3], &[0]),
        (STOKES, &[0, 1, 2, 4], &[0]),
        (SURFACE, &[1], &[]),
        (PENALTY, &[0, 1, 2, 3, 4, 5, 6, 7], &[0, 1]),
    ];
    for (text, terms, data) in forms {
        let mesh = square(6);
        let form = parse(text, &mesh);
        for _ in 0..count {
            let mut plants: Vec<Plant> = Vec::new();
            let wanted = if draw() < 0.4 && terms.len() > 1 {
                2
            } else {
                1
            };
            while plants.len() < wanted {
                let size = 10_f64.powf(-6.0 * draw());
                let factor = 1.0 + if draw() < 0.5 { size } else { -0.5 * size };
                let mut one = |of: &[usize]| of[(draw() * of.len() as f64) as usize];
                let kind = one(&[0, 0, 1, 2, 3]);
                let plant = match kind {
                    1 if !form.parameters.is_empty() => {
                        let k = one(&(0..form.parameters.len()).collect::<Vec<_>>());
                        Plant::Parameter(k, factor * form.parameters[k].value)
                    }
                    2 if !data.is_empty() => Plant::Data(one(data), one(&[0, 1]) as u8),
                    3 if form.degree > 2 => Plant::Rules,
                    _ => Plant::Factor(one(terms), factor),
                };
                // Two that are one, as a factor of a term and of its parameter, or a rule and where data are taken.
                let kind = |plant: &Plant| std::mem::discriminant(plant);
                let is_one = |other: &Plant| {
                    kind(other) == kind(&plant)
                        && !matches!((other, &plant), (Plant::Factor(a, _), Plant::Factor(b, _)) if a != b)
                        || matches!(
                            (other, &plant),
                            (Plant::Factor(..), Plant::Parameter(..))
                                | (Plant::Parameter(..), Plant::Factor(..))
                        )
                        || matches!(
                            (other, &plant),
                            (Plant::Data(..), Plant::Rules) | (Plant::Rules, Plant::Data(..))
                        )
                };
                if !plants.iter().any(is_one) {
                    plants.push(plant);
                }
            }
            let change = |p: &mut Problem| plants.iter().for_each(|plant| plant.apply(p));
            let judged = put(text, &form, &mesh, change);
            let is_it = |causes: &Vec<Cause>| {
                causes.len() == plants.len()
                    && plants
                        .iter()
                        .all(|plant| causes.iter().any(|cause| plant.is(cause)))
            };
            let exact = judged.explanation.iter().filter(|found| found.is_exact);
            let mut all = exact
                .clone()
                .flat_map(|found| std::iter::once(&found.causes).chain(&found.alike));
            tried += 1;
            if !all.any(is_it) {
                let worst = judged.rows[0].error;
                let told = crate::exact(&form, &judged);
                missed.push(format!(
                    "{}: {plants:?}, residual {worst:.1e}: {told:?}",
                    form.name
                ));
            }
        }
    }
    println!(
        "{} of {tried} not named\n{}",
        missed.len(),
        missed.join("\n")
    );
    assert!(missed.len() * 50 <= tried, "{}", missed.join("\n"));
}
