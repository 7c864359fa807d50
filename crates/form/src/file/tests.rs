//! Wrong form files: each is rejected with a message and its position. In the texts `¦` marks the position and is not part of the file.

mod definitions;
mod kinds;

use std::path::Path;

use faceoff_mesh::error::{Error, Place};
use faceoff_mesh::mesh::generate::union_jack;
use faceoff_mesh::mesh::{Group, Mesh};

use crate::Problem;

const GOOD: &str = r#"
name = "good"
[spaces]
u = "P1"
[parameters]
k = 2.0
[data]
force = "x*y"
b = ["1", "x"]
[form]
F = "k*inner(grad(u), grad(v))*dx - force*v*dx"
[dirichlet]
left = 0
"#;

/// With several unknowns.
const PAIR: &str = r#"
name = "pair"
[spaces]
u = "P2^2"
p = "P1"
[form]
F = "inner(grad(u), grad(v))*dx - p*div(v)*dx - q*div(u)*dx"
[dirichlet]
u = { left = [0, 0] }
"#;

fn mesh() -> Mesh {
    union_jack(2, [1.0, 1.0])
}

fn refused(text: &str, mesh: &Mesh) -> Result<Error, String> {
    match Problem::parse(Path::new("form.toml"), text, mesh) {
        Err(error) => Ok(error),
        Ok(_) => Err(format!("this is accepted:\n{text}")),
    }
}

/// Is a file with a mark rejected there, with this message? If not, why not.
fn check(marked: &str, words: &str, mesh: &Mesh) -> Result<(), String> {
    let (before, after) = marked.split_once('¦').expect("a mark");
    let line = before.matches('\n').count() + 1;
    let last = before.rsplit('\n').next().expect("a line");
    let column = last.chars().count() + 1;
    let error = refused(&[before, after].concat(), mesh)?;
    let told = error.to_string();
    let is_there =
        matches!(error, Error::File { place: Place::Column(l, c), .. } if (l, c) == (line, column));
    let fault = match (told.contains(words), is_there) {
        (true, true) => return Ok(()),
        (false, _) => format!("has no `{words}`"),
        (_, false) => format!("is not at {line}:{column}"),
    };
    let at = marked.lines().find(|line| line.contains('¦')).unwrap_or("");
    Err(format!("{at}\n    {told}\n    {fault}\n"))
}

fn assert_refused(marked: &str, words: &str, mesh: &Mesh) {
    check(marked, words, mesh).unwrap_or_else(|why| panic!("{why}"));
}

fn check_form(form: &str, words: &str) -> Result<(), String> {
    let rest = "k*inner(grad(u), grad(v))*dx - force*v*dx";
    check(&GOOD.replace(rest, form), words, &mesh())
}

#[test]
fn what_is_replaced_was_right() {
    for text in [GOOD, PAIR, kinds::VECTORS] {
        Problem::parse(Path::new("form.toml"), text, &mesh()).unwrap_or_else(|e| panic!("{e}"));
    }
}

