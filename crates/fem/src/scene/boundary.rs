//! Which boundary face belongs to which part of the boundary.

use serde::Deserialize;

use super::Scene;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::{FaceGroup, Triangulation};

/// A physical group as a scene names it.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(untagged)]
pub enum GroupName {
    /// Its number in the mesh file.
    Tag(i64),
    /// Its name there.
    Name(String),
}

/// The groups of each part.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Boundary {
    /// The groups of Γ_D.
    pub dirichlet: Vec<GroupName>,
    /// Those of Γ_N.
    pub neumann: Vec<GroupName>,
    /// Those of Γ_C.
    pub contact: Vec<GroupName>,
}

/// The three parts of the boundary; their numbers are the labels that engines get.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Γ_C
    Contact = 1,
    /// Γ_D
    Dirichlet = 2,
    /// Γ_N
    Neumann = 3,
}

impl GroupName {
    fn names(&self, group: &FaceGroup) -> bool {
        match self {
            GroupName::Tag(tag) => *tag == group.tag,
            GroupName::Name(name) => group.name.as_deref() == Some(name),
        }
    }
}

impl Scene {
    /// The part of each boundary face; `None` for faces inside.
    ///
    /// # Errors
    /// A group that the mesh does not have, a boundary face in no part or in two.
    pub fn parts(&self, mesh: &Triangulation) -> Result<Vec<Option<Part>>> {
        let refuse = |place: &str, what: String, remedy: String| Error::Scene {
            scene: self.name.clone(),
            place: place.to_owned(),
            what,
            remedy,
        };
        let mut parts: Vec<Option<Part>> = vec![None; mesh.face_count()];
        let lists = [
            (
                "boundary.dirichlet",
                &self.boundary.dirichlet,
                Part::Dirichlet,
            ),
            ("boundary.neumann", &self.boundary.neumann, Part::Neumann),
            ("boundary.contact", &self.boundary.contact, Part::Contact),
        ];
        for (place, names, part) in lists {
            for name in names {
                let mut known = false;
                for group in mesh.groups.iter().filter(|g| name.names(g)) {
                    known = true;
                    for &face in &group.faces {
                        let slot = &mut parts[face as usize];
                        if slot.is_some_and(|other| other != part) {
                            return Err(refuse(
                                place,
                                format!(
                                    "{} of mesh {} is in two parts: {:?} and {part:?}",
                                    mesh.face_label(face as usize),
                                    mesh.name,
                                    slot.unwrap_or(part),
                                ),
                                "a boundary face belongs to exactly one part".into(),
                            ));
                        }
                        *slot = Some(part);
                    }
                }
                if !known {
                    let have: Vec<_> = mesh.groups.iter().map(FaceGroup::label).collect();
                    let name = match name {
                        GroupName::Tag(tag) => tag.to_string(),
                        GroupName::Name(name) => format!("\"{name}\""),
                    };
                    return Err(refuse(
                        place,
                        format!("mesh {} has no boundary group {name}", mesh.name),
                        format!("it has {}", have.join(", ")),
                    ));
                }
            }
        }
        let bare = (0..mesh.face_count()).find(|&f| mesh.is_boundary(f) && parts[f].is_none());
        if let Some(face) = bare {
            return Err(refuse(
                "boundary",
                format!(
                    "{} of mesh {} is in no part",
                    mesh.face_label(face),
                    mesh.name
                ),
                "name its group under dirichlet, neumann or contact".into(),
            ));
        }
        Ok(parts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_mesh::mesh::generate::union_jack;

    #[test]
    fn every_boundary_face_is_in_exactly_one_part() {
        let mesh = Triangulation::new("uj", &union_jack(3, [1.0, 1.0])).unwrap();
        let scene = Scene::find("one-zone").unwrap();
        let parts = scene.parts(&mesh).unwrap();
        let count = |part| parts.iter().filter(|&&p| p == Some(part)).count();
        assert_eq!(
            [Part::Contact, Part::Dirichlet, Part::Neumann].map(count),
            [3, 3, 6]
        );
        let refusal = |change: &dyn Fn(&mut Boundary)| {
            let mut boundary = scene.boundary.clone();
            change(&mut boundary);
            let other = scene.with_boundary(boundary);
            other.parts(&mesh).unwrap_err().to_string()
        };
        let name = |s: &str| GroupName::Name(s.into());
        assert!(refusal(&|b| b.neumann.clear()).contains("in no part"));
        assert!(refusal(&|b| b.neumann.push(name("top"))).contains("in two parts"));
        assert!(refusal(&|b| b.contact.push(name("lid"))).contains("no boundary group \"lid\""));
        assert!(refusal(&|b| b.contact.push(GroupName::Tag(9))).contains("no boundary group 9"));
    }
}
