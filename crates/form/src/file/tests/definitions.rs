//! Definitions mean the same as their bodies inserted by hand, and errors in them are reported where they are used.

use std::path::Path;

use super::{check, mesh};
use crate::Problem;

const DEFINED: &str = r#"
name = "defined"
[spaces]
u = "P1^2"
[parameters]
E = 2.0
[definitions]
mu = "E - 1/2"
"sigma(w)" = "2*mu*sym(grad(w))"
"part(mu, w)" = "mu*w + E"
"both(w)" = "w - mu"
"same(w)" = "w"
[data]
g = "part(x - y, 3)^2"
[form]
F = """inner(sigma(u), sym(grad(v)))*dx + inner(jump(sigma(u), n), jump(v))*dS
  + both(u[0])('+')*both(u[0])('-')*avg(v[0])*dS + part(both(2), u[1])*v[1]*ds(left) - same(g)*v[0]*dx"""
[dirichlet]
left = ["-mu^2", "free"]
"#;

/// The same, inserted by hand.
const PLAIN: &str = r#"
name = "defined"
[spaces]
u = "P1^2"
[parameters]
E = 2.0
[data]
g = "((x - y)*3 + E)^2"
[form]
F = """inner(2*(E - 1/2)*sym(grad(u)), sym(grad(v)))*dx + inner(jump(2*(E - 1/2)*sym(grad(u)), n), jump(v))*dS
  + (u[0] - (E - 1/2))('+')*(u[0] - (E - 1/2))('-')*avg(v[0])*dS + ((2 - (E - 1/2))*u[1] + E)*v[1]*ds(left) - g*v[0]*dx"""
[dirichlet]
left = ["-(E - 1/2)^2", "free"]
"#;

fn read(text: &str) -> Problem {
    Problem::parse(Path::new("form.toml"), text, &mesh()).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn a_definition_is_what_is_written_in_its_place() {
    let [defined, plain] = [DEFINED, PLAIN].map(read);
    let all = |problem: &Problem| {
        let terms = problem
            .integrals
            .iter()
            .map(|i| &i.terms)
            .collect::<Vec<_>>();
        let data = problem
            .data
            .iter()
            .map(|datum| &datum.components)
            .collect::<Vec<_>>();
        let held = problem
            .conditions
            .iter()
            .map(|held| held.value)
            .collect::<Vec<_>>();
        format!("{terms:?} {data:?} {held:?} {:?}", problem.scalars)
    };
    assert_eq!(all(&defined), all(&plain));
    // Terms are shown as they were written, each from its beginning.
    let starts = defined
        .integrals
        .iter()
        .map(|i| &defined.form.source[i.at..]);
    let starts: Vec<&str> = starts.map(|text| &text[..8]).collect();
    assert_eq!(
        starts,
        ["inner(si", "inner(ju", "both(u[0", "part(bot", "same(g)*"]
    );
}

#[test]
fn wrong_definitions_are_refused_with_their_place() {
    let cases = [
        ("\"E - 1/2\"", "\"E - ¦\"", "ends where a value is needed"),
        ("\"E - 1/2\"", "\"¦E*dx\"", "a definition is a value"),
        ("mu = ", "¦\"mu + 1\" = ", "not the head of a definition"),
        ("mu = ", "¦div = ", "`div` is a word of the language"),
        (
            "\"sigma(w)\"",
            "¦\"sigma(x)\"",
            "the argument `x` is a word",
        ),
        (
            "\"part(mu, w)\"",
            "¦\"part(w, w)\"",
            "two arguments are called `w`",
        ),
        ("u = \"P1^2\"", "¦mu = \"P1^2\"", "two things called `mu`"),
        (
            "\"w - mu\"",
            "\"w - ¦part(mu)\"",
            "`part` does not take 1 argument",
        ),
        (
            "inner(sigma(u), sym",
            "inner(¦sigma, sym",
            "`sigma` is a function",
        ),
        (
            "inner(sigma(u), sym",
            "inner(¦sigma(u, v), sym",
            "`sigma` does not take 2 arguments",
        ),
        (
            "- same(g)*v[0]",
            "- g*¦mu(x)*v[0]",
            "write mu without arguments",
        ),
        ("- same(g)*v[0]", "- g*both(¦w)*v[0]", "`w` is not known"),
        (
            "- same(g)*v[0]",
            "- ¦sigma(u)*v[0]",
            "only scalars are integrated",
        ),
        (
            "2*mu*sym",
            "nu*sym",
            "with the definition of `sigma`: `nu` is not known",
        ),
        (
            "left = [\"-mu^2\"",
            "left = [\"-¦sigma(x)\"",
            "with the definition of `sigma`: ",
        ),
    ];
    for (from, to, words) in cases {
        let changed = DEFINED.replacen(from, to, 1);
        assert_ne!(changed, DEFINED, "{from}");
        let marked = match to.contains('¦') {
            true => changed,
            // Inserted text has the position of its use.
            false => changed.replacen("inner(sigma", "inner(¦sigma", 1),
        };
        check(&marked, words, &mesh()).unwrap_or_else(|why| panic!("{why}"));
    }
}

/// Each doubles the one before: the inserted text ends at a limit, before memory is allocated for it.
#[test]
fn definitions_that_double_end_at_a_limit() {
    let doubles = (1..60).map(|k| format!("a{k} = \"a{0} + a{0}\"\n", k - 1));
    let doubles: String = doubles.collect();
    let text = DEFINED.replace("[data]", &format!("a0 = \"x*x\"\n{doubles}[data]"));
    let error = Problem::parse(Path::new("form.toml"), &text, &mesh()).expect_err("a limit");
    let words = "more than 20000 characters";
    assert!(error.to_string().contains(words), "{error}");
}
