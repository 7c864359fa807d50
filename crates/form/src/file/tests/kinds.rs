//! Spaces of vectors, means and time steps, used wrongly.

use faceoff_mesh::mesh::{CellBlock, CellKind, Group};

use super::{GOOD, assert_refused, check, mesh, refused};

/// With spaces of vectors, a mean and time steps.
pub(super) const VECTORS: &str = r#"
name = "vectors"
[spaces]
q = "RT0"
p = "P0"
e = "N1curl"
[data]
f = "t*x"
[time]
step = 0.25
end = 1
[initial]
p = "x"
[form]
F = """
dot(q, test.q)*dx - p*div(test.q)*dx + div(q)*test.p*dx - f*test.p*dx
+ dot(e - old(e), test.e)/dt*dx + curl(e)*curl(test.e)*dx
"""
[dirichlet]
q = { left = ["x", 0], right = [0, 0], bottom = [0, 0], top = [0, 0] }
[mean]
p = 0.5
"#;

#[test]
fn what_vectors_means_and_steps_do_not_have() {
    let cases = [
        // Spaces of vectors.
        ("\"RT0\"", "¦\"RT0^2\"", "there is no space `RT0^2`"),
        ("\"RT0\"", "¦\"RT1\"", "RT0 and N1curl"),
        (
            "div(q)*test.p*dx",
            "¦curl(q)*test.p*dx",
            "the curl of RT0 functions is 0",
        ),
        (
            "div(q)*test.p*dx",
            "¦div(e)*test.p*dx",
            "the div of N1curl functions is 0",
        ),
        (
            "div(q)*test.p*dx",
            "¦div(grad(q))[0]*test.p*dx",
            "second derivatives of RT0 functions are 0",
        ),
        (
            "div(q)*test.p*dx",
            "¦div(e[0])*test.p*dx",
            "div of a scalar",
        ),
        (
            "left = [\"x\", 0]",
            "left = ¦\"x\"",
            "1 value for q, which has 2 components; give one for each",
        ),
        (
            "left = [\"x\", 0]",
            "left = [\"x\", ¦\"free\"]",
            "a dof of RT0 belongs to all components; give a vector",
        ),
        (
            "F = \"\"\"\ndot(q, test.q)*dx",
            "F = ¦\"\"\"\ndiv(q)*div(test.q)*dx",
            "much of it is free",
        ),
        // Means.
        (
            "p = 0.5",
            "¦e = 0",
            "e is a vector, and means are given of scalars",
        ),
        (
            "p = 0.5",
            "¦w = 0",
            "there is no unknown `w`; the unknowns are q, p, e",
        ),
        (
            "p = 0.5",
            "p = ¦\"0\"",
            "the mean of p is not a finite number",
        ),
        ("[mean]\np = 0.5", "", "give its mean, as in [mean] p = 0"),
        (
            "div(q)*test.p*dx",
            "div(q)*test.p*dx + p*test.p*dx",
            "determine it already; leave it out",
        ),
        // Time steps.
        (
            "f = \"t*x\"\n[time]\nstep = 0.25\nend = 1\n[initial]\np = \"x\"",
            "dt = \"x\"\nf = \"x\"",
            "there are no steps in time",
        ),
        ("step = 0.25", "", "[time] has no step"),
        ("step = 0.25", "step = ¦-1", "step is not a positive number"),
        (
            "step = 0.25",
            "step = ¦\"h\"",
            "step is not a positive number",
        ),
        ("step = 0.25", "step = 0.3", "0.3 goes into 1 3.33"),
        ("step = 0.25", "step = 1e-300", "at most 1000000"),
        ("step = 0.25", "¦steps = 4", "did you mean `step`?"),
        (
            "[data]",
            "[parameters]\nt = 1\n[data]",
            "two things called `t`",
        ),
        (
            "[data]",
            "[data]\n¦dt = \"x\"",
            "there are two things called `dt`",
        ),
        (
            "old(e)",
            "old(¦f)",
            "`f` is not an unknown; the unknowns are q, p, e",
        ),
        ("old(e)", "old(¦2*e)", "this is not an unknown"),
        ("old(e)", "¦old(e, e)", "`old` does not take 2 arguments"),
        ("old(e)", "¦old", "`old` is a function"),
        (
            "f = \"t*x\"",
            "f = \"old(¦x)\"",
            "`x` is not an unknown; old is for F only",
        ),
        (
            "- f*test.p*dx",
            "- old(¦test.p)*dx",
            "this is not an unknown",
        ),
        ("[initial]", "[initial]\n¦w = 0", "there is no unknown `w`"),
        (
            "[initial]",
            "[initial]\n¦e = [0, 0]",
            "not all codes interpolate in N1curl alike",
        ),
        ("p = \"x\"", "p = ¦[\"x\", 1]", "2 values for p"),
        (
            "p = \"x\"",
            "p = ¦\"free\"",
            "an initial value is given or 0",
        ),
        ("p = \"x\"", "p = \"¦e[0]\"", "`e` is not known"),
    ];
    let faults = cases.into_iter().filter_map(|(from, to, words)| {
        assert!(VECTORS.contains(from), "{from}");
        let text = VECTORS.replacen(from, to, 1);
        match text.contains('¦') {
            true => check(&text, words, &mesh()).err(),
            // The position is that of a table.
            false => match refused(&text, &mesh()) {
                Ok(error) if error.to_string().contains(words) => None,
                Ok(error) => Some(format!("{to}\n    {error}\n")),
                Err(why) => Some(why),
            },
        }
    });
    let faults: Vec<String> = faults.collect();
    assert!(faults.is_empty(), "{}", faults.concat());
    let text = VECTORS.replace("[initial]\np = \"x\"\n", "");
    let text = text.replace("- f*test.p*dx", "- old(p)*test.p*dx");
    assert_refused(
        &text.replace("F = ", "F = ¦"),
        "nothing says what p is at time 0; add [initial] with p",
        &mesh(),
    );
    let text = GOOD.replace("[dirichlet]", "[¦initial]\nu = 0\n[dirichlet]");
    assert_refused(&text, "initial values, and no steps in time", &mesh());
    let text = GOOD.replace("[form]", "[form]\n").replace(
        "k*inner(grad(u), grad(v))*dx",
        "k*u*v*dx + ¦grad(grad(grad(u)))[0, 0, 0]*v*dx",
    );
    assert_refused(
        &text.replace("\"P1\"", "\"P3\""),
        "a third derivative",
        &mesh(),
    );
    // On facets between cells no vector is prescribed.
    let mut inside = mesh();
    let mut group = Group::new(1, 77);
    group.name = Some("inside".into());
    group.cells = vec![inside.cell_count() as u32];
    let middle = inside
        .points
        .iter()
        .position(|p| *p == [0.5, 0.5, 0.0])
        .expect("a vertex") as u32;
    let edge = inside
        .points
        .iter()
        .position(|p| *p == [0.5, 0.0, 0.0])
        .expect("a vertex") as u32;
    inside
        .blocks
        .push(CellBlock::new(CellKind::Line, vec![edge, middle]));
    inside.groups.push(group);
    inside.groups.sort_by_key(|group| (group.dim, group.tag));
    let text = VECTORS.replace("left = [\"x\", 0]", "¦inside = [\"x\", 0]");
    assert_refused(
        &text,
        "RT0 functions are held on the boundary only",
        &inside,
    );
}