#[test]
fn wrong_forms_are_refused_with_their_place() {
    let cases = [
        // Names.
        (
            "u*v*dx - ¦g*v*dx",
            "`g` is not known; did you mean `b`? declared are u, v, k, force, b",
        ),
        ("u*v*dx - ¦forse*v*dx", "did you mean `force`?"),
        ("u*v*dx + ¦sine(u)*v*dx", "no function `sine`"),
        ("¦z*u*v*dx", "no z in 2D"),
        ("¦test.w*u*dx", "no unknown `w`"),
        ("¦test*u*dx", "`test` is not a value"),
        ("u*v*dx + ¦dot*v*dx", "`dot` is a function"),
        ("u*v*dx + ¦k(1)*v*dx", "`k` is not a function"),
        ("¦u.x*v*dx", "there is no `.x`"),
        // Groups.
        ("u*v*dx - force*v*ds(¦letf)", "did you mean `left`?"),
        ("u*v*dx(¦left)", "cells of dimension 1, and 2 is needed"),
        (
            "u*v*dx + jump(u)*jump(v)*dS(¦left)",
            "is on the boundary; integrate over it with ds",
        ),
        ("u*v*ds(left, ¦u + 1)", "not a group"),
        (
            "u*v*dx(¦degree=7)",
            "write dx(degree=2), an integer from 0 to 5",
        ),
        ("u*v*dx(¦degree=1.5)", "not the degree of a rule"),
        ("u*v*ds(left, ¦order=1)", "not the degree of a rule"),
        ("u*v*dx + abs(¦u=1)*v*dx", "`=` where a value is needed"),
        // Measures.
        ("¦u*v", "not integrated"),
        ("u*v*dx - ¦force", "not integrated"),
        ("¦force - u*v*dx", "not integrated"),
        ("¦dx*u*v", "a measure before"),
        ("u*v*dx*¦dx", "a second measure"),
        ("¦dx", "nothing is multiplied with"),
        ("¦(u*v*dx)*2", "an integral where a value is needed"),
        ("sin(¦u*v*dx)", "an integral where a value is needed"),
        ("sin(¦dx)*v*dx", "a measure where a value is needed"),
        // Sides.
        ("¦n[0]*u*v*dx", "cells have no normal"),
        ("u*v*dx + ¦u*v*dS", "u has two values on the facets of dS"),
        ("u*v*dx + ¦jump(u)*v*ds", "a side of u is taken"),
        ("¦avg(u)*v*dx", "a side of u is taken"),
        ("u*v*dx + ¦u('*')*v*dx", "no side `*`"),
        (
            "u*v*dx + ¦facet_length*u*v*dx",
            "facet_length is of facets, and dx is over cells; write h in dx",
        ),
        (
            "u*v*dx + ¦circumradius*jump(u)*jump(v)*dS",
            "circumradius has two values on the facets of dS",
        ),
        (
            "u*v*dx + ¦facet_length('+')*u*v*ds",
            "a side of facet_length is taken",
        ),
        // Test functions.
        ("u*v*dx - ¦force*dx", "a term without a test function"),
        ("u*v*dx + ¦u*v*v*dx", "a product of two test functions"),
        (
            "u*v*dx + ¦sin(v)*dx",
            "a test function inside of a function",
        ),
        ("u*v*dx + ¦v^2*dx", "a test function inside of a function"),
        ("u*v*dx + ¦u/v*dx", "a test function inside of a function"),
        (
            "¦conditional(v > 0, u, 0)*dx",
            "inside of a function, power, divisor or condition",
        ),
        // Shapes.
        (
            "¦inner(grad(u), v)*dx",
            "inner of a vector of 2 components and a scalar",
        ),
        (
            "¦grad(u)*grad(v)*dx",
            "`*` between a vector of 2 components and a vector of 2",
        ),
        ("¦grad(u)*dx", "only scalars are integrated"),
        (
            "¦(b + 1)*u*v*dx",
            "a vector of 2 components and a scalar cannot be added",
        ),
        ("¦dot(u, v)*dx", "dot of a scalar and a scalar"),
        (
            "¦dot([1, 2, 3], grad(v))*u*dx",
            "dot of a vector of 3 components",
        ),
        (
            "¦cross(b, b)[0]*u*v*dx",
            "cross of a vector of 2 components",
        ),
        ("¦div(u)*v*dx", "div of a scalar"),
        (
            "¦curl([1, 2, 3])[0]*v*dx",
            "curl of a vector of 3 components in 2D",
        ),
        (
            "det(¦grad(u))*v*dx",
            "a matrix is needed here, and this is a vector of 2",
        ),
        (
            "det(¦[[1, 2, 3], [4, 5, 6]])*u*v*dx",
            "square matrix is needed here, and this is a 2 × 3",
        ),
        ("Identity(¦4)[0, 0]*u*v*dx", "not the size of a matrix"),
        ("b[¦2]*u*v*dx", "components count from 0 to 1"),
        ("b[¦0.5]*u*v*dx", "not the number of a component"),
        ("¦u[0]*v*dx", "1 indices of a scalar"),
        ("¦[1, b][0]*u*v*dx", "in one list"),
        ("2^¦b*u*v*dx", "only scalars are exponents"),
        ("u/¦b*v*dx", "only scalars divide"),
        (
            "¦outer(outer(b, b), outer(b, outer(b, outer(b, [1, 2, 3]))))*u*v*dx",
            "more than 81",
        ),
        (
            "u*v*dx + ¦div(grad(u))*v*dx",
            "second derivatives of P1 functions are 0",
        ),
        // Arguments.
        ("u*v*dx + ¦max(u)*v*dx", "`max` does not take 1 argument;"),
        ("¦inner(u, v, u)*dx", "`inner` does not take 3 arguments"),
        ("conditional(¦u, 1, 0)*v*dx", "needs a comparison first"),
        ("sin(¦u < 1)*v*dx", "a comparison where a value is needed"),
        ("max(¦'+', u)*v*dx", "a text where a value is needed"),
        ("u/¦0*v*dx", "a division by 0"),
        ("u/¦(1 - 1)*v*dx", "a division by 0"),
        // Grammar.
        ("2 ¦u*v*dx", "where the expression should end"),
        ("(u*v*dx¦", "the end where `)` is needed"),
        ("u*v*dx + ¦", "ends where a value is needed"),
        ("u*v*dx + ¦$", "`$` where a value is needed"),
        ("u ¦== v", "where the expression should end"),
        ("u*v*dx + ¦1e999*v*dx", "not a finite number"),
    ];
    let faults = cases
        .into_iter()
        .filter_map(|(form, words)| check_form(form, words).err());
    let faults: Vec<String> = faults.collect();
    assert!(faults.is_empty(), "{}", faults.concat());
}

