//! Mutations of the judged: in a copy of a companion one thing is broken, and the judge must
//! find it, say "disagree", and name the worst face.

use crate::common::{changed_companion, folder, run, scene};

/// Runs Rust against a changed companion on the paper's two methods.
fn caught(companion: &str, from: &str, to: &str) {
    caught_with("cr,p2", companion, from, to);
}

fn caught_with(methods: &str, companion: &str, from: &str, to: &str) {
    let folder = folder();
    let engine = changed_companion(folder.path(), companion, from, to);
    let engines = format!("rust,{engine}");
    // With these n some contact face is partly in contact: there the rule on Γ_C matters to `cr` too.
    let files = [
        ("one-zone", "n = 16", "n = 10"),
        ("one-zone-3d", "n = 8", "n = 3"),
    ]
    .map(|(name, from, to)| {
        let file = scene(&folder.path().join(name), name, from, to);
        format!("{name}/{file}")
    });
    let words = [
        "verify",
        &files[0],
        &files[1],
        "--engines",
        &engines,
        "--methods",
        methods,
        "--json",
        "-",
    ];
    let ran = run(folder.path(), &words);
    assert_eq!(
        ran.code,
        Some(1),
        "{from} -> {to}: {}{}",
        ran.stdout,
        ran.stderr
    );
    let outcome = ran.json();
    assert_eq!(outcome["verdict"], "disagree");
    let cases = outcome["cases"].as_array().unwrap();
    assert_eq!(
        cases.len(),
        2 * methods.split(',').count(),
        "{from} -> {to}"
    );
    for case in cases {
        let vertices = if case["n"] == 3 { 3 } else { 2 };
        let label = format!("{}, {}: {from} -> {to}", case["scene"], case["method"]);
        assert_eq!(case["verdict"], "disagree", "{label}");
        let pairs = case["pairs"].as_array().unwrap();
        // Vertices have no part in the means of P2 on triangles: there the moments tell.
        let by_moments = vertices == 3 && case["method"] == "p2";
        let telling = |p: &&serde_json::Value| {
            p["field"] == "mean" || (by_moments && p["field"] == "moments")
        };
        let mut told = pairs.iter().filter(telling);
        let worst = told.find(|p| p["verdict"] == "disagree");
        let worst = worst.unwrap_or_else(|| panic!("{label}: {pairs:?}"));
        assert_eq!(
            worst["worst"]["vertices"].as_array().unwrap().len(),
            vertices
        );
        assert!(worst["max_rel"].as_f64().unwrap() > worst["tolerance"].as_f64().unwrap());
    }
}

#[test]
fn freefem_unchanged_agrees() {
    let folder = folder();
    let engine = changed_companion(
        folder.path(),
        "freefem",
        "The Signorini problem",
        "The problem",
    );
    let engines = format!("rust,{engine}");
    let ran = run(
        folder.path(),
        &["verify", "one-zone", "--engines", &engines, "--n", "8"],
    );
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
}

#[test]
fn freefem_sign() {
    caught(
        "freefem",
        "* contactTest(v) - flux(u)*v)",
        "* contactTest(v) + flux(u)*v)",
    );
}

#[test]
fn freefem_contact_term_dropped() {
    caught(
        "freefem",
        "(law(u) * contactTest(v) - flux",
        "(0.*law(u) * contactTest(v) - flux",
    );
}

#[test]
fn freefem_positive_part_dropped() {
    caught(
        "freefem",
        "(law(u) * contactTest(v) - flux",
        "((u - psi) * contactTest(v) - flux",
    );
}

#[test]
fn freefem_correction_of_the_flux_dropped() {
    caught_with(
        "cr-fc",
        "freefem",
        "sigma1[][Fh(k, i)] = loads[Wh(k, i)] /",
        "sigma1[][Fh(k, i)] = 0.*loads[Wh(k, i)] /",
    );
}

#[test]
fn freefem_correction_of_the_flux_off_by_a_millionth() {
    caught_with(
        "cr-fc",
        "freefem",
        "sigma1[][Fh(k, i)] = loads[Wh(k, i)] /",
        "sigma1[][Fh(k, i)] = (1 + 1e-6)*loads[Wh(k, i)] /",
    );
}

#[test]
fn fenicsx_correction_of_the_flux_dropped() {
    caught_with("cr-fc", "fenicsx", "dn(u) - dot(n, sigma)", "dn(u)");
}

#[test]
fn fenicsx_correction_of_the_flux_with_the_other_sign() {
    caught_with(
        "cr-fc",
        "fenicsx",
        "dn(u) - dot(n, sigma)",
        "dn(u) + dot(n, sigma)",
    );
}

#[test]
fn freefem_load_dropped() {
    caught("freefem", "(f*v)", "(0.*f*v)");
}

#[test]
fn freefem_gamma_off_by_a_millionth() {
    caught(
        "freefem",
        "gamma[][Ch(cell, 0)] = value;",
        "gamma[][Ch(cell, 0)] = value*(1 + 1e-6);",
    );
}

#[test]
fn freefem_other_rule_for_the_load() {
    caught(
        "freefem",
        "int cellOrder = findCellOrder()",
        "int cellOrder = 3",
    );
}

#[test]
fn freefem_other_rule_on_the_contact_side() {
    // In space order 4 is exact for the same polynomials as the rule asked for.
    caught(
        "freefem",
        "faceOrder = findFaceOrder()",
        "faceOrder = (dimension == 2 ? 4 : 3)",
    );
}

#[test]
fn freefem_two_faces_permuted() {
    caught(
        "freefem",
        "rows = Th.nt*Wh.ndofK;",
        "rows = Th.nt*Wh.ndofK; { int p = Wh(0, 0), q = Wh(9, 1); real keep = coefficients[p]; coefficients[p] = coefficients[q]; coefficients[q] = keep; }",
    );
}

#[test]
fn freefem_one_value_off_in_the_twelfth_digit() {
    caught(
        "freefem",
        "rows = Th.nt*Wh.ndofK;",
        "rows = Th.nt*Wh.ndofK; coefficients[Wh(9, 1)] += 1e-10*coefficients.linfty;",
    );
}

#[test]
fn fenicsx_sign() {
    caught(
        "fenicsx",
        "* ufl.dx(degree=2) - flux(u) * v * ds_C",
        "* ufl.dx(degree=2) + flux(u) * v * ds_C",
    );
}

#[test]
fn fenicsx_contact_term_dropped() {
    caught(
        "fenicsx",
        "a_h + law * (theta2 / gamma * v + theta1 * dn(v)) * ds_C",
        "a_h",
    );
}

#[test]
fn fenicsx_gamma_off_by_a_millionth() {
    caught(
        "fenicsx",
        "of_input[numbers] = values",
        "of_input[numbers] = values * (1 + 1e-6)",
    );
}

#[test]
fn fenicsx_other_rule_for_the_load() {
    caught(
        "fenicsx",
        "data[\"f\"] * v * dx +",
        "data[\"f\"] * v * ufl.dx(degree=3) +",
    );
}

#[test]
fn fenicsx_other_rule_on_the_contact_side() {
    caught(
        "fenicsx",
        "metadata=job.quadrature_rule(quadrature[\"face\"], d - 1)",
        "metadata={\"quadrature_degree\": 4 if d == 2 else 2}",
    );
}

#[test]
fn fenicsx_two_faces_permuted() {
    caught(
        "fenicsx",
        "        dofs = job.gather_dofs(u, cells)",
        "        u.x.array[[7, 90]] = u.x.array[[90, 7]]\n        dofs = job.gather_dofs(u, cells)",
    );
}
