//! What makes a comparison fair: two results rather than one and its copy, and tolerances that are stated.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::file;
use faceoff_mesh::io;

/// A field agrees where |a - b| ≤ max(rtol · largest value of the field, atol).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    pub rtol: f64,
    pub atol: f64,
}

impl Default for Tolerance {
    /// What applies where no tolerance is given.
    fn default() -> Self {
        Tolerance {
            rtol: 1e-9,
            atol: 0.0,
        }
    }
}

impl Tolerance {
    /// The tolerance and the unit by which a field of this scale is judged.
    pub(super) fn of_scale(self, scale: f64) -> (f64, f64) {
        if self.rtol > 0.0 {
            (self.rtol, scale.max(self.atol / self.rtol))
        } else {
            (self.atol, 1.0)
        }
    }
}

/// The tolerance of every field, and of some that have their own.
#[derive(Debug, Clone, Default)]
pub struct Tolerances {
    pub of_all: Tolerance,
    pub of_field: Vec<(String, Tolerance)>,
}

/// A tolerance as far as it is given.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PartialTolerance {
    pub rtol: Option<f64>,
    pub atol: Option<f64>,
}

impl PartialTolerance {
    fn or(self, other: Tolerance) -> Tolerance {
        Tolerance {
            rtol: self.rtol.unwrap_or(other.rtol),
            atol: self.atol.unwrap_or(other.atol),
        }
    }
}

/// The tolerances that one source gives: a scene, or a command line.
#[derive(Debug, Clone, Default)]
pub struct GivenTolerances {
    pub of_all: PartialTolerance,
    pub of_field: Vec<(String, PartialTolerance)>,
}

impl Tolerances {
    /// From several sources, of which later ones take precedence. A tolerance for one field, from any source, takes
    /// precedence over those for all fields.
    pub fn of_sources(sources: &[GivenTolerances]) -> Self {
        let of_all = sources.iter().map(|source| source.of_all);
        let mut tolerances = Tolerances {
            of_all: of_all.fold(Tolerance::default(), |known, given| given.or(known)),
            of_field: Vec::new(),
        };
        for (name, given) in sources.iter().flat_map(|source| &source.of_field) {
            let tolerance = given.or(tolerances.of(name));
            tolerances.of_field.push((name.clone(), tolerance));
        }
        tolerances
    }

    /// The tolerance of the field of this name: its own, or that of all fields.
    pub fn of(&self, field: &str) -> Tolerance {
        self.own(field).unwrap_or(self.of_all)
    }

    /// The tolerance of a field of integers: its own, or none, since numbers and labels that are nearly the same are others.
    pub(super) fn of_integers(&self, field: &str) -> Tolerance {
        let exact = Tolerance {
            rtol: 0.0,
            atol: 0.0,
        };
        self.own(field).unwrap_or(exact)
    }

    fn own(&self, field: &str) -> Option<Tolerance> {
        let own = self.of_field.iter().rfind(|(name, _)| name == field);
        own.map(|(_, tolerance)| *tolerance)
    }
}

/// Refuses to compare a file with itself, under whatever name, or with a copy of it, unless `allow_identical` says
/// that both were computed.
///
/// # Errors
/// The two are one result; a file cannot be read.
pub fn refuse_copies(a: &Path, b: &Path, allow_identical: bool) -> Result<()> {
    let refuse = |what: &str, remedy: &str| {
        Err(Error::Compare {
            a: a.display().to_string(),
            b: b.display().to_string(),
            what: what.to_owned(),
            remedy: remedy.to_owned(),
        })
    };
    // A list of files may name the other file, or one that it lists as well.
    let (sources_a, sources_b) = (io::sources(a)?, io::sources(b)?);
    let files = |sources: &[PathBuf]| -> Result<HashSet<_>> {
        sources.iter().map(|path| identity(path)).collect()
    };
    if !files(&sources_a)?.is_disjoint(&files(&sources_b)?) {
        return refuse(
            "they are one file, and a file against itself proves nothing",
            "name two results",
        );
    }
    let equal = |(a, b): (&PathBuf, &PathBuf)| -> Result<bool> {
        let size = |path: &Path| path.metadata().map(|m| m.len()).ok();
        Ok(size(a) == size(b) && file::read(a)? == file::read(b)?)
    };
    let mut copies = sources_a.len() == sources_b.len() && !sources_a.is_empty();
    for pair in sources_a.iter().zip(&sources_b) {
        copies = copies && equal(pair)?;
    }
    if copies && !allow_identical {
        return refuse(
            "they are the same byte for byte, as a file and its copy are, which proves nothing",
            "name two results; if both were computed, say --allow-identical",
        );
    }
    Ok(())
}