#[test]
fn wrong_files_are_refused_with_their_place() {
    let cases = [
        ("[form]", "[form¦", "write TOML"),
        ("name = \"good\"", "¦nam = \"good\"", "did you mean `name`?"),
        ("\nname = \"good\"", "¦", "there is no name"),
        (
            "name = \"good\"",
            "name = ¦\"../evil\"",
            "the name of a file",
        ),
        (
            "name = \"good\"",
            "name = ¦'a\"; exec(1)'",
            "the name of a file",
        ),
        ("[spaces]\nu = \"P1\"", "[¦spaces]", "no unknown"),
        ("u = \"P1\"", "u = ¦\"P4\"", "no space `P4`; known are P0"),
        ("u = \"P1\"", "u = ¦\"P1^0\"", "no space `P1^0`"),
        ("u = \"P1\"", "u = ¦[1]", "this is an array"),
        (
            "u = \"P1\"",
            "¦dx = \"P1\"",
            "`dx` is a word of the language",
        ),
        (
            "u = \"P1\"",
            "¦u_ = \"P1\"",
            "not a name that all codes can have",
        ),
        (
            "u = \"P1\"",
            "¦\"u v\" = \"P1\"",
            "not a name that all codes can have",
        ),
        (
            "k = 2.0",
            "k = ¦\"two\"",
            "the parameter k is not a finite number",
        ),
        (
            "k = 2.0",
            "k = ¦inf",
            "the parameter k is not a finite number",
        ),
        ("k = 2.0", "k = 2.0\n¦u = 1", "two things called `u`"),
        ("force = \"x*y\"", "force = \"x*¦u\"", "`u` is not known"),
        (
            "force = \"x*y\"",
            "force = \"¦sin(n[0])\"",
            "n in a function of the point; use n in F",
        ),
        (
            "force = \"x*y\"",
            "force = \"x*¦/y\"",
            "where a value is needed",
        ),
        ("force = \"x*y\"", "force = ¦true", "this is a boolean"),
        (
            "force = \"x*y\"",
            "force = { ¦exp = \"x\", space = \"P1\" }",
            "did you mean `expr`?",
        ),
        (
            "force = \"x*y\"",
            "force = ¦{ expr = \"x\" }",
            "no expr or no space",
        ),
        (
            "force = \"x*y\"",
            "force = { expr = \"x\", space = ¦\"CR\" }",
            "not a space for data",
        ),
        (
            "b = [\"1\", \"x\"]",
            "b = ¦[1, 2, 3, 4]",
            "not a vector or matrix",
        ),
        (
            "b = [\"1\", \"x\"]",
            "b = [[1, 2], ¦[3]]",
            "not a vector or matrix",
        ),
        ("b = [\"1\", \"x\"]", "b = [[1, 2], ¦3]", "different shapes"),
        ("F = ", "¦G = ", "no key `G`"),
        (
            "[dirichlet]",
            "degree = ¦6\n[dirichlet]",
            "an integer from 1 to 5",
        ),
        (
            "[dirichlet]",
            "facet_degree = ¦0\n[dirichlet]",
            "an integer from 1 to 9",
        ),
        (
            "[dirichlet]",
            "degree = ¦\"high\"\n[dirichlet]",
            "an integer from 1 to 5",
        ),
        ("left = 0", "¦lfet = 0", "did you mean `left`?"),
        ("left = 0", "left = \"¦u\"", "`u` is not known"),
        (
            "left = 0",
            "left = \"force + ¦missing\"",
            "`missing` is not known",
        ),
        (
            "left = 0",
            "left = ¦[0, 1]",
            "2 values for u, which has 1 component;",
        ),
        (
            "left = 0",
            "¦w = { left = 0 }",
            "no unknown `w`; the unknowns are u",
        ),
        (
            "F = \"k*inner(grad(u), grad(v))*dx - force*v*dx\"\n[dirichlet]\nleft = 0",
            "F = ¦\"inner(grad(u), grad(v))*dx\"",
            "nothing holds u",
        ),
        (
            "F = \"k*inner(grad(u), grad(v))*dx - force*v*dx\"",
            "F = ¦\"force*v*dx\"",
            "F does not depend on u",
        ),
    ];
    let faults = cases.into_iter().filter_map(|(from, to, words)| {
        assert!(GOOD.contains(from), "{from}");
        check(&GOOD.replacen(from, to, 1), words, &mesh()).err()
    });
    let faults: Vec<String> = faults.collect();
    assert!(faults.is_empty(), "{}", faults.concat());
    for (from, to, words) in [
        (
            "u = { left = [0, 0] }",
            "¦left = 0",
            "not clear which one is held",
        ),
        (
            "u = { left = [0, 0] }",
            "u = { left = ¦0 }",
            "1 value for u, which has 2 components",
        ),
    ] {
        assert_refused(&PAIR.replacen(from, to, 1), words, &mesh());
    }
    let text =
        GOOD.replace("[parameters]\nk = 2.0", "")
            .replacen("name", "parameters = ¦3\nname", 1);
    assert_refused(&text, "parameters is not a table", &mesh());
    let text = PAIR.replace(" - q*div(u)*dx", "");
    assert_refused(
        &text.replace("F = ", "F = ¦"),
        "no term of F has the test function q",
        &mesh(),
    );
    let text = GOOD.replace("\"P1\"", "\"DG1\"");
    assert_refused(
        &text.replace("left = 0", "¦left = 0"),
        "DG1 has no dofs on facets",
        &mesh(),
    );
    let text = "F = \"u*v*dx + ¦u('+')*v('+')*dS\"";
    let text = GOOD
        .replace("\"P1\"", "\"DG1\"")
        .replace("\n[dirichlet]\nleft = 0", "")
        .replace("F = \"k*inner(grad(u), grad(v))*dx - force*v*dx\"", text);
    assert_refused(&text, "changes when the two sides", &mesh());
}

