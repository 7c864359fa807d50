//! The settings of a comparison of two files, and its result.

use serde::{Deserialize, Serialize};

use super::law::{Tolerance, Tolerances};
use super::{FieldVerdict, Removed, UpTo, Verdict};
use faceoff_mesh::field::Results;
use faceoff_mesh::io::matches;

/// How points and cells are matched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum MatchBy {
    /// By point and cell numbers.
    Vertices,
    /// By coordinates.
    Coordinates,
    /// Not matched: fields are compared as functions on the intersection of the two meshes.
    Functions,
}

/// The result of a comparison of two files.
#[derive(Debug, Serialize)]
pub struct Comparison {
    /// The worst verdict of its fields.
    pub verdict: Verdict,
    /// The name of the first result.
    pub a: String,
    /// The name of the second.
    pub b: String,
    /// How points and cells were matched.
    pub map: MatchBy,
    /// Every field that is in at least one of the files.
    pub fields: Vec<ComparedField>,
    /// Whether the files are equal byte for byte, as stated by the caller that read them.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub identical: bool,
    /// The overlap of the two meshes, if fields were compared as functions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub intersection: Option<Intersection>,
    /// Contents of only one file that were not judged.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// One per set of fields that was matched.
    #[serde(skip)]
    pub differences: Vec<Differences>,
    /// The cells of the first result, if they were reconstructed from its faces.
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

    /// Sets the verdict from those of the fields.
    pub(super) fn judged(mut self) -> Self {
        let verdicts = self.fields.iter().map(|f| f.field.verdict);
        self.verdict = Verdict::of_all(verdicts);
        self
    }
}

/// One field of two files. A "face" in the verdict is the point, cell or corner that carries the field.
#[derive(Debug, Clone, Serialize)]
pub struct ComparedField {
    /// The entities that carry it.
    pub on: On,
    /// The largest |value| on either side, which is the scale of the field; each connected part of the mesh has a separate one.
    pub scale: Option<f64>,
    /// The tolerance relative to `scale`.
    pub rtol: f64,
    /// The tolerance in the unit of the field.
    pub atol: f64,
    /// Norms of the difference, if cells are known.
    #[serde(flatten)]
    pub norms: Option<Norms>,
    /// Whether a file stores it as binary32, which rounds to 6e-8.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub single: bool,
    /// What was subtracted or multiplied before the comparison because the problem leaves it open.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub removed: Vec<Removed>,
    /// If the field disagrees: a change that would make both equal, if the problem left it open.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub equal_after: Vec<Removed>,
    /// The difference of the two, and its position.
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

/// The entities that carry a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum On {
    /// Points of the mesh, or rows of a table.
    Points,
    /// Cells, including faces stored as cells.
    Cells,
    /// Corners of cells, whose values may differ at a shared point.
    Corners,
    /// The file as a whole.
    Whole,
    /// All cells, regardless of which entities carry the values of either side.
    Functions,
    /// The mesh: the part of it that the other mesh does not cover.
    Domain,
    /// None: a part of a file that was not read.
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

/// a - b for all fields on points, cells or corners, in the order of the first file. For functions on different meshes ([`On::Functions`])
/// three numbers for each cell of the first: the largest |a - b|, and the means of a and b on the region that both meshes cover (of |a| and |b|
/// if they have components).
#[derive(Debug)]
pub struct Differences {
    /// The entities that carry the values.
    pub on: On,
    /// The value of [`Differences::places`], but empty if the first file contains it.
    pub(super) places: Vec<[f64; 3]>,
    /// Name, components and values; NaN where a field is not defined.
    pub fields: Vec<(String, usize, Vec<f64>)>,
}

impl Differences {
    /// Coordinates of the corners, cell by cell, or of the points or cells in the order of the file `a`.
    pub fn places<'a>(&'a self, a: &'a Results) -> &'a [[f64; 3]] {
        match self.on {
            On::Points if self.places.is_empty() => &a.points,
            _ => &self.places,
        }
    }
}

/// The settings of a comparison of two results.
#[derive(Clone, Default)]
pub struct Settings<'a> {
    /// The tolerance of each field.
    pub tolerances: Tolerances,
    /// `None`: points and cells are matched by their numbers if the points of both files are the same in the same order,
    /// and by coordinates otherwise; fields on meshes with different cells are compared as functions.
    pub map: Option<MatchBy>,
    /// For functions: the part of a mesh that the other one need not cover. `None`: no more than rounding of the coordinates.
    pub alone: Option<f64>,
    /// What the problem leaves open in a field, by name or pattern; the last match counts.
    pub up_to: Vec<(String, Vec<UpTo>)>,
    /// Fields in which NaN on both sides counts as equal; NaN against a number never does. `*` and `?` are wildcards.
    pub nan_equal: Vec<String>,
    /// The distance along an axis up to which two points are the same. `None`: it follows from the digits in the files.
    pub near: Option<f64>,
    /// Whether the files have the same bytes, so that the parts that were not read are equal as well.
    pub identical: bool,
    /// Is called with the completed part of a long comparison, from 0 to 1.
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

/// The intersection of the meshes of two results.
#[derive(Debug, Clone, Serialize)]
pub struct Intersection {
    /// Cells of the highest dimension of either mesh.
    pub cells: [usize; 2],
    /// Area or volume of either mesh.
    pub measures: [f64; 2],
    /// Area or volume of their intersection.
    pub common: f64,
    /// Area or volume that only one of them covers, summed over its cells.
    pub alone: [f64; 2],
    /// Cells with curved sides, which are approximated by straight pieces between their nodes.
    pub curved: [usize; 2],
    /// Whether all functions are polynomials on the intersections of cells, so that integrals are exact up to rounding.
    pub exact: bool,
    /// Where they are not: how much norms in L² change at most with a rule of two degrees less and with parts too thin to count, divided by the larger field's norm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quadrature: Option<f64>,
    /// The largest distance of two surfaces in space, along the normals of the first; none in a plane or of solid cells.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub distance: Option<f64>,
}

/// Norms of the difference of two fields over their mesh, or over the intersection of two meshes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Norms {
    /// ‖a - b‖ in L², over all components.
    pub l2: f64,
    /// The larger of ‖a‖ and ‖b‖.
    pub l2_scale: f64,
    /// |a - b| in H¹, cell by cell: ‖∇(a - b)‖; `None` if a field is constant on each cell.
    pub h1: Option<f64>,
    /// The larger of ‖∇a‖ and ‖∇b‖.
    pub h1_scale: Option<f64>,
}

pub(super) fn by_id(results: &Results) -> Vec<u32> {
    if results.ids.is_empty() {
        (0..results.point_count() as u32).collect()
    } else {
        results.ids.clone()
    }
}
