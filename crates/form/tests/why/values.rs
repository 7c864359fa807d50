//! Values that are not those of the solution: on Dirichlet groups, at a few places, at each other's, and of iterations that stopped.

use faceoff_form::judge::judge;
use faceoff_form::own;
use faceoff_mesh::mesh::Mesh;

use super::{SURFACE, all, diffusion, exact, parse, put, square};

/// What is told of Dirichlet values that are other ones.
fn told_of_values(text: &str, edits: &[(&str, &str)], mesh: &Mesh) -> String {
    let form = parse(text, mesh);
    let mut changed = text.to_owned();
    for (from, to) in edits {
        assert!(changed.contains(from), "no {from} in {text}");
        changed = changed.replacen(from, to, 1);
    }
    let judged = put(&changed, &form, mesh, |_| ());
    assert!(judged.rows[0].error < 1e-12, "{edits:?}: all rows hold");
    all(&form, &judged, &judged.given)
}

#[test]
fn other_dirichlet_values_are_named() {
    let mesh = square(6);
    for element in ["P1", "P2", "CR"] {
        let text = diffusion(element)
            .replace("left = 0", "left = \"y^2\"")
            .replace("bottom = \"x\"", "bottom = \"sin(3*(x + y))\"");
        let of = |from, to| told_of_values(&text, &[(from, to)], &mesh);
        let bottom = |to| of("bottom = \"sin(3*(x + y))\"", to);
        assert_eq!(
            bottom("bottom = \"1.001*sin(3*(x + y))\""),
            "Factor 1.001 on bottom"
        );
        assert_eq!(bottom("bottom = 0"), "Factor 0 on bottom");
        assert_eq!(
            bottom("bottom = \"-sin(3*(x + y))\""),
            "Factor -1 on bottom"
        );
        assert_eq!(
            bottom("bottom = \"sin(3*(x + y)) - 0.01\""),
            "Added -0.01 on bottom"
        );
        assert_eq!(bottom("bottom = \"y^2\""), "Factor 0 on bottom");
        assert_eq!(
            of("left = \"y^2\"", "left = \"sin(3*(x + y))\""),
            "Of(1) 1 on left"
        );
        assert_eq!(bottom(""), "Free 1 on bottom");
        assert_eq!(
            of(
                "left = \"y^2\"\nbottom = \"sin(3*(x + y))\"",
                "left = \"2*y^2\"\nbottom = \"3*sin(3*(x + y))\""
            ),
            "Factor 2 on left and Factor 3 on bottom"
        );
        let term = "t*v*ds(right)";
        let weakly = |more: &str| {
            let edits = [
                ("left = \"y^2\"\nbottom = \"sin(3*(x + y))\"", ""),
                (term, &*format!("{term} {more}")),
            ];
            told_of_values(&text, &edits, &mesh)
        };
        // A penalty on CR is also one on functions of the other faces.
        if element != "CR" {
            let of = |left: &str, bottom: &str| {
                weakly(&format!(
                    "+ {left}*(u - y^2)*v*ds(left) + {bottom}*(u - sin(3*(x + y)))*v*ds(bottom)"
                ))
            };
            assert_eq!(of("1e6", "1e6"), "Integrated 1000000");
            assert_eq!(of("20/h", "20/h"), "OverH 20");
            assert_eq!(of("1e4", "1e6"), "");
            // A penalty beyond all digits is the projection by the rule of the form; here on one side alone.
            let alone = text
                .replace("bottom = \"sin(3*(x + y))\"", "")
                .replace("y^2", "exp(3*y)");
            let edits = [
                ("left = \"exp(3*y)\"", ""),
                (term, &*format!("{term} + 1e15*(u - exp(3*y))*v*ds(left)")),
            ];
            let projected = told_of_values(&alone, &edits, &mesh);
            assert_eq!(projected, "Projected(\"gauss-3\") 1 on left");
        }
        // Nor are values that are off by a few roundings.
        assert_eq!(bottom("bottom = \"sin(3*(x + y)) + 4e-12*sin(40*x)\""), "");
        // What is not known is not called one.
        assert_eq!(bottom("bottom = \"sin(3*(x + y)) + 1e-3*sin(7*x)\""), "");
        assert_eq!(of("left = \"y^2\"", "left = \"y^3\""), "");
        if element != "P1" {
            // Right at the vertices alone.
            let form = parse(&text, &mesh);
            let other = parse(&text.replace(element, "P1"), &mesh);
            let linear = own::solve(&other, &mesh).expect("it is regular");
            let (cells, fields) = own::output(&linear.assembler, &linear.u);
            let judged = judge(&form, &mesh, &Mesh { fields, ..cells }, 2e-16);
            let judged = judged.unwrap_or_else(|e| panic!("{e}"));
            let found = all(&form, &judged, &judged.given);
            assert_eq!(found, "Linear 1 on bottom and Linear 1 on left");
        }
    }
}
/// What shows only beside the solution.
#[test]
fn wrong_values_and_iterations_that_stopped_are_named() {
    let (text, mesh) = (diffusion("P1"), square(8));
    let form = parse(&text, &mesh);
    let solution = own::solve(&form, &mesh).expect("it is regular");
    let of = |u: &[f64]| {
        let (cells, fields) = own::output(&solution.assembler, u);
        let judged = judge(&form, &mesh, &Mesh { fields, ..cells }, 2e-16);
        let judged = judged.unwrap_or_else(|e| panic!("{e}"));
        assert!(judged.rows[0].error > 1e-12);
        exact(&form, &judged).join(", or ")
    };
    for (k, size) in [(20, 1e-3), (57, 1e-7), (3, 1e-10)] {
        let mut u = solution.u.clone();
        u[k] += size;
        assert_eq!(of(&u), "1 values");
        u.swap(k, k + 9);
        // One of them is wrong as well.
        assert!(size < 1e-6 || of(&u) != "2 exchanged");
        u[k + 9] -= size;
        assert_eq!(of(&u), "2 exchanged");
    }
    // All of them wrong by chance are not explained.
    let noisy = solution.u.iter().enumerate();
    let noisy = noisy.map(|(k, u)| u + 1e-6 * (7.0 * k as f64).sin());
    assert_eq!(of(&noisy.collect::<Vec<f64>>()), "");

    let form = parse(SURFACE, &mesh);
    let mut steps = Vec::new();
    let solution = own::solve_with(&form, &mesh, |u| steps.push(u.to_vec()));
    let solution = solution.expect("it is regular");
    assert!(steps.len() > 4, "{} steps", steps.len());
    for step in 1..4 {
        let (cells, fields) = own::output(&solution.assembler, &steps[step - 1]);
        let judged = judge(&form, &mesh, &Mesh { fields, ..cells }, 2e-16);
        let judged = judged.unwrap_or_else(|e| panic!("{e}"));
        let wanted = format!("step {step} of {}", steps.len());
        assert_eq!(exact(&form, &judged), [wanted]);
    }
}
