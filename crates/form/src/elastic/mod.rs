//! Scenes of contact in linear elasticity. By a method of the family (2.4), with σₙ for ∂ₙ, each is a weak form, in the text of a form file:
//!
//! ```text
//! Σ_K (σ(u), ε(v))_K + Σ_F β 2μ/h_F <[u], [v]>_F - <σₙ(u), vₙ>_C + <max(uₙ - ψ, γσₙ(u)), θ₁σₙ(v) + θ₂γ⁻¹vₙ>_C = (f, v) + <t, v>_N
//! ```
//!
//! The sum over inner facets F is that of Hansbo and Larson (2003); continuous elements have no jumps. θ = (1, 0) is penalty-free, θ₂ = 1 the method of
//! Chouly, Hild and Renard (2015), whose own θ is -θ₁.

mod lines;
mod read;
#[cfg(test)]
mod tests;

use std::path::Path;

use faceoff_fem::contact::{Law, Method};
use faceoff_mesh::error::{Error, Place, Result};

pub use lines::Lines;
use read::{Read, Scene};

/// γ₀ where there is no penalty: of second order in L² needs it large.
const GAMMA0: f64 = 100.0;
/// γ₀ where θ₂ > 0: the penalty is γ⁻¹.
const GAMMA0_OF_PENALTY: f64 = 0.1;
/// What rounding leaves of P, relative to its terms.
const UNTOLD: f64 = 1e-9;
/// β.
const BETA: f64 = 10.0;

/// Built-in scenes by name, each in `builtin/NAME.toml`.
const BUILTIN: [(&str, &str); 5] = [
    (
        "elastic-transition",
        include_str!("builtin/elastic-transition.toml"),
    ),
    ("contact-patch", include_str!("builtin/contact-patch.toml")),
    (
        "friction-patch",
        include_str!("builtin/friction-patch.toml"),
    ),
    ("hertz-line", include_str!("builtin/hertz-line.toml")),
    (
        "hertz-sphere-elastic",
        include_str!("builtin/hertz-sphere-elastic.toml"),
    ),
];

/// Meshes that built-in scenes name.
const MESHES: [(&str, &[u8]); 2] = [
    (
        "hertz.msh",
        include_bytes!("../../../../examples/hertz/hertz.msh"),
    ),
    (
        "ball.msh",
        include_bytes!("../../../../examples/hertz/ball.msh"),
    ),
];

/// A scene as a weak form.
#[derive(Debug, Clone)]
pub struct Lowered {
    /// That of a form file.
    pub text: Lines,
    /// Where contact is possible and where the traction is given.
    pub parts: Parts,
    /// The formula of the friction that is given, Coulomb's or Tresca's.
    pub friction: Option<String>,
}

/// Parts of the boundary, and what else a script that is not made from the form has to know.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parts {
    /// Γ_C, by the names of groups.
    pub contact: Vec<String>,
    /// Γ_N.
    pub neumann: Vec<String>,
    /// Does plane stress hold instead of plane strain?
    pub is_stress: bool,
}

/// Is this the text of a scene of elasticity?
pub fn is_elastic(text: &str) -> bool {
    toml::de::DeTable::parse(text).is_ok_and(|table| table.get_ref().contains_key("elastic"))
}

/// The text of a built-in scene.
pub fn builtin(name: &str) -> Option<&'static str> {
    let found = BUILTIN.iter().find(|(known, _)| *known == name);
    found.map(|(_, text)| *text)
}

/// The names of the built-in scenes, each with what it is.
pub fn catalogue() -> impl Iterator<Item = (&'static str, &'static str)> {
    BUILTIN.iter().map(|(name, text)| {
        let line = text
            .lines()
            .find_map(|line| line.strip_prefix("about = \""));
        (*name, line.map_or("", |line| line.trim_end_matches('"')))
    })
}

