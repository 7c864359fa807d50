//! The conditions of a fair comparison: two results rather than one and its copy, and stated tolerances.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::ResultField;
use faceoff_mesh::file;
use faceoff_mesh::io::{self, matches};

/// A field agrees where |a - b| ≤ max(rtol · largest value of the field, atol).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// Relative to the largest value of the field on its connected part of the mesh.
    pub rtol: f64,
    /// Absolute, in the unit of the field.
    pub atol: f64,
}

impl Default for Tolerance {
    /// The default.
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

/// The tolerance of every field, with exceptions for some.
#[derive(Debug, Clone, Default)]
pub struct Tolerances {
    /// For fields without an exception.
    pub of_all: Tolerance,
    /// Exceptions by name, or by a pattern with `*` and `?`; the last match counts.
    pub of_field: Vec<(String, Tolerance)>,
    /// Whether the user set `of_all`; if not, binary32 fields are allowed their rounding.
    pub is_given: bool,
}

/// The largest difference that rounding to binary32 on both sides makes of equal numbers, relative to the largest: twice 2⁻²⁴.
const SINGLE: f64 = f32::EPSILON as f64;

/// A tolerance of which each part may be unset.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PartialTolerance {
    /// As in [`Tolerance`].
    pub rtol: Option<f64>,
    /// As in [`Tolerance`].
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

/// The tolerances from one source: a scene, or a command line.
#[derive(Debug, Clone, Default)]
pub struct GivenTolerances {
    /// For every field.
    pub of_all: PartialTolerance,
    /// For single fields, by name or pattern.
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
            is_given: sources
                .iter()
                .any(|source| source.of_all != PartialTolerance::default()),
        };
        for (name, given) in sources.iter().flat_map(|source| &source.of_field) {
            let tolerance = given.or(tolerances.of(name));
            tolerances.of_field.push((name.clone(), tolerance));
        }
        tolerances
    }

    /// The tolerance of the field of this name: its exception, or that of all fields.
    pub fn of(&self, field: &str) -> Tolerance {
        self.own(field).unwrap_or(self.of_all)
    }

    /// The same for a field that a file stores as binary32.
    pub(super) fn of_single(&self, field: &str) -> Tolerance {
        let of = self.of(field);
        let rtol = match self.is_given || self.own(field).is_some() {
            true => of.rtol,
            false => of.rtol.max(SINGLE),
        };
        Tolerance { rtol, ..of }
    }

    /// The tolerance of a field, for its types in both files.
    pub(super) fn of_fields(&self, a: &ResultField, b: &ResultField) -> Tolerance {
        match (a.rest.is_some() && b.rest.is_some(), a.single || b.single) {
            (true, _) => self.of_integers(&a.name),
            (_, true) => self.of_single(&a.name),
            _ => self.of(&a.name),
        }
    }

    /// The tolerance of a field of integers: its exception, or zero, since numbers and labels that are nearly equal are different.
    pub(super) fn of_integers(&self, field: &str) -> Tolerance {
        let exact = Tolerance {
            rtol: 0.0,
            atol: 0.0,
        };
        self.own(field).unwrap_or(exact)
    }

    fn own(&self, field: &str) -> Option<Tolerance> {
        let own = self.of_field.iter().rfind(|(name, _)| matches(name, field));
        own.map(|(_, tolerance)| *tolerance)
    }
}

/// Whether two results are equal byte for byte, as those of a deterministic code are. Comparing a file with itself, under
/// any name, is an error.
///
/// # Errors
/// The two are one file, or list one; a file cannot be read.
pub fn are_identical(a: &Path, b: &Path) -> Result<bool> {
    // A list of files may name the other file, or one that the other lists as well.
    let (sources_a, sources_b) = (io::sources(a)?, io::sources(b)?);
    let files = |sources: &[PathBuf]| -> Result<HashSet<_>> {
        sources.iter().map(|path| identity(path)).collect()
    };
    if !files(&sources_a)?.is_disjoint(&files(&sources_b)?) {
        return Err(Error::Compare {
            a: a.display().to_string(),
            b: b.display().to_string(),
            what: "they are one file, and a file against itself proves nothing".into(),
            remedy: "name two results".into(),
        });
    }
    let equal = |(a, b): (&PathBuf, &PathBuf)| -> Result<bool> {
        let size = |path: &Path| path.metadata().map(|m| m.len()).ok();
        Ok(size(a) == size(b) && file::read(a)? == file::read(b)?)
    };
    // The contents of files that are only named are not compared.
    let is_whole = |path: &PathBuf| {
        let suffix = path.extension().unwrap_or_default().to_ascii_lowercase();
        !["xdmf", "xmf", "sol"].iter().any(|of| suffix == **of)
    };
    let mut identical = sources_a.len() == sources_b.len()
        && !sources_a.is_empty()
        && sources_a.iter().all(is_whole);
    for pair in sources_a.iter().zip(&sources_b) {
        identical = identical && equal(pair)?;
    }
    Ok(identical)
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
    fn a_file_is_no_two_results_and_a_copy_is() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("a.csv"), "vertex,u\n0,1\n").unwrap();
        std::fs::copy(at("a.csv"), at("copy.csv")).unwrap();
        std::fs::hard_link(at("a.csv"), at("link.csv")).unwrap();
        std::fs::write(at("b.csv"), "vertex,u\n0,2\n").unwrap();
        let found = |b: &str| are_identical(&at("a.csv"), &at(b)).map_err(|e| e.to_string());
        for (name, words) in [
            ("a.csv", "they are one file"),
            ("link.csv", "they are one file"),
            ("none.csv", "cannot read"),
        ] {
            let error = found(name).unwrap_err();
            assert!(error.contains(words), "{error}");
        }
        assert_eq!(found("copy.csv"), Ok(true));
        assert_eq!(found("b.csv"), Ok(false));
        // The values are in another file, which may differ.
        for name in ["a.xdmf", "b.xdmf"] {
            std::fs::write(at(name), "<Xdmf>u.h5:/u</Xdmf>").unwrap();
        }
        assert_eq!(
            are_identical(&at("a.xdmf"), &at("b.xdmf")).ok(),
            Some(false)
        );
    }

    #[test]
    fn binary32_is_allowed_its_rounding_unless_asked_otherwise() {
        let of = |sources: &[GivenTolerances]| Tolerances::of_sources(sources).of_single("u").rtol;
        assert_eq!(of(&[]), 2.0_f64.powi(-23));
        assert_eq!(of(&[given(Some(1e-8), None, &[])]), 1e-8);
        assert_eq!(of(&[given(None, None, &[("u", None, Some(1e-3))])]), 1e-9);
    }
}