/// What all names of a file have in common: device and inode, which hard links share.
#[cfg(unix)]
fn identity(path: &Path) -> Result<(u64, u64)> {
    use std::os::unix::fs::MetadataExt;
    let found = path.metadata().map_err(Error::io(path, "read"))?;
    Ok((found.dev(), found.ino()))
}

#[cfg(not(unix))]
fn identity(path: &Path) -> Result<PathBuf> {
    path.canonicalize().map_err(Error::io(path, "read"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A source of tolerances.
    fn given(
        rtol: Option<f64>,
        atol: Option<f64>,
        of_field: &[(&str, Option<f64>, Option<f64>)],
    ) -> GivenTolerances {
        let of_field = of_field.iter().map(|&(name, rtol, atol)| {
            let tolerance = PartialTolerance { rtol, atol };
            (name.to_owned(), tolerance)
        });
        GivenTolerances {
            of_all: PartialTolerance { rtol, atol },
            of_field: of_field.collect(),
        }
    }

    #[test]
    fn the_nearest_tolerance_counts() {
        let of = |options: GivenTolerances, scene: &GivenTolerances| {
            let tolerances = Tolerances::of_sources(&[scene.clone(), options]);
            ["u", "v"].map(|name| {
                let Tolerance { rtol, atol } = tolerances.of(name);
                (rtol, atol)
            })
        };
        let none = given(None, None, &[]);
        let scene = given(Some(1e-3), None, &[("u", None, Some(1e-4))]);
        assert_eq!(of(none.clone(), &none), [(1e-9, 0.0); 2]);
        assert_eq!(of(given(Some(1.0), None, &[]), &none), [(1.0, 0.0); 2]);
        assert_eq!(of(none, &scene), [(1e-3, 1e-4), (1e-3, 0.0)]);
        assert_eq!(
            of(given(Some(1.0), Some(2.0), &[]), &scene),
            [(1.0, 1e-4), (1.0, 2.0)]
        );
        let fields = [("u", Some(5.0), None), ("v", None, Some(6.0))];
        assert_eq!(
            of(given(None, None, &fields), &scene),
            [(5.0, 1e-4), (1e-3, 6.0)]
        );
    }

    #[test]
    fn a_file_and_its_copies_are_no_two_results() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("a.csv"), "vertex,u\n0,1\n").unwrap();
        std::fs::copy(at("a.csv"), at("copy.csv")).unwrap();
        std::fs::hard_link(at("a.csv"), at("link.csv")).unwrap();
        std::fs::write(at("b.csv"), "vertex,u\n0,2\n").unwrap();
        let refused = |b: &str, allow_identical| {
            let refused = refuse_copies(&at("a.csv"), &at(b), allow_identical);
            refused.map_err(|e| e.to_string())
        };
        for (name, allow_identical, words) in [
            ("a.csv", true, "they are one file"),
            ("link.csv", true, "they are one file"),
            ("copy.csv", false, "the same byte for byte"),
            ("none.csv", false, "cannot read"),
        ] {
            let error = refused(name, allow_identical).unwrap_err();
            assert!(error.contains(words), "{error}");
        }
        assert_eq!(refused("copy.csv", true), Ok(()));
        assert_eq!(refused("b.csv", false), Ok(()));
    }
}