/// A flow in a closed box: the pressure is determined up to a constant.
#[test]
fn a_free_constant_of_the_pressure_is_refused() {
    let closed = PAIR.replace(
        "left = [0, 0]",
        "left = [0, 0], right = [0, 0], bottom = [0, 0], top = [1, 0]",
    );
    let marked = closed.replace("F = ", "F = ¦");
    assert_refused(&marked, "a constant can be added to p", &mesh());
    for (from, to) in [
        ("top = [1, 0]", "top = [1, \"free\"]"),
        ("- q*div(u)*dx", "- q*div(u)*dx - 0.001*p*q*dx"),
        ("- p*div(v)*dx", "- (1 + x)*p*div(v)*dx"),
        ("- p*div(v)*dx", "- p*div(v)*dx + p*v[0]*dx"),
        ("u = { left", "p = { left = 0 }\nu = { left"),
    ] {
        let text = closed.replace(from, to);
        if let Err(error) = Problem::parse(Path::new("form.toml"), &text, &mesh()) {
            panic!("{to}: {error}");
        }
    }
}

#[test]
fn forms_that_are_the_same_from_both_sides_are_accepted() {
    let form = "F = \"k*inner(grad(u), grad(v))*dx - force*v*dx\"\n[dirichlet]\nleft = 0";
    for space in ["DG1", "CR", "P1"] {
        for integral in [
            "jump(u)*jump(v)",
            "jump(u)*n('+')[0]*avg(v)",
            "inner(jump(u, n), avg(grad(v)))",
            "(u('+')*v('-') + u('-')*v('+'))",
            "h('+')*h('-')*sqrt(1 + jump(u)^2)*avg(v)",
            "abs(n('-')[0])*avg(u)*avg(v)",
            "conditional(dot(b, n('+')) > 0, u('+'), u('-'))*dot(b, n('+'))*jump(v)",
            "force*avg(v)",
            "avg(circumradius)/facet_length*jump(u)*jump(v)",
            "facet_length('+')*avg(v)",
        ] {
            let text = GOOD
                .replace("\"P1\"", &format!("\"{space}\""))
                .replace(form, &format!("F = \"u*v*dx + {integral}*dS\""));
            if let Err(error) = Problem::parse(Path::new("form.toml"), &text, &mesh()) {
                panic!("{integral}: {error}");
            }
        }
    }
}

