//! What a comparison of two files is made by, and what it finds.

use serde::{Deserialize, Serialize};

use super::law::{Tolerance, Tolerances};
use super::{FieldVerdict, Removed, UpTo, Verdict};
use faceoff_mesh::field::Results;
use faceoff_mesh::io::matches;

/// How points and cells are matched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum MatchBy {
    /// By their numbers.
    Vertices,
    /// By their places.
    Coordinates,
    /// Not at all: fields are functions, which are compared where both are.
    Functions,
}

/// What a comparison of two files finds.
#[derive(Debug, Serialize)]
pub struct Comparison {
    /// The worst of its fields.
    pub verdict: Verdict,
    /// The name of the first result.
    pub a: String,
    /// The name of the second.
    pub b: String,
    /// By what points and cells were matched.
    pub map: MatchBy,
    /// Every field that either has.
    pub fields: Vec<ComparedField>,
    /// Whether the files are the same byte for byte; who reads them says so.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub identical: bool,
    /// Where fields are compared as functions: what the two meshes have in common.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub intersection: Option<Intersection>,
    /// What only one file has without being judged.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// For each set of fields that was matched.
    #[serde(skip)]
    pub differences: Vec<Differences>,
    /// The cells of the first result, where they were found from its faces.
    #[serde(skip)]
    pub found: Option<Box<Results>>,
}

impl Comparison {
    pub(super) fn new(a: &Results, b: &Results, map: MatchBy) -> Self {
        Comparison {
            verdict: Verdict::Undetermined,
            a: a.source.clone(),
            b: b.source.clone(),
            map,
            fields: Vec::new(),
            identical: false,
            intersection: None,
            notes: [a, b]
                .into_iter()
                .filter(|side| side.ghosts > 0)
                .map(|side| {
                    format!(
                        "{}: {} ghost cells, which other pieces have as well, are left out",
                        side.source, side.ghosts
                    )
                })
                .collect(),
            differences: Vec::new(),
            found: None,
        }
    }

    /// With the verdict that its fields have together.
    pub(super) fn judged(mut self) -> Self {
        let verdicts = self.fields.iter().map(|f| f.field.verdict);
        self.verdict = Verdict::of_all(verdicts);
        self
    }
}

/// One field of two files. What the verdict calls a face is the point, cell or corner that carries the field.
#[derive(Debug, Clone, Serialize)]
pub struct ComparedField {
    /// What carries it.
    pub on: On,
    /// The largest |value| on either side: the scale on which the field is judged; each connected part has its own.
    pub scale: Option<f64>,
    /// What was allowed, relative to `scale`.
    pub rtol: f64,
    /// What was allowed, in the unit of the field.
    pub atol: f64,
    /// Norms of the difference, where cells are known.
    #[serde(flatten)]
    pub norms: Option<Norms>,
    /// Whether a file holds it as binary32, which rounds to 6e-8.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub single: bool,
    /// What was taken away before the two were compared, as the problem leaves it open.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub removed: Vec<Removed>,
    /// Of a field that disagrees: what would make the two equal, if the problem left it open.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub equal_after: Vec<Removed>,
    /// How far the two are apart, and where.
    #[serde(flatten)]
    pub field: FieldVerdict,
}

impl ComparedField {
    /// A part of both files that was not read and is equal byte for byte.
    pub(super) fn same_bytes(name: &str, what: &str) -> Self {
        let reason = format!("equal byte for byte, not read: {what}");
        let field = FieldVerdict {
            max_abs: 0.0,
            max_rel: 0.0,
            verdict: Verdict::Agree,
            ..FieldVerdict::failed(name, 0.0, reason)
        };
        ComparedField {
            atol: 0.0,
            field,
            ..Self::unjudged(On::Unread, name, &Tolerances::default(), String::new())
        }
    }

    pub(super) fn unjudged(on: On, name: &str, tolerances: &Tolerances, reason: String) -> Self {
        let Tolerance { rtol, atol } = tolerances.of(name);
        ComparedField {
            on,
            scale: None,
            rtol,
            atol,
            norms: None,
            single: false,
            removed: Vec::new(),
            equal_after: Vec::new(),
            field: FieldVerdict::failed(name, rtol, reason),
        }
    }
}

/// What carries a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum On {
    /// Points of the mesh, or rows of a table.
    Points,
    /// Cells, faces among them.
    Cells,
    /// Corners of cells, which need not agree where they meet.
    Corners,
    /// The file as a whole.
    Whole,
    /// All cells, whatever carries the values of either side.
    Functions,
    /// The mesh itself: what part of it the other mesh does not cover.
    Domain,
    /// Nothing: a part of a file that was not read.
    Unread,
}

