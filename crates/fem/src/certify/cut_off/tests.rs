use super::*;
use crate::certify::tests::{inside, moved, points_of_parts, sigma, solved};
use crate::certify::{CellFields, Traction, bounds, certify, contact_terms, energy, prepared};
use crate::contact::Discretisation;
use crate::scene::{Data, Scene};
use nalgebra::Vector3;
use std::borrow::Cow;

fn with_g(g: &str, psi: &str) -> Scene {
    let scene = Scene::find("one-zone-3d").unwrap();
    scene.with_data(Data {
        g: Expression::parse(g).unwrap(),
        psi: Expression::parse(psi).unwrap(),
        ..scene.data().clone()
    })
}

/// w and ∇w by their formula, where χ is 1 at these vertices.
pub(in crate::certify) fn by_formula(
    mesh: &Triangulation,
    g: &Expression,
    is_one: &dyn Fn(usize) -> bool,
    (cell, lambda): (usize, &[f64; 4]),
) -> (f64, Vector3<f64>) {
    let geometry = mesh.geometry(cell);
    let x = geometry.point(lambda);
    let (mut chi, mut of_chi) = (0.0, Vector3::zeros());
    let (mut beyond, mut slope) = (g.value(x), Vector3::from(g.gradient(x)));
    for (i, &vertex) in mesh.cell(cell).iter().enumerate() {
        let value = g.value(mesh.points[vertex as usize]);
        beyond -= lambda[i] * value;
        slope -= value * geometry.gradients[i];
        if is_one(vertex as usize) {
            chi += lambda[i];
            of_chi += geometry.gradients[i];
        }
    }
    (chi * beyond, chi * slope + beyond * of_chi)
}

/// w and ∇w at points anywhere are within their bounds, for g with kinks and without.
#[test]
fn cut_offs_are_no_farther_off_than_said() {
    let mut random = crate::Random::new(5);
    let mut off = 0;
    for g in [
        "sin(5*x)*exp(y)*z",
        "abs(x-0.3)+y^2",
        "max(0,y-0.2)^2-x*z",
        "300+cos(9*(x+y))",
    ] {
        let scene = with_g(g, "1e3");
        let (mesh, g) = (moved(&scene, 2, 7), &scene.data().g);
        let discretisation = Discretisation::of(&scene, "cr".parse().unwrap());
        let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
        let found = cut_offs(&problem, 0).unwrap();
        assert!(found.iter().map(|of| of.parts.len()).max() > Some(1));
        let mut on_dirichlet = vec![false; mesh.points.len()];
        for face in 0..mesh.face_count() {
            if problem.parts[face] == Some(scene::Part::Dirichlet) {
                let cell = mesh.face_cells(face)[0] as usize;
                assert!(found.iter().any(|of| of.cell == cell), "{}", g.text());
                let vertices = mesh.face(face).iter();
                vertices.for_each(|&vertex| on_dirichlet[vertex as usize] = true);
            }
        }
        for of in &found {
            let share: f64 = of.parts.iter().map(|part| part.share).sum();
            assert!((share - 1.0).abs() < 1e-15);
            for part in &of.parts {
                for _ in 0..20 {
                    let some: [f64; 4] = std::array::from_fn(|_| -random.next().max(1e-9).ln());
                    let inner = some.map(|s| s / some.iter().sum::<f64>());
                    let at = inside(&part.piece, &inner);
                    let (w, slope) =
                        by_formula(&mesh, g, &|vertex| on_dirichlet[vertex], (of.cell, &at));
                    let said = Vector3::from(part.slope::<3>().at(&inner, 3));
                    let away = (slope - said).norm();
                    assert!(away <= part.radius + 1e-9, "{away} {}", part.radius);
                    assert!(w.abs() <= part.height() + 1e-11, "{w} {}", part.height());
                    off += usize::from(away > 0.1 * part.radius);
                }
            }
        }
    }
    assert!(off > 1000, "{off}");
}

