//! Reports which equations of two linear systems differ.

use serde::Serialize;

use super::terms::{OfTerm, terms};
use crate::text::number::{place, size, whole};
use crate::text::{Number, Text, text};
use faceoff_judge::systems::{Block, Both, Compared, Kept, Loads, Region, Settings, System, Where};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::{Mesh, Triangulation};

/// Residuals from this size on are not rounding.
const UNSOLVED: f64 = 1e-9;
/// A field is in the kernel if no row has a larger remainder.
const NOTHING: f64 = 1e-10;
/// The number of digits of constants.
const DIGITS: usize = 5;

/// The comparison of two systems.
#[derive(Debug, Clone, Serialize)]
pub struct Systems {
    /// The finding, without a full stop.
    pub sentence: Text,
    /// The comparison.
    #[serde(rename = "systems")]
    pub compared: Compared,
    /// The terms by which the matrices differ, if the difference is a sum of few.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub terms: Vec<OfTerm>,
    /// The same for the loads.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub load_terms: Vec<OfTerm>,
}

impl Systems {
    /// Compares two systems; the mesh, if there is one, names places and gives the volume.
    ///
    /// # Errors
    /// Dofs that cannot be matched; [`faceoff_mesh::Error::Ended`].
    pub fn new(a: &System, b: &System, mesh: Option<&Mesh>) -> Result<Self> {
        let simplices = mesh.and_then(|mesh| Triangulation::new("the mesh", mesh).ok());
        let volume =
            simplices.map(|mesh| (0..mesh.cell_count()).map(|cell| mesh.measure(cell)).sum());
        let settings = Settings {
            volume,
            regions: mesh.map(Region::of).unwrap_or_default(),
            ..Settings::default()
        };
        Systems::with(a, b, mesh, &settings)
    }

    /// The same with other settings.
    ///
    /// # Errors
    /// Errors of [`Systems::new`].
    pub fn with(a: &System, b: &System, mesh: Option<&Mesh>, settings: &Settings) -> Result<Self> {
        let both = Both::new(a, b)?;
        let compared = both.compare(settings)?;
        let [of_matrix, of_load] = match mesh {
            Some(mesh) if !compared.verdict.passes() => terms(&both, &compared, mesh),
            _ => [Vec::new(), Vec::new()],
        };
        Ok(Systems {
            sentence: sentence(&compared, &of_matrix, &of_load),
            compared,
            terms: of_matrix,
            load_terms: of_load,
        })
    }
}

impl Systems {
    /// The comparison as JSON.
    ///
    /// # Errors
    /// Numbers that JSON does not have.
    pub fn json(&self) -> Result<String> {
        serde_json::to_string(self).map_err(|e| Error::usage(e.to_string(), "report this"))
    }
}

