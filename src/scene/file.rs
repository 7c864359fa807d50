//! The TOML form of a scene.

use std::path::Path;

use serde::Deserialize;

use super::boundary::{Boundary, GroupName};
use super::{Data, EMBEDDED, Expression, HRule, MeshSource, Scene};
use crate::error::{Error, Result};
use crate::quadrature;

/// The paper asks for γ₀ "large enough"; with f ≠ 0 the error of its law grows as 1/γ₀.
const GAMMA0: f64 = 100.0;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneFile {
    name: String,
    mesh: MeshFile,
    #[serde(default)]
    boundary: BoundaryFile,
    #[serde(default)]
    data: DataFile,
    #[serde(default)]
    method: MethodFile,
    #[serde(default)]
    cross: CrossFile,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MeshFile {
    generator: Option<String>,
    file: Option<String>,
    n: Option<usize>,
    size: Option<[f64; 2]>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct BoundaryFile {
    #[serde(default)]
    dirichlet: Vec<GroupName>,
    #[serde(default)]
    neumann: Vec<GroupName>,
    #[serde(default)]
    contact: Vec<GroupName>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct DataFile {
    f: Option<Formula>,
    g: Option<Formula>,
    t: Option<Formula>,
    psi: Option<Formula>,
}

/// A formula as text, or a plain number.
#[derive(Deserialize)]
#[serde(untagged)]
enum Formula {
    Number(f64),
    Text(String),
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct MethodFile {
    gamma0: Option<f64>,
    h: Option<String>,
    load_quadrature: Option<String>,
    contact_quadrature: Option<String>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct CrossFile {
    order: Option<f64>,
}

/// Parses a scene; `folder` is where its relative paths start, none for built-in scenes.
pub(super) fn parse(origin: &str, text: &str, folder: Option<&Path>) -> Result<Scene> {
    let refuse = |place: &str, what: String, remedy: &str| Error::Scene {
        scene: origin.to_owned(),
        place: place.to_owned(),
        what,
        remedy: remedy.to_owned(),
    };
    let file: SceneFile = toml::from_str(text).map_err(|e| {
        let line = e
            .span()
            .map_or(1, |span| 1 + text[..span.start].matches('\n').count());
        refuse(
            &format!("line {line}"),
            e.message().replace('\n', " "),
            "the README lists the keys of a scene",
        )
    })?;
    if file.name.is_empty()
        || !file
            .name
            .chars()
            .all(|c| c.is_alphanumeric() || "-_.".contains(c))
        || file.name.starts_with('.')
    {
        return Err(refuse(
            "name",
            format!("`{}` cannot name output files", file.name),
            "use letters, digits, `-`, `_` and `.`",
        ));
    }

    let formula = |key: &str, given: Option<Formula>| -> Result<Expression> {
        match given {
            None => Ok(Expression::constant(0.0)),
            Some(Formula::Number(value)) if value.is_finite() => Ok(Expression::constant(value)),
            Some(Formula::Number(value)) => Err(refuse(
                &format!("data.{key}"),
                format!("{value} is not finite"),
                "give a finite number",
            )),
            Some(Formula::Text(text)) => Expression::parse(&text).map_err(|e| {
                refuse(
                    &format!("data.{key}, character {}", e.column),
                    format!("{} in `{text}`", e.what),
                    "the README lists what an expression may hold",
                )
            }),
        }
    };
    let data = Data {
        f: formula("f", file.data.f)?,
        g: formula("g", file.data.g)?,
        t: formula("t", file.data.t)?,
        psi: formula("psi", file.data.psi)?,
    };

    if file.mesh.n == Some(0) {
        return Err(refuse(
            "mesh.n",
            "a mesh of 0 squares has no cells".into(),
            "give n of at least 1",
        ));
    }
    let mesh = match (&file.mesh.generator, &file.mesh.file) {
        (Some(generator), None) if generator == "union-jack" => {
            let size = file.mesh.size.unwrap_or([1.0, 1.0]);
            if !size.iter().all(|s| *s > 0.0 && s.is_finite()) {
                return Err(refuse(
                    "mesh.size",
                    format!("{size:?} is no size of a rectangle"),
                    "give two positive lengths",
                ));
            }
            MeshSource::UnionJack {
                n: file.mesh.n.unwrap_or(16),
                size,
            }
        }
        (Some(generator), None) => {
            return Err(refuse(
                "mesh.generator",
                format!("`{generator}` is not known"),
                "use \"union-jack\", or `file = …`",
            ));
        }
        (None, Some(name)) => {
            if file.mesh.size.is_some() {
                return Err(refuse(
                    "mesh.size",
                    "a mesh file has its own size".into(),
                    "remove the key",
                ));
            }
            match folder {
                Some(folder) => MeshSource::File {
                    path: folder.join(name),
                    n: file.mesh.n,
                },
                None => EMBEDDED
                    .iter()
                    .find(|(embedded, _)| embedded == name)
                    .map(|&(name, bytes)| MeshSource::Embedded {
                        name,
                        bytes,
                        n: file.mesh.n,
                    })
                    .ok_or_else(|| {
                        refuse(
                            "mesh.file",
                            format!("`{name}` is not among the meshes the program carries"),
                            "report this: a built-in scene is at fault",
                        )
                    })?,
            }
        }
        _ => {
            return Err(refuse(
                "mesh",
                "it needs exactly one of `generator` and `file`".into(),
                "give one of them",
            ));
        }
    };

    let gamma0 = file.method.gamma0.unwrap_or(GAMMA0);
    if !(gamma0 > 0.0 && gamma0.is_finite()) {
        return Err(refuse(
            "method.gamma0",
            format!("{gamma0} is not positive"),
            "the method needs gamma0 > 0 (default: 100)",
        ));
    }
    let h = match file.method.h.as_deref() {
        None | Some("local") => HRule::Local,
        Some("global") => HRule::Global,
        Some(other) => {
            return Err(refuse(
                "method.h",
                format!("`{other}` is not known"),
                "use \"local\" or \"global\"",
            ));
        }
    };
    let rule = |key: &str, given: Option<String>, known: &[&str]| -> Result<String> {
        let name = given.unwrap_or_else(|| known[0].to_owned());
        if known.contains(&name.as_str()) {
            return Ok(name);
        }
        Err(refuse(
            &format!("method.{key}"),
            format!("the rule `{name}` is not known"),
            &format!("use one of {}", known.join(", ")),
        ))
    };
    if let Some(order) = file.cross.order
        && !(order > 0.0 && order.is_finite())
    {
        return Err(refuse(
            "cross.order",
            format!("{order} is no order of convergence"),
            "give a positive number",
        ));
    }
    Ok(Scene {
        name: file.name,
        mesh,
        boundary: Boundary {
            dirichlet: file.boundary.dirichlet,
            neumann: file.boundary.neumann,
            contact: file.boundary.contact,
        },
        data,
        gamma0,
        h,
        load_quadrature: rule(
            "load_quadrature",
            file.method.load_quadrature,
            &quadrature::CELL_RULES,
        )?,
        contact_quadrature: rule(
            "contact_quadrature",
            file.method.contact_quadrature,
            &quadrature::FACE_RULES,
        )?,
        cross_order: file.cross.order,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = r#"
name = "s"
[mesh]
generator = "union-jack"
n = 4
[boundary]
dirichlet = ["top", 2]
contact = ["bottom"]
[data]
f = "x"
"#;

    fn refusal(text: &str) -> String {
        parse("s.toml", text, Some(Path::new("folder")))
            .unwrap_err()
            .to_string()
    }

    #[test]
    fn every_builtin_is_valid() {
        for name in Scene::builtin_names() {
            assert_eq!(Scene::find(name).unwrap().name, name);
        }
    }

    #[test]
    fn faults_are_named_with_their_place() {
        assert!(parse("s.toml", GOOD, None).is_ok());
        let with = |line: &str| refusal(&format!("{GOOD}{line}\n"));
        assert!(with("q = 1").contains("line 11: unknown field `q`"));
        assert!(with("g = \"1); exec(1)\"").contains("data.g, character 2"));
        assert!(with("g = nan").contains("data.g"));
        assert!(with("[method]\ngamma0 = -1").contains("gamma0"));
        assert!(with("[method]\ngamma0 = nan").contains("gamma0"));
        assert!(with("[method]\nh = \"tiny\"").contains("method.h"));
        assert!(with("[method]\ncontact_quadrature = \"q\"").contains("gauss-5"));
        assert!(refusal(&GOOD.replace("union-jack", "cross")).contains("mesh.generator"));
        assert!(refusal(&GOOD.replace("n = 4", "file = \"m.msh\"")).contains("exactly one"));
        assert!(refusal(&GOOD.replace("n = 4", "n = 0")).contains("mesh.n"));
        assert!(refusal(&GOOD.replace("n = 4", "n = -4")).contains("line 5"));
        assert!(refusal(&GOOD.replace("\"s\"", "\"../s\"")).contains("name"));
    }
}
