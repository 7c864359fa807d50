//! Random forms, in all codes.

use faceoff_mesh::mesh::Mesh;

use super::cubes::lattice;
use super::{agree_on, square};

/// The same values on every day and machine; `FACEOFF_SEED` asks for others.
struct Random(u64);

impl Random {
    fn below(&mut self, most: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % most
    }

    fn is(&mut self, percent: usize) -> bool {
        self.below(100) < percent
    }

    fn of<'a>(&mut self, all: &[&'a str]) -> &'a str {
        all[self.below(all.len())]
    }
}

/// A function of the point.
fn datum(random: &mut Random, depth: usize) -> String {
    if depth == 0 {
        return random.of(&["x", "y", "0.5", "x*y", "2", "pi"]).to_owned();
    }
    let [a, b] = [0; 2].map(|_| datum(random, depth - 1));
    match random.below(14) {
        0 => format!("sin(3*({a}))"),
        1 => format!("exp(-({a})^2)"),
        2 => format!("({a})/(1 + ({b})^2)"),
        3 => format!("abs({a} - {b})"),
        4 => format!("max({a}, {b})"),
        5 => format!("conditional({a} < {b} + 0.0123, {a}, 1 - ({b}))"),
        6 => format!("sqrt(1 + ({a})^2)"),
        7 => format!("atan2({a}, 1 + ({b})^2)"),
        8 => format!("-({a})^3"),
        9 => format!("min({a}, tanh({b}))"),
        10 | 11 => format!("({a})*({b})"),
        _ => format!("{a} + {b}"),
    }
}

const SCALAR: &[&str] = &[
    "0.3*dot(b, grad(u))*v*dx",
    "0.2*u^3*v*dx",
    "0.2*sin(u)*v*dx",
    "g*v*ds(right)",
    "0.5*u*v*ds(left, top)",
    "0.05*dot(grad(u), n)*v*ds(bottom)",
    "0.1*u*inner(grad(u), grad(v))*dx",
    "0.1*h*dot(b, grad(u))*dot(b, grad(v))*dx",
    "0.1*max(u, f)*v*dx",
    "0.1*sqrt(1 + inner(grad(u), grad(u)))*v*dx",
    "0.1*avg(f*u)*avg(v)*dS",
    "0.1*exp(-u^2)*dot(b, grad(v))*dx",
    "0.1*g*u*v*ds",
    "0.1*conditional(x < 0.4, u, f)*v*dx",
    "0.1*u/(1 + u^2)*v*dx",
    "0.1*inner(cofac(outer(b, b) + Identity(2)), outer(grad(u), grad(v)))*dx",
    "0.1*inner(avg(grad(u)), avg(grad(v)))*avg(h)^2*dS",
    "0.1*atan2(u, 2 + f)*v*dx",
    "0.1*jump(grad(u), n)*jump(grad(v), n)*avg(h)*dS",
    "0.1*tr(outer(b, grad(u)))*v*dx",
    "0.1*dot(K, grad(u))[0]*grad(v)[1]*dx",
    "0.1*f*u*v*dx",
    "0.1*dot(dot(grad(u), K), grad(v))*dx",
];

const VECTOR: &[&str] = &[
    "div(u)*div(v)*dx",
    "0.2*dot(dot(grad(u), u), v)*dx",
    "0.1*inner(cofac(Identity(2) + grad(u)), grad(v))*dx",
    "0.1*det(Identity(2) + grad(u))*div(v)*dx",
    "0.1*inner(dev(grad(u)), grad(v))*dx",
    "0.1*curl(u)*curl(v)*dx",
    "0.1*inner(skew(grad(u)), grad(v))*dx",
    "dot(n, v)*ds",
    "0.2*inner(outer(b, u), grad(v))*dx",
    "0.1*tr(grad(u))*u[0]*v[1]*dx",
    "0.1*inner(inv(Identity(2) + 0.1*grad(u)).T, grad(v))*dx",
    "g*dot(b, v)*ds(top)",
    "0.1*dot(avg(u), avg(v))*dS",
    "0.1*dot(dot(K, u), v)*dx",
    "0.1*inner(grad(u).T, grad(v))*dx",
    "0.1*sqrt(1 + dot(u, u))*dot(b, v)*dx",
    "0.1*dot(u, n)*dot(v, n)*ds(left)",
    "0.1*max(dot(u, n), g)*dot(v, n)*ds(right)",
    "0.1*jump(u, n)*jump(v, n)*dS",
    "0.1*dot(grad(f), u)*v[0]*dx",
];

/// For vectors of Raviart and Thomas; those of Nédélec have a curl.
const WHOLE: &[&str] = &[
    "0.2*dot(dot(K, u), v)*dx",
    "0.1*g*dot(v, n)*ds(right)",
    "0.1*sqrt(1 + dot(u, u))*dot(b, v)*dx",
    "0.1*max(dot(u, n), g)*dot(v, n)*ds(right)",
    "0.1*dot(jump(u), jump(v))*dS",
    "0.1*inner(grad(u), grad(v))*dx",
    "0.1*dot(dot(grad(u), b), v)*dx",
    "0.1*u[0]*u[1]*dot(b, v)*dx",
    "0.1*h*div(u)*div(v)*dx",
    "0.1*exp(-dot(u, u))*div(u)*div(v)*dx",
    "0.1*avg(div(u))*avg(div(v))*dS",
];

