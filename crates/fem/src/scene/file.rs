//! The TOML form of a scene.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

use super::boundary::Boundary;
use super::{
    Bounds, Comparing, Data, EMBEDDED, Exact, Expression, HRule, MeshSource, Scene, check_name,
    exact,
};
use crate::quadrature;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::file::beneath;
use faceoff_mesh::mesh::generate::{Cuboid, sides};

/// The paper asks for γ₀ "large enough"; with f ≠ 0 the error of its law grows as 1/γ₀.
pub(super) const GAMMA0: f64 = 100.0;

/// The refinement of a 2D scene that names none, and of a 3D one.
pub(super) const N: usize = 16;
pub(super) const N_SOLID: usize = 8;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneFile {
    name: String,
    mesh: MeshFile,
    #[serde(default)]
    boundary: Boundary,
    #[serde(default)]
    data: DataFile,
    #[serde(default)]
    method: MethodFile,
    #[serde(default)]
    exact: ExactFile,
    compare: Option<CompareFile>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MeshFile {
    generator: Option<String>,
    file: Option<String>,
    n: Option<usize>,
    origin: Option<Vec<f64>>,
    size: Option<Vec<f64>>,
    /// Side and the coordinate along it at which its group ends and another begins.
    #[serde(default)]
    split: BTreeMap<String, f64>,
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
struct ExactFile {
    u: Option<Formula>,
    /// The name of a problem whose solution is known.
    reference: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CompareFile {
    rtol: Option<f64>,
    atol: Option<f64>,
    #[serde(default)]
    fields: BTreeMap<String, Bounds>,
}

/// Parses a scene; `folder` is where its relative paths start, none for built-in scenes. Only with `anywhere` may they
/// lead out of it.
pub(super) fn parse(
    origin: &str,
    text: &str,
    folder: Option<&Path>,
    anywhere: bool,
) -> Result<Scene> {
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
            "docs/reference/scenes.md lists the keys of a scene",
        )
    })?;
    check_name(&file.name, origin)?;

    let formula = |key: &str, given: Formula| -> Result<Expression> {
        match given {
            Formula::Number(value) if value.is_finite() => Ok(Expression::constant(value)),
            Formula::Number(value) => Err(refuse(
                key,
                format!("{value} is not finite"),
                "give a finite number",
            )),
            Formula::Text(text) => Expression::parse(&text).map_err(|e| {
                refuse(
                    &format!("{key}, character {}", e.column),
                    format!("{} in `{text}`", e.what),
                    "docs/reference/scenes.md lists what an expression may hold",
                )
            }),
        }
    };
    let or_zero = |key: &str, given: Option<Formula>| -> Result<Expression> {
        formula(key, given.unwrap_or(Formula::Number(0.0)))
    };
    let data = Data {
        f: or_zero("data.f", file.data.f)?,
        g: or_zero("data.g", file.data.g)?,
        t: or_zero("data.t", file.data.t)?,
        psi: or_zero("data.psi", file.data.psi)?,
    };
    let exact = match (file.exact.u, &file.exact.reference) {
        (None, None) => None,
        (Some(u), None) => Some(Exact::Formula(formula("exact.u", u)?)),
        (None, Some(name)) => Some(reference(name, &data, &refuse)?),
        (Some(_), Some(_)) => {
            return Err(refuse(
                "exact",
                "it has both `u` and `reference`".into(),
                "give one of them",
            ));
        }
    };

    if file.mesh.n == Some(0) {
        return Err(refuse(
            "mesh.n",
            "a mesh of 0 squares has no cells".into(),
            "give n of at least 1",
        ));
    }
    let mesh = match (&file.mesh.generator, &file.mesh.file) {
        (Some(generator), None) => {
            let cuboid = match generator.as_str() {
                "union-jack" => cuboid::<2>(&file.mesh, &refuse)?,
                "union-cube" => cuboid::<3>(&file.mesh, &refuse)?,
                _ => {
                    return Err(refuse(
                        "mesh.generator",
                        format!("`{generator}` is not known"),
                        "use \"union-jack\" for a rectangle, \"union-cube\" for a box, or `file = …`",
                    ));
                }
            };
            MeshSource::Union {
                n: file
                    .mesh
                    .n
                    .unwrap_or(if cuboid.dim == 2 { N } else { N_SOLID }),
                cuboid,
            }
        }
        (None, Some(name)) => {
            let given = [
                ("mesh.size", file.mesh.size.is_some()),
                ("mesh.origin", file.mesh.origin.is_some()),
                ("mesh.split", !file.mesh.split.is_empty()),
            ];
            if let Some((key, _)) = given.iter().find(|(_, given)| *given) {
                return Err(refuse(
                    key,
                    "a mesh file has its own geometry and groups".into(),
                    "remove the key",
                ));
            }
            match folder {
                Some(folder) if !anywhere && beneath(folder, name).is_none() => {
                    return Err(refuse(
                        "mesh.file",
                        format!("`{name}` is outside the scene's folder"),
                        "put the mesh next to the scene, or give --allow-outside if you trust the scene",
                    ));
                }
                Some(folder) => MeshSource::File {
                    path: folder.join(name),
                    n: file.mesh.n,
                    dim: None,
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
    // Whether a rule is of the mesh's dimension is seen when the mesh is.
    let dim = match &mesh {
        MeshSource::Union { cuboid, .. } => Some(cuboid.dim),
        _ => None,
    };
    let rule = |key: &str, given: Option<String>, below: usize| -> Result<Option<String>> {
        let dims = dim.map_or(2..=3, |dim| dim..=dim);
        let known: Vec<&str> = dims
            .flat_map(|dim| quadrature::names(dim - below))
            .copied()
            .collect();
        match given {
            Some(name) if !known.contains(&name.as_str()) => Err(refuse(
                &format!("method.{key}"),
                format!("the rule `{name}` is not known"),
                &format!("use one of {}", known.join(", ")),
            )),
            given => Ok(given),
        }
    };
    let compare = file
        .compare
        .map(|given| bounds(given, &refuse))
        .transpose()?;
    Ok(Scene {
        name: file.name,
        source: mesh,
        boundary: file.boundary,
        data,
        gamma0,
        h,
        load_quadrature: rule("load_quadrature", file.method.load_quadrature, 0)?,
        contact_quadrature: rule("contact_quadrature", file.method.contact_quadrature, 1)?,
        exact,
        compare,
    })
}

/// The known solution with this name, for a scene with the data of that problem.
fn reference(
    name: &str,
    data: &Data,
    refuse: &impl Fn(&str, String, &str) -> Error,
) -> Result<Exact> {
    let place = "exact.reference";
    let known = exact::reference(name).ok_or_else(|| {
        refuse(
            place,
            format!("there is no solution `{name}`"),
            "use \"one-zone\", or the name of a built-in scene with an exact solution",
        )
    })?;
    let (exact, of) = known?;
    let pairs = [
        ("f", &data.f, &of.f),
        ("g", &data.g, &of.g),
        ("t", &data.t, &of.t),
        ("psi", &data.psi, &of.psi),
    ];
    match pairs.into_iter().find(|(_, a, b)| !are_alike(a, b)) {
        Some((key, ..)) => Err(refuse(
            place,
            format!("{key} is not that of `{name}`, and so the solution is another"),
            "give the same data, or remove the key",
        )),
        None => Ok(exact),
    }
}

/// Whether they are the same function, as far as values at scattered points show.
pub(super) fn are_alike(a: &Expression, b: &Expression) -> bool {
    (1..=64).map(f64::from).all(|k| {
        let p = [0.819_172_513_396, 0.671_043_606_704, 0.549_700_477_902].map(|g| (k * g).fract());
        let (a, b) = (a.value(p), b.value(p));
        (a - b).abs() <= 1e-9 * (1.0 + b.abs())
    })
}

/// The tolerances of `compare`.
fn bounds(given: CompareFile, refuse: &impl Fn(&str, String, &str) -> Error) -> Result<Comparing> {
    let checked = |place: &str, bounds: Bounds| {
        for (key, value) in [("rtol", bounds.rtol), ("atol", bounds.atol)] {
            if let Some(value) = value.filter(|v| !(*v >= 0.0 && v.is_finite())) {
                return Err(refuse(
                    &format!("{place}.{key}"),
                    format!("{value} is not a tolerance"),
                    "give a finite number of at least 0",
                ));
            }
        }
        Ok(bounds)
    };
    let of_field = given.fields.into_iter().map(|(name, of)| {
        let bounds = checked(&format!("compare.fields.{name}"), of)?;
        Ok((name, bounds))
    });
    let (rtol, atol) = (given.rtol, given.atol);
    Ok(Comparing {
        of_all: checked("compare", Bounds { rtol, atol })?,
        of_field: of_field.collect::<Result<_>>()?,
    })
}

/// The rectangle (D = 2) or box (D = 3) of a generator.
fn cuboid<const D: usize>(
    given: &MeshFile,
    refuse: &impl Fn(&str, String, &str) -> Error,
) -> Result<Cuboid> {
    let lengths = |key: &str, value: &Option<Vec<f64>>, default: f64| -> Result<[f64; D]> {
        let Some(value) = value else {
            return Ok([default; D]);
        };
        let exact = <[f64; D]>::try_from(value.as_slice()).ok();
        exact
            .filter(|v| v.iter().all(|x| x.is_finite()))
            .ok_or_else(|| {
                refuse(
                    key,
                    format!("{value:?} is not {D} finite numbers"),
                    "give one number a dimension: two for union-jack, three for union-cube",
                )
            })
    };
    let size = lengths("mesh.size", &given.size, 1.0)?;
    if !size.iter().all(|s| *s > 0.0) {
        return Err(refuse(
            "mesh.size",
            format!("{size:?} has a length that is not positive"),
            "give positive lengths",
        ));
    }
    let origin = lengths("mesh.origin", &given.origin, 0.0)?;
    let mut cuboid = Cuboid::new(origin, size);
    for (side, at) in &given.split {
        let place = format!("mesh.split.{side}");
        if D != 2 {
            return Err(refuse(
                &place,
                "only the sides of a rectangle are split".into(),
                "give a mesh file with groups as you need them",
            ));
        }
        let Some(k) = sides(D).iter().position(|name| name == side) else {
            return Err(refuse(
                &place,
                "a rectangle has no such side".into(),
                "use bottom, right, top or left",
            ));
        };
        let (low, length) = (origin[k % 2], size[k % 2]);
        if !(*at > low && *at < low + length) {
            return Err(refuse(
                &place,
                format!("{at} does not lie inside the side"),
                &format!("give a coordinate between {low} and {}", low + length),
            ));
        }
        cuboid.splits[k] = Some(*at);
    }
    Ok(cuboid)
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
        parse("s.toml", text, Some(Path::new("folder")), false)
            .unwrap_err()
            .to_string()
    }

    #[test]
    fn every_builtin_is_valid() {
        for name in Scene::builtin_names().chain(Scene::further_names()) {
            assert_eq!(Scene::find(name).unwrap().name(), name);
        }
    }

    #[test]
    fn faults_are_named_with_their_place() {
        assert!(parse("s.toml", GOOD, None, false).is_ok());
        let with = |line: &str| refusal(&format!("{GOOD}{line}\n"));
        assert!(with("q = 1").contains("line 11: unknown field `q`"));
        assert!(with("g = \"1); exec(1)\"").contains("data.g, character 2"));
        assert!(with("g = nan").contains("data.g"));
        assert!(with("[method]\ngamma0 = -1").contains("gamma0"));
        assert!(with("[method]\ngamma0 = nan").contains("gamma0"));
        assert!(with("[method]\nh = \"tiny\"").contains("method.h"));
        assert!(with("[method]\ncontact_quadrature = \"q\"").contains("gauss-5"));
        assert!(refusal(&GOOD.replace("union-jack", "cross")).contains("mesh.generator"));
        assert!(with("[exact]\nu = \"sin(\"").contains("exact.u, character 5"));
        let both = "[exact]\nu = \"x\"\nreference = \"one-zone\"";
        assert!(with(both).contains("both `u` and `reference`"));
        assert!(with("[exact]\nreference = \"two-zones\"").contains("no solution `two-zones`"));
        let other = with("[exact]\nreference = \"one-zone\"");
        assert!(other.contains("f is not that of `one-zone`"), "{other}");
        let negative = with("[compare.fields.u]\nrtol = -1");
        assert!(negative.contains("compare.fields.u.rtol: -1 is not a tolerance"));
        assert!(with("[compare]\natol = inf").contains("compare.atol"));
        assert!(with("[compare]\nu = 1").contains("unknown field `u`"));
        assert!(with("[method]\nload_quadrature = \"hammer-4\"").contains("radon-7"));
        let mesh = |line: &str| refusal(&GOOD.replace("n = 4", line));
        let in_3d = |line: &str| {
            refusal(
                &GOOD
                    .replace("union-jack", "union-cube")
                    .replace("n = 4", line),
            )
        };
        assert!(in_3d("size = [1, 1]").contains("is not 3 finite numbers"));
        assert!(in_3d("size = [1, 0, 1]").contains("not positive"));
        assert!(in_3d("split = { top = 0.5 }").contains("only the sides of a rectangle"));
        assert!(mesh("size = [1, 1, 1]").contains("is not 2 finite numbers"));
        assert!(mesh("origin = [0, inf]").contains("mesh.origin"));
        assert!(mesh("split = { lid = 0.5 }").contains("no such side"));
        assert!(mesh("split = { left = 1 }").contains("between 0 and 1"));
        assert!(refusal(&GOOD.replace("n = 4", "file = \"m.msh\"")).contains("exactly one"));
        assert!(refusal(&GOOD.replace("n = 4", "n = 0")).contains("mesh.n"));
        assert!(refusal(&GOOD.replace("n = 4", "n = -4")).contains("line 5"));
        assert!(refusal(&GOOD.replace("\"s\"", "\"../s\"")).contains("name"));
        let union = "generator = \"union-jack\"\nn = 4";
        for path in ["../m.msh", "/m.msh", "a/../../m.msh"] {
            let text = GOOD.replace(union, &format!("file = \"{path}\""));
            assert!(refusal(&text).contains("outside"), "{path}");
            assert!(parse("s.toml", &text, Some(Path::new("folder")), true).is_ok());
        }
    }
}