/// u = cos x cosh z with ∂u/∂z = 0 below: ‖∇u‖² = ∫ sin² x dx ∫ cosh² z dz + ∫ cos² x dx ∫ sinh² z dz, and the bound of G
/// falls with n.
#[test]
fn harmonic_functions_are_in_their_intervals() {
    let [s, c] = [-1.0, 1.0].map(|sign| 0.5 + sign * 2_f64.sin() / 4.0);
    let [sh, ch] = [-1.0, 1.0].map(|sign| 2_f64.sinh() / 4.0 + sign * 0.5);
    let truth = (s * ch + c * sh).sqrt();
    let scene = with_g("cos(x)*cosh(z)", "9");
    let scene = scene.with_data(Data {
        f: Expression::constant(0.0),
        t: Expression::parse("if(abs(x-0.5)>=0.5,-(2*x-1)*sin(x)*cosh(z),0)").unwrap(),
        ..scene.data().clone()
    });
    for method in ["cr", "cr-fc", "p1-vi", "p2"] {
        let bounds = [3, 6].map(|n| {
            let mesh = scene.triangulation(Some(n)).unwrap();
            let discretisation = Discretisation::of(&scene, method.parse().unwrap());
            let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
            let found = certify(&problem, &solved(&problem)).unwrap();
            let [low, high] = found.gradient;
            assert!(low <= truth && truth <= high, "{low} {truth} {high}");
            found.g / truth
        });
        let [coarse, fine] = bounds;
        assert!(fine < 0.1 && fine < 0.5 * coarse, "{method} {bounds:?}");
    }
}

/// All that v's w is part of, against rules on the faces and on parts of the cells: norms, J(v), means of g and <λ, v-ψ>. v is g
/// on Γ_D and nowhere above ψ next to it: Γ_D meets Γ_C along two edges.
#[test]
fn cut_offs_are_part_of_all_that_v_is_part_of() {
    // Only f and t, and a g of degree 2, of which nothing is left: what is charged for one part would hide that another is missing.
    for g in ["x^2+y^2+0.2*sin(3*x)*z", "x^2+y^2+z"] {
        for data in ["f = \"3-x\"", "t = \"2+y\""] {
            all_that_v_is_part_of(g, data);
        }
    }
}

fn all_that_v_is_part_of(g: &str, data: &str) {
    let scene = Scene::parse(&format!(
        r#"
        name = "corner"
        mesh = {{ generator = "union-cube", n = 2 }}
        [boundary]
        dirichlet = ["left", "front"]
        neumann = ["right", "back", "top"]
        contact = ["bottom"]
        [data]
        {data}
        g = "{g}"
        psi = "2.4-0.3*x"
        "#,
    ));
    let scene = scene.unwrap();
    let mesh = moved(&scene, 2, 3);
    let discretisation = Discretisation::of(&scene, "cr".parse().unwrap());
    let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
    let given = scene.data();
    // Far above ψ: pressed wherever ∂ₙu ≤ 0, whatever the solution is.
    let above = |dof: usize| problem.dirichlet[dof].map_or(3.0, |_| 0.0);
    let value = |dof: usize| given.g.value(problem.space.point(dof)) + above(dof);
    let u: Vec<f64> = (0..problem.space.dofs).map(value).collect();
    let (data, mut solver) = prepared(&problem, &u).unwrap();
    let fields = CellFields::new(&problem, &u, Cow::Owned(data), &mut solver).unwrap();
    let (certificate, known) = bounds(&fields, &mut solver).unwrap();
    let is_one = |vertex: usize| fields.data.dirichlet[vertex].is_some();
    let w = |cell: usize, at: &[f64; 4]| by_formula(&mesh, &given.g, &is_one, (cell, at));
    let v = |cell: usize, at: &[f64; 4]| -> f64 {
        let corners = fields.corner_values(cell);
        w(cell, at).0 + (0..4).map(|i| at[i] * corners[i].mid()).sum::<f64>()
    };
    let [mut of_v, mut of_w] = [0.0; 2];
    let (in_cells, on_faces) = (points_of_parts(3, 2), points_of_parts(2, 3));
    for cell in 0..mesh.cell_count() {
        let (geometry, simplex) = (mesh.geometry(cell), fields.simplex(cell));
        let sigma = sigma(&fields, cell);
        let flat = simplex.gradient(&fields.corner_values(cell));
        let flat = Vector3::from(flat.map(Interval::mid));
        let [mut misfit, mut slopes] = [0.0; 2];
        for (at, weight) in &in_cells {
            let (here, (_, of_lift)) = (weight * geometry.measure(), w(cell, at));
            let slope = flat + of_lift;
            misfit += here * (slope - sigma(at)).norm_squared();
            slopes += here * slope.norm_squared();
            of_w += here * of_lift.norm_squared();
            of_v -= here * given.f.value(geometry.point(at)) * v(cell, at);
        }
        of_v += 0.5 * slopes;
        let of = fields.norms(&simplex, cell);
        assert!(of.parts.misfit >= misfit.sqrt() * (1.0 - 1e-4), "{cell}");
        let slope = slopes.sqrt();
        assert!(of.slope.low <= slope * 1.0001 && slope * 0.9999 <= of.slope.high);
    }
    let over = |face: usize, of: &dyn Fn(&[f64; 4], [f64; 3]) -> f64| -> f64 {
        let cell = mesh.face_cells(face)[0] as usize;
        let (geometry, local) = (mesh.geometry(cell), mesh.local_face(cell, face));
        let terms = on_faces.iter().map(|(on_face, weight)| {
            let mut on_face = on_face.iter();
            let corner = |i: usize| {
                if i == local {
                    Some(&0.0)
                } else {
                    on_face.next()
                }
            };
            let at = [0, 1, 2, 3].map(corner).map(|l| *l.unwrap());
            weight * of(&at, geometry.point(&at))
        });
        terms.sum::<f64>() * geometry.face_measure(local)
    };
    let touching = contact_terms(&fields);
    let mut seen = [0; 3];
    for face in 0..mesh.face_count() {
        let cell = mesh.face_cells(face)[0] as usize;
        match problem.parts[face] {
            Some(scene::Part::Dirichlet) => {
                let mean = over(face, &|_, x| given.g.value(x)) / over(face, &|_, _| 1.0);
                let found = fields.mean_of_g(cell, mesh.local_face(cell, face));
                assert!(found.low <= mean + 1e-9 && mean - 1e-9 <= found.high);
                let off = over(face, &|at, x| (v(cell, at) - given.g.value(x)).abs());
                assert!(off < 1e-12, "{off}");
                seen[0] += 1;
            }
            Some(scene::Part::Neumann) => {
                of_v -= over(face, &|at, x| given.t.value(x) * v(cell, at));
                let of_face = |traction: &&Traction| traction.face == face;
                let size = fields.data.tractions.iter().find(of_face);
                let least = over(face, &|_, x| given.t.value(x).abs());
                assert!(size.map_or(0.0, |t| t.size) >= least * (1.0 - 1e-12));
                seen[1] += usize::from(fields.data.cut_off(cell).is_some());
            }
            Some(scene::Part::Contact) => {
                let mut faces = problem.contact.iter();
                let k = faces.position(|contact| contact.face == face).unwrap();
                let gap = over(face, &|at, x| {
                    let gap = v(cell, at) - given.psi.value(x);
                    assert!(gap <= 1e-9, "{gap}");
                    gap
                });
                let lambda = fields.lambda[k];
                assert!(touching[k] >= lambda * gap - 1e-9, "{}", touching[k]);
                seen[2] += usize::from(lambda < 0.0 && fields.data.cut_off(cell).is_some());
            }
            None => {}
        }
    }
    assert!(seen.iter().all(|count| *count > 3), "{seen:?}");
    // What the numbers take for ‖∇u-G‖ is of G without w.
    assert!(known.of_g >= certificate.g + 0.5 * of_w.sqrt() * (1.0 - 1e-3));
    let found = energy(&fields, fields.all_norms().unwrap().1.energy);
    assert!(found.low - 1e-6 <= of_v && of_v <= found.high + 1e-6);
}