/// All differences, or that there are none.
pub fn sentence(of: &Compared, of_matrix: &[OfTerm], of_load: &[OfTerm]) -> Text {
    let (a, b) = (&of.a, &of.b);
    let mut parts: Vec<Text> = Vec::new();
    parts.extend(
        of.matrix
            .iter()
            .filter(|block| block.differs.rows > 0)
            .map(|block| matrix(of, block, of_matrix)),
    );
    let constrained = &of.constrained;
    // Rows next to constrained ones differ if their values or the matrix do.
    let is_caused = |loads: &&Loads| {
        let has_matrix = of
            .matrix
            .iter()
            .any(|block| block.of == loads.of && block.differs.rows > 0);
        loads.constrained && (has_matrix || constrained.values > 0)
    };
    let loads = of
        .load
        .iter()
        .filter(|loads| loads.differs.rows > 0 && !is_caused(loads));
    parts.extend(loads.map(|loads| load(of, loads, of_load)));
    if let Some(at) = &constrained.only_where {
        let [first, second] = constrained.only;
        let told = [(a, first), (b, second)]
            .into_iter()
            .filter(|(_, rows)| *rows > 0);
        let told = told.map(|(name, rows)| text!("{} rows only in {name}", whole(rows)));
        parts.push(text!(
            "constrained are {}, {}",
            Text::joined(told, " and "),
            located(at)
        ));
    }
    if let Some(at) = &constrained.values_where {
        let factor = constrained
            .factor
            .map(|factor| text!(": those of {b} are those of {a} times {}", told(factor)));
        parts.push(text!(
            "{} constrained rows have other values, {}{factor}",
            whole(constrained.values),
            located(at)
        ));
    }
    if parts.is_empty() {
        let largest = of
            .matrix
            .iter()
            .map(|block| block.largest)
            .chain(of.load.iter().map(|l| l.largest));
        let largest = largest.fold(0.0, f64::max);
        parts.push(text!(
            "the systems are equal: the largest difference is **{}** of its row",
            size(largest)
        ));
        if constrained.both > 0 {
            let [first, second] = &constrained.kept;
            parts.push(text!(
                "{} rows are constrained in both, {} in {a} and {} in {b}",
                whole(constrained.both),
                kept(first),
                kept(second)
            ));
        }
    }
    if let Some(residuals) = &of.residuals {
        for (name, left) in [a, b].into_iter().zip(residuals.own) {
            if !(left <= UNSOLVED) {
                parts.push(text!(
                    "the answer of {name} leaves {} in its own system: its solver stopped early",
                    size(left)
                ));
            }
        }
    }
    Text::joined(parts, "; ")
}

fn told(x: f64) -> Number {
    let rounded: f64 = format!("{x:.*e}", DIGITS - 1).parse().unwrap_or(x);
    match rounded == 0.0 || (1e-3..1e5).contains(&rounded.abs()) {
        true => Number::exact(rounded),
        false => Number::power(rounded),
    }
}

/// The coefficients of each term in both systems.
fn by_terms(of: &Compared, field: &str, all: &[OfTerm]) -> Vec<Text> {
    let own = all.iter().filter(|term| term.of == field);
    own.map(|term| match term.a {
        Some(0.0) => text!(
            "{} has {} times `{}` on top, which {} has not",
            &of.b,
            told(term.more),
            &term.term,
            &of.a
        ),
        Some(a) if a + term.more == 0.0 => text!(
            "{} has {} times `{}` on top, which {} has not",
            &of.a,
            told(a),
            &term.term,
            &of.b
        ),
        Some(a) => text!(
            "{} has {} times `{}`, {} has {}",
            &of.a,
            told(a),
            &term.term,
            &of.b,
            told(a + term.more)
        ),
        None if term.more < 0.0 => text!(
            "{} has {} times `{}` more than {}",
            &of.a,
            told(-term.more),
            &term.term,
            &of.b
        ),
        None => text!(
            "{} has {} times `{}` more than {}",
            &of.b,
            told(term.more),
            &term.term,
            &of.a
        ),
    })
    .collect()
}

