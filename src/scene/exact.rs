//! Built-in scenes whose solution is known: one for every planar entry of the catalogue.

use super::boundary::GroupName;
use super::file::{GAMMA0, N};
use super::{Boundary, Data, Expression, HRule, MeshSource, Scene};
use crate::error::{Error, Result};
use crate::mesh::generate::{Rectangle, SIDES};
use crate::quadrature;
use crate::truth::exact::{Exact, Kind, Side, Text, catalogue};

pub(super) fn names() -> Vec<&'static str> {
    let planar = catalogue().into_iter().filter(|e| e.text.is_some());
    planar.map(|e| e.name).collect()
}

/// The scene of this name; none where the catalogue has no planar solution of that name.
pub(super) fn find(name: &str) -> Option<Result<Scene>> {
    let exact = catalogue().into_iter().find(|e| e.name == name)?;
    let text = exact.text.as_ref()?;
    Some(scene(&exact, text))
}

fn scene(exact: &Exact, text: &Text) -> Result<Scene> {
    let formula = |key: &str, text: &str| {
        Expression::parse(text).map_err(|e| Error::Scene {
            scene: exact.name.to_owned(),
            place: format!("{key}, character {}", e.column),
            what: format!("{} in `{text}`", e.what),
            remedy: "report this: a built-in scene is at fault".into(),
        })
    };
    let (rectangle, boundary) = geometry(exact);
    Ok(Scene {
        name: exact.name.to_owned(),
        mesh: MeshSource::UnionJack { n: N, rectangle },
        boundary,
        data: Data {
            f: formula("data.f", &text.f)?,
            g: formula("data.g", &text.g)?,
            t: formula("data.t", &text.t)?,
            psi: formula("data.psi", &text.psi)?,
        },
        gamma0: GAMMA0,
        h: HRule::Local,
        load_quadrature: quadrature::CELL_RULES[0].to_owned(),
        contact_quadrature: quadrature::FACE_RULES[0].to_owned(),
        cross_order: None,
        exact: Some(formula("exact.u", &text.u)?),
    })
}

/// The rectangle, split where two parts of a side meet, and the groups of each part.
fn geometry(exact: &Exact) -> (Rectangle, Boundary) {
    let [x0, y0, _] = exact.lower;
    let [x1, y1, _] = exact.upper;
    let mut rectangle = Rectangle::new([x0, y0], [x1 - x0, y1 - y0]);
    let mut boundary = Boundary::default();
    for side in &exact.sides {
        // A catalogue's range is that of x: of bottom or top.
        let (number, name) = number(side);
        let group = match side.range {
            None => name.to_owned(),
            Some([low, _]) if low > x0 => {
                rectangle.splits[number] = Some(low);
                format!("{name}-right")
            }
            Some([_, high]) => {
                rectangle.splits[number] = Some(high);
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
    (rectangle, boundary)
}

/// A side's number and name in the mesh.
fn number(side: &Side) -> (usize, &'static str) {
    let number = match (side.axis, side.upper) {
        (0, false) => 3,
        (0, true) => 1,
        (_, false) => 0,
        (_, true) => 2,
    };
    (number, SIDES[number])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Part;

    /// Points of the closed rectangle without pattern, every fifth on y = 0.
    fn points(e: &Exact) -> impl Iterator<Item = [f64; 3]> + '_ {
        (1..=600).map(|i: u32| {
            let fraction = |g: f64| (g * f64::from(i)).fract();
            let on_bottom = i.is_multiple_of(5);
            let y = if on_bottom {
                0.0
            } else {
                fraction(0.671_043_606_704)
            };
            let [x0, x1] = [e.lower[0], e.upper[0]];
            [x0 + (x1 - x0) * fraction(0.819_172_513_396), y, 0.0]
        })
    }

    #[test]
    fn text_and_numbers_of_every_solution_agree() {
        for name in names() {
            let exact = catalogue().into_iter().find(|e| e.name == name).unwrap();
            let scene = Scene::find(name).unwrap();
            let u = scene.exact.as_ref().unwrap();
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
                // On y = 0 itself abs and atan2 leave the text a choice of sides.
                for axis in 0..2 {
                    if p[1] > 0.0 {
                        let size = 100.0 * (1.0 + expected[axis].abs());
                        near("a slope of u", slope[axis], expected[axis], size);
                    }
                }
            }
        }
    }

    #[test]
    fn every_face_lies_on_the_side_of_its_part_and_has_its_data() {
        for name in names() {
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
            assert_eq!(seen, 4 * N);
        }
    }
}