/// Below ψ at all vertices of Γ_D and above it between them: no function keeps both.
#[test]
fn g_above_the_obstacle_between_vertices_is_refused() {
    let scene = Scene::parse(
        r#"
        name = "between"
        mesh = { generator = "union-cube", n = 2 }
        [boundary]
        dirichlet = ["left", "front"]
        neumann = ["right", "back", "top"]
        contact = ["bottom"]
        [data]
        f = "-1"
        g = "sin(2*pi*x)^2+y"
        psi = "0.5+2*y"
        "#,
    );
    let scene = scene.unwrap();
    for n in [2, 4, 8] {
        let mesh = scene.triangulation(Some(n)).unwrap();
        let discretisation = Discretisation::of(&scene, "cr".parse().unwrap());
        let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
        let refused = certify(&problem, &solved(&problem)).unwrap_err();
        assert!(refused.to_string().contains("Γ_D"), "{refused}");
    }
}

/// Jumps inside the cells next to Γ_D, and only on Γ_D, where the formula is a different function inside.
#[test]
fn what_may_jump_is_refused() {
    for g in ["if(x<0.3,0,1)*x^2", "if(z<1,x^2,x^2+1)", "max(0,x-0.3)^0.5"] {
        let scene = with_g(g, "1e3");
        let mesh = scene.triangulation(Some(2)).unwrap();
        let discretisation = Discretisation::of(&scene, "cr".parse().unwrap());
        let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
        let refused = cut_offs(&problem, 0).unwrap_err().to_string();
        let says = refused.contains("may jump") || refused.contains("not bounded");
        assert!(says, "{refused}");
    }
}
