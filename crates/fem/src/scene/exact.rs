//! Built-in scenes whose solution is known: one for every entry of the catalogue.

use super::boundary::GroupName;
use super::file::{GAMMA0, N, N_SOLID, are_alike};
use super::{Boundary, Data, Exact, Expression, HRule, MeshFree, MeshSource, Scene};
use crate::truth::exact::{self, Kind, Regularity, Side, catalogue};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::generate::{Cuboid, place, sides};

pub(super) fn names(dim: usize) -> Vec<&'static str> {
    let all = catalogue().into_iter();
    all.filter(|e| e.dimension == dim).map(|e| e.name).collect()
}

/// The names, and what each is for.
pub(super) fn purposes() -> Vec<(&'static str, String)> {
    let all = catalogue().into_iter();
    let told = |e: exact::Benchmark| (e.name, format!("exact solution: {}", e.purpose));
    all.map(told).collect()
}

/// Other names of scenes.
const ALSO: [(&str, &str); 1] = [("r32", "transition-1.5")];

/// The scene of this name; none where the catalogue has no solution of that name.
pub(super) fn find(name: &str) -> Option<Result<Scene>> {
    let name = ALSO
        .iter()
        .find(|also| also.0 == name)
        .map_or(name, |also| also.1);
    let exact = catalogue().into_iter().find(|e| e.name == name)?;
    Some(scene(&exact))
}

/// The known solution with this name, and the data that it belongs to: the solution of a catalogue's scene, or of 6.1.
pub(super) fn reference(name: &str) -> Option<Result<(Exact, Data)>> {
    if name == "one-zone" {
        let zero = || Expression::constant(0.0);
        return Some(formula(name, "data.f", "-2*pi*sin(2*pi*x)").map(|f| {
            let (g, t, psi) = (zero(), zero(), zero());
            (Exact::MeshFree(MeshFree::OneZone), Data { f, g, t, psi })
        }));
    }
    let found = find(name)?.map(|scene| Some((scene.exact?, scene.data)));
    found.transpose()
}

/// What is known about the regularity of a scene's solution: for a catalogue's u over its obstacle, under any name of the scene, and for 6.1,
/// where u is like r^(3/2) cos(3θ/2) at the end of the contact zone and smoother elsewhere: the sides are met at right angles, across
/// which u is even, and f is continued by a kink.
pub(super) fn regularity(scene: &Scene) -> Option<Regularity> {
    let exact = scene.exact.as_ref()?;
    if *exact == Exact::MeshFree(MeshFree::OneZone) {
        return Some(Regularity::transition(2.5));
    }
    let is_it = |known: Scene| {
        known.exact.as_ref() == Some(exact) && are_alike(&known.data.psi, &scene.data.psi)
    };
    let all = catalogue().into_iter();
    let mut known = all.filter(|e| self::scene(e).is_ok_and(is_it));
    known.next().map(|e| e.regularity)
}

fn formula(scene: &str, key: &str, text: &str) -> Result<Expression> {
    Expression::parse(text).map_err(|e| Error::Scene {
        scene: scene.to_owned(),
        place: format!("{key}, character {}", e.column),
        what: format!("{} in `{text}`", e.what),
        remedy: "report this: a built-in scene is at fault".into(),
    })
}

fn scene(exact: &exact::Benchmark) -> Result<Scene> {
    let text = &exact.text;
    let formula = |key: &str, text: &str| formula(exact.name, key, text);
    let (cuboid, boundary) = geometry(exact);
    let n = if cuboid.dim == 2 { N } else { N_SOLID };
    Ok(Scene {
        name: exact.name.to_owned(),
        source: MeshSource::Union { n, cuboid },
        boundary,
        data: Data {
            f: formula("data.f", &text.f)?,
            g: formula("data.g", &text.g)?,
            t: formula("data.t", &text.t)?,
            psi: formula("data.psi", &text.psi)?,
        },
        gamma0: GAMMA0,
        h: HRule::Local,
        load_quadrature: None,
        contact_quadrature: None,
        exact: Some(Exact::Formula(formula("exact.u", &text.u)?)),
        compare: None,
    })
}

/// The rectangle or box, split where two parts of a side meet, and the groups of each part.
fn geometry(exact: &exact::Benchmark) -> (Cuboid, Boundary) {
    let dim = exact.dimension;
    let mut cuboid = Cuboid::new(
        exact.lower,
        std::array::from_fn(|k| exact.upper[k] - exact.lower[k]),
    );
    cuboid.dim = dim;
    let mut boundary = Boundary::default();
    for side in &exact.sides {
        // A catalogue's range is that of x: of bottom or top.
        let (number, name) = number(side, dim);
        let group = match side.range {
            None => name.to_owned(),
            Some([low, _]) if low > exact.lower[0] => {
                cuboid.splits[number] = Some(low);
                format!("{name}-right")
            }
            Some([_, high]) => {
                cuboid.splits[number] = Some(high);
                format!("{name}-left")
            }
        };
        let part = match side.kind {
            Kind::Dirichlet => &mut boundary.dirichlet,
            Kind::Neumann => &mut boundary.neumann,
            Kind::Contact => &mut boundary.contact,
        };
        part.push(GroupName::Name(group));
    }
    (cuboid, boundary)
}