impl On {
    pub(super) fn noun(self) -> &'static str {
        match self {
            On::Points => "point",
            On::Cells => "cell",
            On::Corners => "corner",
            On::Whole | On::Unread => "entry",
            On::Functions | On::Domain => "cell",
        }
    }
}

/// a - b for all fields on points, cells or corners, in the order of the first file. Of functions on other meshes ([`On::Functions`])
/// three numbers for each cell of the first: the largest |a - b|, and the means of a and b on what both meshes cover (of |a| and |b|
/// if they have components).
#[derive(Debug)]
pub struct Differences {
    /// What has the values.
    pub on: On,
    /// What [`Differences::places`] returns, but empty where that is in the first file.
    pub(super) places: Vec<[f64; 3]>,
    /// Name, components and values; NaN where a field is not carried.
    pub fields: Vec<(String, usize, Vec<f64>)>,
}

impl Differences {
    /// Coordinates of the corners, cell by cell, or of the points or cells in the order of the file, which is `a`.
    pub fn places<'a>(&'a self, a: &'a Results) -> &'a [[f64; 3]] {
        match self.on {
            On::Points if self.places.is_empty() => &a.points,
            _ => &self.places,
        }
    }
}

/// By what two results are compared.
#[derive(Clone, Default)]
pub struct Settings<'a> {
    /// What is allowed for each field.
    pub tolerances: Tolerances,
    /// Without it, points and cells are matched by their numbers if the points of both files are the same in the same order,
    /// and by coordinates otherwise; fields on meshes with other cells are compared as functions.
    pub map: Option<MatchBy>,
    /// Of functions: the part of a mesh that the other one need not cover; `None`: no more than rounding of the coordinates.
    pub alone: Option<f64>,
    /// What the problem leaves open of single fields, by name or pattern; the last that matches counts.
    pub up_to: Vec<(String, Vec<UpTo>)>,
    /// Fields of which NaN on both sides is no difference; NaN against a number always is. `*` and `?` stand for others.
    pub nan_equal: Vec<String>,
    /// How far apart two points may be along an axis and still be one; without it, what the digits of the files allow.
    pub near: Option<f64>,
    /// Whether the files have the same bytes, so that what is in them and was not read is the same as well.
    pub identical: bool,
    /// Hears how much of a long comparison is done, from 0 to 1.
    pub progress: Option<&'a (dyn Fn(f64) + Sync)>,
}

impl From<Tolerances> for Settings<'_> {
    fn from(tolerances: Tolerances) -> Self {
        Settings {
            tolerances,
            ..Settings::default()
        }
    }
}

impl Settings<'_> {
    /// What the problem leaves open of a field.
    pub(super) fn up_to(&self, field: &str) -> &[UpTo] {
        let mut known = self.up_to.iter();
        let own = known.rfind(|(name, _)| name == field || matches(name, field));
        own.map_or(&[], |(_, up_to)| up_to)
    }

    pub(super) fn nan_equal(&self, field: &str) -> bool {
        self.nan_equal
            .iter()
            .any(|name| name == field || matches(name, field))
    }
}

/// The meshes of two results, laid over each other.
#[derive(Debug, Clone, Serialize)]
pub struct Intersection {
    /// Cells of the highest dimension of either mesh.
    pub cells: [usize; 2],
    /// Area or volume of either mesh.
    pub measures: [f64; 2],
    /// That of their intersection.
    pub common: f64,
    /// What either has alone, summed over its cells.
    pub alone: [f64; 2],
    /// Cells with curved sides, which are taken as straight pieces between their nodes.
    pub curved: [usize; 2],
    /// Whether all functions are polynomials on the intersections of cells, so that integrals are exact but for rounding.
    pub exact: bool,
}

/// Norms of the difference of two fields over their mesh, or over what two meshes have in common.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Norms {
    /// ‖a - b‖ in L², over all components.
    pub l2: f64,
    /// The larger one of ‖a‖ and ‖b‖.
    pub l2_scale: f64,
    /// |a - b| in H¹, cell by cell: ‖∇(a - b)‖; none where a field is constant on each cell.
    pub h1: Option<f64>,
    /// The larger one of ‖∇a‖ and ‖∇b‖.
    pub h1_scale: Option<f64>,
}

pub(super) fn by_id(results: &Results) -> Vec<u32> {
    if results.ids.is_empty() {
        (0..results.point_count() as u32).collect()
    } else {
        results.ids.clone()
    }
}