#[test]
fn places_in_texts_of_several_lines_and_letters_of_several_bytes() {
    let form = "F = \"k*inner(grad(u), grad(v))*dx - force*v*dx\"";
    let text = GOOD.replace(form, "F = \"\"\"\nu*v*dx\n  - ¦g*v*dx\"\"\"");
    assert_refused(&text, "`g` is not known", &mesh());
    let text = GOOD.replace("name = \"good\"", "name = \"good\"\nabout = \"Größe\"");
    let text = text.replace(form, "F = 'u*v*dx - ¦ö*v*dx' # öäü");
    assert_refused(&text, "`ö` is not known", &mesh());
}

#[test]
fn meshes_that_codes_would_understand_differently_are_refused() {
    let text = GOOD.replace("- force*v*dx", "- force*v*ds");
    let mut bare = mesh();
    bare.groups
        .retain(|group| group.name.as_deref() != Some("top"));
    let error = refused(&text, &bare).expect("an error").to_string();
    assert!(
        error.contains("2 facets of the boundary are in no group"),
        "{error}"
    );

    let mut overlapping = mesh();
    let mut both = Group::new(1, 9);
    both.cells = overlapping.groups[0].cells.clone();
    both.cells.extend(&overlapping.groups[1].cells);
    overlapping.groups.push(both);
    let error = refused(&text, &overlapping).expect("an error").to_string();
    assert!(
        error.contains("overlap") && error.contains("bottom and 9"),
        "{error}"
    );

    let mut zero = mesh();
    for group in &mut zero.groups {
        if group.name.as_deref() == Some("left") {
            group.tag = 0;
        }
    }
    let error = refused(GOOD, &zero).expect("an error").to_string();
    assert!(
        error.contains("the group `left` has the number 0"),
        "{error}"
    );
}

