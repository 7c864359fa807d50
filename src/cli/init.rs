//! `faceoff init`: a scene on the user's mesh, with its groups.

use std::path::Path;

use toml::Value;

use super::DONE;
use super::args::Init;
use super::new::{groups, own};
use crate::report::console::{note, tell};
use faceoff_fem::scene::Scene;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::io::save;
use faceoff_mesh::mesh::{Group, Mesh};

pub(super) fn run(arguments: &Init) -> Result<u8> {
    let (file, mesh) = own(&arguments.mesh)?;
    let path = arguments.mesh.with_extension("toml");
    let shown = path.display().to_string();
    if path.exists() {
        let what = format!("{shown} already exists");
        return Err(Error::usage(what, "move it, or rename the mesh"));
    }
    save(&path, [scene(&file, &mesh)?.as_bytes()])?;
    // If the guess is not valid, or the solver cannot take it, a message follows immediately.
    let found = Scene::find(&shown).and_then(|scene| scene.parts(&scene.triangulation(None)?));
    if let Err(e) = found {
        note!("faceoff: {shown} is not complete: {e}");
    }
    if !arguments.quiet {
        tell!("faceoff solve {}", crate::engine::quoted(&[shown]));
    }
    Ok(DONE)
}

/// The scene on this mesh. Each group of boundary faces is in the part that its name suggests.
fn scene(file: &str, mesh: &Mesh) -> Result<String> {
    let sides = mesh.groups.iter().filter(|g| g.dim + 1 == mesh.dim());
    let mut sides: Vec<&Group> = sides.filter(|g| !g.cells.is_empty()).collect();
    if sides.is_empty() {
        return Err(Error::usage(
            format!("{file} has no groups of faces on the boundary"),
            "mark the parts of the boundary: `Physical Curve` or `Physical Surface` in Gmsh, labels in FreeFEM",
        ));
    }
    let contact = ["contact", "base", "bottom", "floor", "obstacle"];
    let dirichlet = ["dirichlet", "clamp", "fix", "wall", "top"];
    // If no name suggests it, the first group is Γ_D and the last one Γ_C.
    let mut take = |words: [&str; 5], otherwise: usize| {
        let named = |g: &&Group| {
            let name = g.name.as_deref().unwrap_or_default().to_lowercase();
            words.iter().any(|word| name.contains(word))
        };
        let (mut taken, rest): (Vec<_>, Vec<_>) = sides.drain(..).partition(named);
        sides = rest;
        if taken.is_empty() && !sides.is_empty() {
            taken.push(sides.remove(otherwise.min(sides.len() - 1)));
        }
        list(&taken)
    };
    let dirichlet = take(dirichlet, 0);
    let contact = take(contact, usize::MAX);
    let neumann = list(&sides);
    let name: String = Path::new(file)
        .file_stem()
        .unwrap_or_default()
        .to_string_lossy()
        .chars()
        .map(|c| {
            if c.is_alphanumeric() || "-_".contains(c) {
                c
            } else {
                '-'
            }
        })
        .collect();
    let groups: Vec<String> = groups(mesh).iter().map(|g| format!("# {g}\n")).collect();
    Ok(format!(
        "\
name = {}

[mesh]
file = {}
{}
[boundary]              # a guess: every face of the boundary is in exactly one of these parts
dirichlet = {dirichlet}
neumann = {neumann}
contact = {contact}

[data]                  # -Δu = f; u = g, ∂ₙu = t and u ≤ psi on the three parts; formulas in x, y and z
f = \"1\"
g = \"0\"
t = \"0\"
psi = \"0\"
",
        Value::from(name),
        Value::from(file),
        groups.concat(),
    ))
}

/// The groups by their names, or by their numbers if they have no name.
fn list(groups: &[&Group]) -> Value {
    let of = |g: &&Group| g.name.clone().map_or(Value::from(g.tag), Value::from);
    Value::Array(groups.iter().map(of).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_mesh::mesh::generate::union_jack;

    #[test]
    fn sides_are_guessed_from_their_names() {
        let mut mesh = union_jack(2, [1.0, 1.0]);
        let text = scene("my mesh.msh", &mesh).unwrap();
        for line in [
            "name = \"my-mesh\"",
            "dirichlet = [\"top\"]",
            "contact = [\"bottom\"]",
        ] {
            assert!(text.lines().any(|l| l == line), "{line}: {text}");
        }
        assert!(
            Scene::parse(
                &text
                    .replace("file =", "# file =")
                    .replace("[boundary]", "generator = \"union-jack\"\n[boundary]")
            )
            .is_ok()
        );
        for group in &mut mesh.groups {
            group.name = None;
        }
        let text = scene("quoted \"name\".msh", &mesh).unwrap();
        assert!(text.contains("file = 'quoted \"name\".msh'"), "{text}");
        assert!(!text.contains("contact = []") && !text.contains("dirichlet = []"));
        mesh.groups.clear();
        assert!(scene("a.msh", &mesh).is_err());
    }
}
