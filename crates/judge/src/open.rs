//! What a problem may leave open in a field, and what was removed from it, as numbers and as text.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// What the problem leaves open in a field, on each connected part of the mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum UpTo {
    /// A constant for each component, such as that of a pressure if the velocity is prescribed on the whole boundary.
    Constant,
    /// The sign, such as that of an eigenvector.
    Sign,
    /// A real factor other than 0.
    Scale,
    /// A complex factor of modulus 1; components alternate between real and imaginary parts.
    Phase,
    /// A translation and an infinitesimal rotation, such as those of a body without supports.
    Rigid,
    /// The gradient of a continuous function that is linear on each cell, as in a vector potential.
    Gradient,
}

impl UpTo {
    /// All of them.
    pub const ALL: [UpTo; 6] = [
        UpTo::Constant,
        UpTo::Sign,
        UpTo::Scale,
        UpTo::Phase,
        UpTo::Rigid,
        UpTo::Gradient,
    ];

    /// The name on the command line.
    pub fn word(self) -> &'static str {
        match self {
            UpTo::Constant => "constant",
            UpTo::Sign => "sign",
            UpTo::Scale => "scale",
            UpTo::Phase => "phase",
            UpTo::Rigid => "rigid",
            UpTo::Gradient => "gradient",
        }
    }

    /// Does it multiply, rather than add?
    pub(crate) fn is_factor(self) -> bool {
        matches!(self, UpTo::Sign | UpTo::Scale | UpTo::Phase)
    }
}

impl FromStr for UpTo {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = UpTo::ALL.into_iter().find(|one| one.word() == text);
        found.ok_or_else(|| {
            let all = UpTo::ALL.map(UpTo::word).join(", ");
            format!("`{text}` is not something that a problem leaves open: give one of {all}")
        })
    }
}

/// What was removed from a field before it was compared.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Removed {
    /// What was left open.
    pub up_to: UpTo,
    /// The inner product of the projection.
    pub over: Over,
    /// One for each connected part of the mesh.
    pub parts: Vec<RemovedPart>,
}

/// The inner product of a projection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Over {
    /// Integrals over the cells.
    Cells,
    /// Sums over the values in the file, with equal weights, if the file has no cells on which the field is a function.
    Values,
}

/// What was removed on one connected part of the mesh.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct RemovedPart {
    /// The centre of the part.
    pub centre: Vec<f64>,
    /// Its area or volume, or the number of its values.
    pub measure: f64,
    /// Subtracted from the first: a constant for each component, then the rotation (one number in 2D, three in 3D); for a gradient its
    /// root mean square. Empty if the second is multiplied.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub of_a: Vec<f64>,
    /// Subtracted from the second, after its multiplication if a factor is left open as well.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub of_b: Vec<f64>,
    /// Real and imaginary part of the factor of the second.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub factor: Option<[f64; 2]>,
    /// The root mean square of the change of the second relative to the first, in the unit of the field.
    pub size: f64,
}

impl Removed {
    /// The part with the largest change.
    fn largest(&self) -> Option<&RemovedPart> {
        self.parts.iter().max_by(|p, q| p.size.total_cmp(&q.size))
    }

    /// The change that makes the second result equal to the first, as in "adding 0.342 to b"; `a` and `b` are the names of the results.
    pub fn words(&self, [a, b]: [&str; 2]) -> String {
        let Some(part) = self.largest() else {
            return "removing nothing".into();
        };
        let moved: Vec<f64> = part
            .of_a
            .iter()
            .zip(&part.of_b)
            .map(|(a, b)| a - b)
            .collect();
        let split = match (self.up_to, moved.len()) {
            (UpTo::Rigid, n) if n >= 6 => 3,
            (UpTo::Rigid, n) => n.saturating_sub(1),
            (_, n) => n,
        };
        let (shift, turn) = moved.split_at(split);
        let [re, im] = part.factor.unwrap_or([1.0, 0.0]);
        let what = match self.up_to {
            UpTo::Constant => format!("adding {} to {b}", tuple(shift)),
            UpTo::Rigid => format!(
                "adding to {b} the translation {} and the rotation {}",
                tuple(shift),
                tuple(turn)
            ),
            UpTo::Gradient => format!(
                "removing gradients of size {} from {a} and {} from {b}",
                tuple(&part.of_a),
                tuple(&part.of_b)
            ),
            UpTo::Sign if re > 0.0 => format!("keeping the sign of {b}"),
            UpTo::Sign => format!("changing the sign of {b}"),
            UpTo::Scale => format!("multiplying {b} by {}", short(re)),
            UpTo::Phase => format!(
                "turning the phase of {b} by {}°",
                short(im.atan2(re).to_degrees())
            ),
        };
        let over = match self.over {
            Over::Cells => "",
            Over::Values => ", by the values, as no cells are known",
        };
        match self.parts.len() {
            1 => format!("{what}{over}"),
            n => format!("{what} on one of {n} connected parts{over}"),
        }
    }
}

/// The changes that make the second result equal to the first, in order, as in "changing the sign of b and adding 0.342 to b".
pub fn removed_words(all: &[Removed], names: [&str; 2]) -> String {
    // Signs before constants, since they refer to the original fields.
    let mut all: Vec<&Removed> = all.iter().collect();
    all.sort_by_key(|removed| !removed.up_to.is_factor());
    let words: Vec<String> = all.iter().map(|removed| removed.words(names)).collect();
    words.join(" and ")
}

/// The number with four digits.
fn short(x: f64) -> String {
    let rounded: f64 = format!("{x:.3e}").parse().unwrap_or(x);
    match rounded != 0.0 && !(1e-3..1e6).contains(&rounded.abs()) {
        true => format!("{rounded:e}"),
        false => rounded.to_string(),
    }
}

fn tuple(numbers: &[f64]) -> String {
    let all: Vec<String> = numbers.iter().map(|x| short(*x)).collect();
    match &all[..] {
        [one] => one.clone(),
        all => format!("({})", all.join(", ")),
    }
}