/// A mesh that a built-in scene names.
pub fn mesh(name: &str) -> Option<&'static [u8]> {
    let found = MESHES.iter().find(|(known, _)| *known == name);
    found.map(|(_, bytes)| *bytes)
}

/// Is there this method for elasticity?
pub fn has(method: &Method) -> bool {
    matches!(method.law, Law::Nitsche(law) if law.theta2 >= 0.0)
}

/// The weak form that a scene is by a method, to be solved by these codes; `origin` is what messages call the scene.
///
/// # Errors
/// What is not TOML or not a scene, with its line; a method that is none of the family.
pub fn lower(origin: &Path, text: &str, method: &Method, codes: &[&str]) -> Result<Lowered> {
    let Law::Nitsche(law) = method.law else {
        let what = format!("{method} is no method for elasticity");
        let remedy = "take cr, p1, p2, or a member of the family (2.4) as in \"p2(-1,1)\"";
        return Err(Error::usage(what, remedy));
    };
    let [theta1, theta2] = [law.theta1, law.theta2];
    if theta2 < 0.0 {
        let what = format!("{method} rewards what contact forbids");
        return Err(Error::usage(what, "take a second parameter of 0 or more"));
    }
    let document = toml::de::DeTable::parse(text).map_err(|e| {
        let at = e.span().map_or(0, |span| span.start);
        let line = text[..at.min(text.len())].matches('\n').count() + 1;
        let what = e.message().replace('\n', " ");
        Error::file(origin, Place::Line(line), what, "write TOML")
    })?;
    let read = Read { origin, text };
    let scene = read.scene(document.get_ref())?;
    let element = method.element.name();
    let is_broken = !method.element.on().vertices;
    let mut lines = Lines::default();
    let head = scene.name.1;
    lines.make(
        head,
        &format!("name = \"{}\"", file_name(&scene.name.0, method)),
    );
    if let Some(about) = scene.top.get("about") {
        lines.copy(about.line, about.text);
    }
    scene.mesh.put(&mut lines);
    lines.make(head, &format!("[spaces]\nu = \"{element}^{}\"", scene.dim));

    lines.make(scene.elastic.line, "[parameters]");
    for key in ["E", "nu"] {
        let entry = scene.elastic.need(&read, key)?;
        lines.copy(entry.line, entry.text);
    }
    let of_method = |key: &str, usual: f64| -> Result<String> {
        let given = scene.method.as_ref().and_then(|table| table.get(key));
        given.map_or(Ok(format!("{key} = {usual:?}")), |entry| {
            Ok(entry.text.to_owned())
        })
    };
    let gamma0 = match theta2 > 0.0 {
        true => GAMMA0_OF_PENALTY,
        false => GAMMA0,
    };
    let at = scene.method.as_ref().map_or(head, |table| table.line);
    lines.make(at, &of_method("gamma0", gamma0)?);
    if is_broken {
        lines.make(at, &of_method("beta", BETA)?);
    }
    lines.make(at, &format!("theta1 = {theta1:?}\ntheta2 = {theta2:?}"));
    if let Some(parameters) = &scene.parameters {
        parameters.put_entries(&mut lines);
    }

    let lam = match scene.is_stress {
        true => "E*nu/(1 - nu^2)",
        false => "E*nu/((1 + nu)*(1 - 2*nu))",
    };
    lines.make(
        scene.elastic.line,
        &format!("[definitions]\nmu = \"E/(2*(1 + nu))\"\nlam = \"{lam}\""),
    );
    if let Some(definitions) = &scene.definitions {
        definitions.put_entries(&mut lines);
    }
    let along = scene.data.get("along").map_or("n", |_| "along");
    lines.make(
        head,
        &format!(
            "\"sigma(w)\" = \"2*mu*sym(grad(w)) + lam*div(w)*Identity({})\"\n\
             \"sigma_n(w)\" = \"dot({along}, dot(sigma(w), n))\"\n\
             \"w_n(w)\" = \"dot(w, {along})\"\n\
             gamma = \"gamma0*h/(2*mu + lam)\"\n\
             reaction = \"{}\"",
            scene.dim,
            reaction(theta2)
        ),
    );
    // The radius of the ball in which γσ_t lies: γs, or the coefficient times [-P]₊, which is γ times the pressure where the body is in contact.
    let radius = match (scene.data.get("friction"), scene.data.get("coulomb")) {
        (Some(_), _) => Some("gamma*friction"),
        (_, Some(_)) => Some("coulomb*max(w_n(u) - psi - gamma*sigma_n(u), 0)"),
        (None, None) => None,
    };
    if scene.dim == 2 {
        let shear = format!(
            "\"sigma_t(w)\" = \"dot(sigma(w), n)[0]*{along}[1] - dot(sigma(w), n)[1]*{along}[0]\""
        );
        lines.make(head, &shear);
    }
    if let Some(radius) = radius {
        lines.make(
            head,
            &format!(
                "\"w_t(w)\" = \"w[0]*n[1] - w[1]*n[0]\"\n\
             P_t = \"gamma*sigma_t(u) - w_t(u)\"\n\
             radius = \"{radius}\""
            ),
        );
    }
    lines.make(scene.data.line, "[data]");
    for entry in scene.data.entries.iter().filter(|entry| entry.key != "g") {
        lines.copy(entry.line, entry.text);
    }
    if scene.data.get("psi").is_none() {
        lines.make(scene.data.line, "psi = 0");
    }

    let over = |groups: &[String]| format!("ds([{}])", groups.join(", "));
    let contact = over(&scene.contact);
    // The test functions of the law, in units of stress and of displacement.
    let tested = |stress: &str, displacement: &str| {
        let mut terms = Vec::new();
        if theta1 != 0.0 || theta2 == 0.0 {
            terms.push(format!("theta1*{stress}(v)"));
        }
        if theta2 != 0.0 {
            terms.push(format!("theta2*{displacement}(v)/gamma"));
        }
        terms.join(" + ")
    };
    let mut terms = vec!["inner(sigma(u), sym(grad(v)))*dx".to_owned()];
    if is_broken {
        terms.push("2*mu*beta/facet_length*dot(jump(u), jump(v))*dS".into());
    }
    if scene.data.get("f").is_some() {
        terms.push("(-dot(f, v))*dx".into());
    }
    if !scene.neumann.is_empty() {
        terms.push(format!("(-dot(t, v))*{}", over(&scene.neumann)));
    }
    terms.push(format!("(-sigma_n(u)*w_n(v))*{contact}"));
    let law = tested("sigma_n", "w_n");
    terms.push(format!(
        "max(w_n(u) - psi, gamma*sigma_n(u))*({law})*{contact}"
    ));
    if radius.is_some() {
        let law = tested("sigma_t", "w_t");
        terms.push(format!("(-sigma_t(u)*w_t(v))*{contact}"));
        terms.push(format!(
            "(gamma*sigma_t(u) - max(-radius, min(P_t, radius)))*({law})*{contact}"
        ));
    }
    let rules = ["degree", "facet_degree"].map(|key| {
        let given = scene.method.as_ref().and_then(|table| table.get(key));
        given.map_or(String::new(), |entry| format!("\n{}", entry.text))
    });
    let form = format!("[form]\nF = \"{}\"{}", terms.join(" + "), rules.concat());
    lines.make(head, &form);

    lines.make(scene.boundary.line, "[dirichlet]");
    for group in &scene.dirichlet {
        let g = scene.data.need(&read, "g")?;
        let g = g.part(group).unwrap_or(g);
        lines.make(g.line, &format!("{} = {}", quoted(group), g.value));
    }
    let names: Vec<String> = codes.iter().map(|code| quoted(code)).collect();
    lines.make(head, &format!("[codes]\nuse = [{}]", names.join(", ")));
    lines.make(head, "[fields.u]\nrtol = 1e-11");
    if let Some(exact) = &scene.exact {
        let u = exact.need(&read, "u")?;
        lines.make(u.line, &format!("exact = {}", u.value));
        let degree = method.element.degree();
        match exact.get("orders") {
            Some(orders) => lines.copy(orders.line, orders.text),
            None => lines.make(
                u.line,
                &format!("orders = {{ l2 = {}, h1 = {degree} }}", degree + 1),
            ),
        }
    }
    for (name, components) in on_contact(&scene, along, radius.is_some()) {
        let components = components
            .iter()
            .map(|of| quoted(&format!("({of})*{contact}")));
        let value = components.collect::<Vec<_>>().join(", ");
        let field = format!("[fields.{name}]\nvalue = [{value}]\nrtol = 1e-11");
        lines.make(head, &field);
    }
    let status = "conditional(gamma*sigma_n(u) - (w_n(u) - psi) <= 0, 1, 0)";
    let mut numbers = vec![
        ("contact", format!("{status}*{contact}")),
        ("force", format!("reaction*{contact}")),
        ("pressure", format!("sigma_n(u)^2*{contact}")),
    ];
    if radius.is_some() {
        numbers.push((
            "stick",
            format!("conditional(abs(P_t) < radius, 1, 0)*{contact}"),
        ));
        numbers.push(("shear", format!("sigma_t(u)^2*{contact}")));
    }
    for (name, value) in numbers {
        if !scene.numbers.iter().any(|table| table.name == name) {
            lines.make(
                head,
                &format!("[numbers.{name}]\nvalue = \"{value}\"\nrtol = 1e-9"),
            );
        }
    }
    for table in &scene.numbers {
        table.put(&mut lines);
    }
    let friction = scene.data.get("friction").or(scene.data.get("coulomb"));
    let friction = friction.map(|entry| entry.value.trim_matches(['"', '\'']).to_owned());
    Ok(Lowered {
        friction,
        text: lines,
        parts: Parts {
            contact: scene.contact,
            neumann: scene.neumann,
            is_stress: scene.is_stress,
        },
    })
}