/// A form that has one solution near 0, with some terms at random.
fn random_form(random: &mut Random, elements: &[&str], few: &[&str]) -> String {
    let element = random.of(elements);
    let is_whole = element == "RT0" || element == "N1curl";
    let is_vector = !is_whole && random.is(40);
    let is_broken = element.starts_with("DG") || element == "P0";
    let space = format!("{element}{}", if is_vector { "^2" } else { "" });
    let (mut terms, all, load) = match is_vector {
        _ if is_whole => (
            vec!["(1 + a^2)*div(u)*div(v)*dx + dot(u, v)*dx".to_owned()],
            WHOLE,
            "(0.3 + f)*dot(b, v)*dx",
        ),
        true => (
            vec!["inner((1 + a^2)*sym(grad(u)), sym(grad(v)))*dx + dot(u, v)*dx".to_owned()],
            VECTOR,
            "(0.3 + f)*dot(b, v)*dx",
        ),
        false => (
            vec!["(1 + a^2)*inner(grad(u), grad(v))*dx + u*v*dx".to_owned()],
            SCALAR,
            "(0.3 + f)*v*dx",
        ),
    };
    if is_broken {
        terms.push(match is_vector {
            true => "9/avg(h)*dot(jump(u), jump(v))*dS".to_owned(),
            false => "9/avg(h)*jump(u)*jump(v)*dS - inner(avg(grad(u)), jump(v, n))*dS - inner(jump(u, n), avg(grad(v)))*dS".to_owned(),
        });
    }
    for _ in 0..random.below(5) {
        terms.push(random.of(all).to_owned());
    }
    let mut s = format!("name = \"random\"\n[spaces]\nu = \"{space}\"\n[data]\n");
    for name in ["a", "g"] {
        s += &format!("{name} = \"{}\"\n", datum(random, 2));
    }
    let f = datum(random, 3);
    s += &match random.is(30) {
        true => format!(
            "f = {{ expr = \"{f}\", space = \"{}\" }}\n",
            random.of(&["P1", "P2"])
        ),
        false => format!("f = \"{f}\"\n"),
    };
    let [p, q] = [0; 2].map(|_| datum(random, 1));
    s += &format!("b = [\"{p}\", \"{q}\"]\nK = [[\"1\", \"{p}\"], [\"{q}\", \"2\"]]\n");
    let mut sum = terms.join("\n + ");
    if element == "N1curl" {
        sum = sum.replace("div(", "curl(");
    }
    s += &format!("[form]\nF = \"\"\"\n{sum}\n - {load}\n\"\"\"\n");
    // Fewer points do not determine these functions.
    let least = if few.contains(&element) { 4 } else { 2 };
    let degree = least + random.below(6 - least);
    let facet_degree = 3 + 2 * random.below(3);
    s += &format!("degree = {degree}\nfacet_degree = {facet_degree}\n");
    if !is_broken && random.is(60) {
        s += "[dirichlet]\n";
        for group in ["left", "top", "bottom"] {
            if random.is(50) {
                let [p, q] = [0; 2].map(|_| datum(random, 1));
                s += &match (is_vector || is_whole, random.is(50) && !is_whole) {
                    (false, _) => format!("{group} = \"{p}\"\n"),
                    (true, true) => format!("{group} = [\"{p}\", \"free\"]\n"),
                    (true, false) => format!("{group} = [\"0.1*({p})\", \"0.1*({q})\"]\n"),
                };
            }
        }
    }
    s
}

/// Random forms on a mesh, of these elements, a few of which need more points; `FACEOFF_SCENES` asks for more of them, and `FACEOFF_CODES` for some codes only.
fn agree_on_random(
    count: u64,
    [elements, few]: [&[&str]; 2],
    mesh: impl Fn() -> Mesh + std::panic::RefUnwindSafe,
) {
    let number = |name: &str, usual: u64| {
        std::env::var(name).map_or(usual, |text| text.parse().expect("an integer"))
    };
    let mut random = Random(number("FACEOFF_SEED", 2017));
    let faults: Vec<String> = (0..count * number("FACEOFF_SCENES", 1))
        .filter_map(|_| {
            let text = random_form(&mut random, elements, few);
            let ran = std::panic::catch_unwind(|| agree_on(&text, &mesh()));
            ran.err().map(|_| text)
        })
        .collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn random_forms() {
    let elements = [
        "P1", "P1", "P2", "P2", "CR", "DG1", "P3", "DG2", "P0", "RT0", "N1curl",
    ];
    agree_on_random(3, [&elements, &["P3"]], square);
}

#[test]
fn random_forms_on_quadrangles() {
    let elements = ["P1", "P2", "P2", "DG1", "DG2", "P0"];
    agree_on_random(2, [&elements, &["P2", "DG2"]], || lattice(2, 4));
}