/// Damaged files give an error or a problem, never a panic.
#[test]
fn no_damage_to_a_file_ends_in_a_panic() {
    let mesh = mesh();
    let mut state = 2017_u64;
    let mut next = move |below: usize| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    let pieces = [
        "(",
        ")",
        "[",
        "]",
        "{",
        "}",
        "\"",
        "'",
        "\\",
        "=",
        ",",
        ".",
        "+",
        "-",
        "*",
        "/",
        "^",
        "<",
        "dx",
        "dS",
        "ds(left)",
        "u",
        "v",
        "test.u",
        "grad(",
        "inv(",
        "dev(",
        "jump(",
        "outer(",
        "n",
        "h",
        "x[0]",
        "1e308",
        "0",
        "\n",
        "\r",
        "\u{2028}",
        "é",
        "\0",
        "conditional(",
        "'+'",
        "Identity(2)",
        ".T",
        "cofac(",
        "**",
        "det(",
        "avg(",
        "cross(",
        "old(",
        "grad(grad(",
    ];
    for good in [GOOD, PAIR, kinds::VECTORS] {
        for _ in 0..3000 {
            let mut text: Vec<char> = good.chars().collect();
            for _ in 0..1 + next(4) {
                let at = next(text.len() + 1);
                match next(4) {
                    0 => text.truncate(at),
                    1 => drop(text.splice(at.min(text.len())..(at + next(6)).min(text.len()), [])),
                    _ => drop(text.splice(at..at, pieces[next(pieces.len())].chars())),
                }
            }
            let text: String = text.into_iter().collect();
            if let Ok(problem) = Problem::parse(Path::new("form.toml"), &text, &mesh) {
                for code in &crate::codes::CODES {
                    let why = code.script(&problem).err().unwrap_or_default();
                    assert!(!why.contains("internal error"), "{why}: {text}");
                }
            }
        }
    }
}

/// Nested functions of tensors make expressions that grow with each level.
#[test]
fn deep_nesting_ends_in_time() {
    let form = "F = \"k*inner(grad(u), grad(v))*dx - force*v*dx\"";
    for (open, close) in [
        ("dev(", ")"),
        ("inv(", ")"),
        ("cofac(", ")"),
        ("sym(", ")"),
        ("transpose(", ")"),
        ("outer(b, b)*tr(", ")"),
        ("sin(1)*", ""),
        ("dot(outer(b, b), ", ")"),
        ("det(", ")*outer(b, b)"),
        ("1/inner(b, b)*", ""),
    ] {
        for depth in [10, 40, 100] {
            let inside = format!(
                "{}outer(b, grad(u)){}",
                open.repeat(depth),
                close.repeat(depth)
            );
            for text in [
                format!("u*v*dx + inner({inside}, outer(b, grad(v)))*dx"),
                format!(
                    "u*v*dx + inner({}, Identity(2))*dx",
                    inside.replace("grad(u)", "grad(v)")
                ),
            ] {
                let text = GOOD.replace(form, &format!("F = '''{text}'''"));
                if let Ok(problem) = Problem::parse(Path::new("form.toml"), &text, &mesh()) {
                    for code in &crate::codes::CODES {
                        let _ = code.script(&problem);
                    }
                }
            }
            let matrix = inside.replace("grad(u)", "[1, x]");
            let text = GOOD.replace("\"x*y\"", &format!("'''({matrix})[0, 0]'''"));
            if let Ok(problem) = Problem::parse(Path::new("form.toml"), &text, &mesh()) {
                for code in &crate::codes::CODES {
                    let _ = code.script(&problem);
                }
            }
        }
    }
}