/// A side's number and name in the mesh.
fn number(side: &Side, dim: usize) -> (usize, &'static str) {
    let names = sides(dim);
    (0..names.len())
        .find(|&k| place(k, dim) == (side.axis, side.upper))
        .map(|k| (k, names[k]))
        .expect("invariant: a catalogue's sides are those of a rectangle or a box")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_regularity_is_that_of_the_solution_and_not_of_the_name() {
        for name in ["one-zone", "three-zones", "five-zones", "transition-1.5"] {
            let scene = Scene::find(name).unwrap().renamed("mine").unwrap();
            assert_eq!(
                scene.regularity(),
                Some(Regularity::transition(2.5)),
                "{name}"
            );
        }
        let plate = Scene::find("plate").unwrap();
        let named = plate.renamed("transition-1.5").unwrap();
        assert_eq!([plate, named].map(|s| s.regularity()), [None; 2]);
    }
    use crate::scene::Part;

    /// Points of the closed rectangle or box without pattern, every fifth on the bottom.
    fn points(e: &exact::Benchmark) -> impl Iterator<Item = [f64; 3]> + '_ {
        (1..=600).map(|i: u32| {
            let fractions = [0.819_172_513_396, 0.671_043_606_704, 0.549_700_477_902]
                .map(|g| (g * f64::from(i)).fract());
            std::array::from_fn(|k| {
                if k + 1 == e.dimension && i.is_multiple_of(5) {
                    return e.lower[k];
                }
                e.lower[k] + (e.upper[k] - e.lower[k]) * fractions[k]
            })
        })
    }

    #[test]
    fn text_and_numbers_of_every_solution_agree() {
        for name in [names(2), names(3)].concat() {
            let exact = catalogue().into_iter().find(|e| e.name == name).unwrap();
            let scene = Scene::find(name).unwrap();
            let u = scene.exact.as_ref().and_then(Exact::formula).unwrap();
            let size = points(&exact).fold(1.0, |m: f64, p| m.max(exact.f(p).abs()));
            for p in points(&exact) {
                let near = |what: &str, text: f64, number: f64, size: f64| {
                    assert!(
                        (text - number).abs() < 1e-12 * size,
                        "{name}: {what} at {p:?} is {text} as text and {number} as a number"
                    );
                };
                near("u", u.value(p), exact.u(p), 1.0);
                near("f", scene.data.f.value(p), exact.f(p), size);
                near("t", scene.data.t.value(p), exact.t(p), 1.0);
                near("psi", scene.data.psi.value(p), exact.psi(p), 1.0);
                let (slope, expected) = (u.gradient(p), exact.grad(p));
                // On the bottom itself abs and atan2 leave the text a choice of sides.
                for axis in 0..exact.dimension {
                    if p[exact.dimension - 1] > 0.0 {
                        let size = 100.0 * (1.0 + expected[axis].abs());
                        near("a slope of u", slope[axis], expected[axis], size);
                    }
                }
            }
        }
    }

    #[test]
    fn every_face_lies_on_the_side_of_its_part_and_has_its_data() {
        for name in [names(2), names(3)].concat() {
            let exact = catalogue().into_iter().find(|e| e.name == name).unwrap();
            let scene = Scene::find(name).unwrap();
            let mesh = scene.triangulation(None).unwrap();
            let parts = scene.parts(&mesh).unwrap();
            let mut seen = 0;
            for (face, part) in parts.iter().enumerate() {
                let Some(part) = part else { continue };
                let p = mesh.face_midpoint(face);
                let side = exact.sides.iter().find(|side| {
                    let level = [exact.lower, exact.upper][usize::from(side.upper)][side.axis];
                    let inside = side.range.is_none_or(|[a, b]| a < p[0] && p[0] < b);
                    p[side.axis] == level && inside
                });
                let expected = match side.unwrap().kind {
                    Kind::Dirichlet => Part::Dirichlet,
                    Kind::Neumann => Part::Neumann,
                    Kind::Contact => Part::Contact,
                };
                assert_eq!(*part, expected, "{name} at {p:?}");
                if expected == Part::Dirichlet {
                    let g = scene.data.g.value(p);
                    assert!((g - exact.g(p)).abs() < 1e-12, "{name}: g({p:?}) = {g}");
                }
                seen += 1;
            }
            let expected = match exact.dimension {
                2 => 4 * N,
                _ => 12 * N_SOLID * N_SOLID,
            };
            assert_eq!(seen, expected);
        }
    }
}