fn matrix(of: &Compared, block: &Block, terms: &[OfTerm]) -> Text {
    let (a, b) = (&of.a, &of.b);
    let coupling = match block.of == block.with {
        true if of.load.len() == 1 => Text::default(),
        true => text!(" of `{block.of}`"),
        false => text!(" of `{block.of}` with `{block.with}`"),
    };
    let of_terms = terms
        .iter()
        .filter(|term| term.of == block.of && block.of == block.with)
        .count();
    let how = match block.factor {
        Some(0.0) => text!(": {b} has none"),
        Some(factor) => text!(": {b}'s is {a}'s times {}", told(factor)),
        None if of_terms > 0 => Text::default(),
        None => text!(
            " by up to {} of their entries, by no common factor",
            size(block.largest)
        ),
    };
    let shape = match (block.symmetric, block.skew, block.factor) {
        (_, _, Some(_)) | (false, false, _) => Text::default(),
        (true, ..) => text!(", and the difference is symmetric"),
        (_, true, _) => text!(", and the difference is skew-symmetric"),
    };
    let mut more: Vec<Text> = Vec::new();
    if block.of == block.with {
        more = by_terms(of, &block.of, terms);
    }
    if block.of == block.with {
        let constants = of.energies.iter().filter(|energy| energy.of == block.of);
        let differing = constants.filter(|energy| {
            let [x, y] = energy.values;
            told(x) != told(y)
        });
        more.extend(differing.map(|energy| {
            let [x, y] = energy.values;
            text!(
                "{} = {} in {a} and {} in {b}",
                energy.name.clone(),
                told(x),
                told(y)
            )
        }));
        for kernel in of.kernels.iter().filter(|kernel| kernel.of == block.of) {
            let [x, y] = kernel.left.map(|left| left <= NOTHING);
            if x != y {
                let (zero, other) = if x { (a, b) } else { (b, a) };
                more.push(text!(
                    "{} are in the kernel in {zero} and not in {other}",
                    kernel.kind
                ));
            } else if kernel.of_difference.is_some_and(|left| left <= NOTHING)
                && block.factor.is_none()
            {
                more.push(text!("the difference is 0 for {}", kernel.kind));
            }
        }
    }
    let more = match more.is_empty() {
        true => Text::default(),
        false => text!(" ({})", Text::joined(more, "; ")),
    };
    text!(
        "the matrices{coupling} differ in {} rows, {}{how}{shape}{more}",
        whole(block.differs.rows),
        located(&block.differs)
    )
}

fn load(of: &Compared, loads: &Loads, terms: &[OfTerm]) -> Text {
    let (a, b) = (&of.a, &of.b);
    let field = match of.load.len() {
        1 => Text::default(),
        _ => text!(" of `{loads.of}`"),
    };
    let [first, second] = &loads.support;
    let more = by_terms(of, &loads.of, terms);
    let how = match loads.factor {
        Some(factor) => text!(": {b}'s is {a}'s times {}", told(factor)),
        None if first.rows == 0 => text!(": {a} has none, {b}'s is {}", located(second)),
        None if second.rows == 0 => text!(": {b} has none, {a}'s is {}", located(first)),
        None if first.between != second.between || first.groups != second.groups => {
            text!(
                ": {a}'s is {}, {b}'s is {}",
                located(first),
                located(second)
            )
        }
        None if !more.is_empty() => Text::default(),
        None => text!(
            ", {} by up to {} of the largest, by no common factor",
            located(&loads.differs),
            size(loads.largest)
        ),
    };
    let more = match more.is_empty() {
        true => Text::default(),
        false => text!(" ({})", Text::joined(more, "; ")),
    };
    text!(
        "the loads{field} differ in {} rows{how}{more}",
        whole(loads.differs.rows)
    )
}

fn located(at: &Where) -> Text {
    let extent = (0..3)
        .map(|k| at.between[1][k] - at.between[0][k])
        .fold(0.0, f64::max);
    // Coordinates that are 0 up to rounding.
    let plain = |x: [f64; 3]| x.map(|x| if x.abs() <= 1e-12 * extent { 0.0 } else { x });
    let [low, high] = at.between.map(plain);
    let dim = (0..3)
        .filter(|k| low[*k] != 0.0 || high[*k] != 0.0)
        .max()
        .map_or(1, |k| k + 1);
    match &at.groups[..] {
        [_, _, ..] if at.everywhere => text!("everywhere"),
        [_, ..] => {
            let names = at.groups.iter().map(|group| text!("`{group}`"));
            text!("on {}", Text::joined(names, " and "))
        }
        [] if at.everywhere => text!("everywhere"),
        [] if low == high => text!("at {}", place(&low[..dim])),
        [] => text!("between {} and {}", place(&low[..dim]), place(&high[..dim])),
    }
}

fn kept(of: &[Kept]) -> Text {
    let names = of.iter().map(|kept| match kept {
        Kept::Identity => "as rows of the identity",
        Kept::Penalty => "by a penalty",
        Kept::Eliminated => "eliminated",
    });
    Text::joined(names, " and ")
}