/// What the rigid body exerts, against the direction of the gap. The test function v = e, of which σ(v) = 0, shows that its integral balances the loads exactly:
/// with a penalty that of -σₙ does not.
fn reaction(theta2: f64) -> &'static str {
    match theta2 > 0.0 {
        true => "theta2*max(w_n(u) - psi, gamma*sigma_n(u))/gamma - sigma_n(u)",
        false => "-sigma_n(u)",
    }
}

/// What is compared on each facet of Γ_C: σₙ and σ_t, then the part of it that is in contact, and with friction the part that sticks. A point whose status
/// rounding decides counts half.
fn on_contact(scene: &Scene, along: &str, has_friction: bool) -> [(&'static str, Vec<String>); 2] {
    let mut stress = vec!["sigma_n(u)".to_owned()];
    match scene.dim {
        2 => stress.push("sigma_t(u)".into()),
        dim => {
            let part = |k| format!("dot(sigma(u), n)[{k}] - sigma_n(u)*{along}[{k}]");
            stress.extend((0..dim).map(part));
        }
    }
    let share = |of: &str| {
        let terms = "gamma0*h*sqrt(inner(grad(u), grad(u))) + abs(w_n(u)) + abs(psi)";
        format!("conditional(abs({of}) <= {UNTOLD:?}*({terms}), 1/2, conditional({of} < 0, 1, 0))")
    };
    let mut status = vec![share("(gamma*sigma_n(u) - (w_n(u) - psi))")];
    if has_friction {
        status.push(share("(abs(P_t) - radius)"));
    }
    [("stress", stress), ("status", status)]
}

/// A text of TOML.
fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// The name of a scene with that of a method: parts of names of files.
fn file_name(scene: &str, method: &Method) -> String {
    let is_usual = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    let name = format!("{scene}-{method}").replace([',', '('], "_");
    name.chars().filter(|c| is_usual(*c)).collect()
}
