//! Answers to images of a problem.

use super::model::{Block, TestCase, table};
use crate::campaigns::face_off::{OfImage, Symmetries};
use crate::text::number::size;
use crate::text::{Text, text};
use faceoff_judge::Verdict;

/// How far each answer is from the image of the answer.
pub(super) fn table(of: &Symmetries) -> Block<'_> {
    let n = of.n.map_or(String::new(), |n| format!(", n = {n}"));
    let rows = table!("", &of.rows, |row|
        "code" => &row.code,
        "image" => row.image.words(),
        "of" => &row.of,
        "changes by" => row.relative,
        "allowed" => row.allowed,
        "verdict" => row.verdict,
        "remark" => row.reason.clone(),
    );
    Block::Titled(text!("Answers to images of the problem{n}"), rows)
}

/// The code whose answer does not move with the problem; none where all do.
pub(super) fn claim(of: &Symmetries) -> Option<Text> {
    let wrong = |row: &&OfImage| row.verdict == Verdict::Disagree;
    let row = of
        .rows
        .iter()
        .find(wrong)
        .filter(|_| !of.verdict.passes())?;
    Some(match of.verdict {
        Verdict::Undetermined => text!("`{row.of}` does not move with the problem in any code"),
        _ => {
            let words = row.image.words();
            text!("`{row.of}` of **{row.code}** changes with {words}")
        }
    })
}

/// A case for each answer to an image. One that no code keeps is open.
pub(super) fn cases(suite: &str, of: &Symmetries) -> impl Iterator<Item = TestCase> {
    of.rows.iter().map(move |row| {
        let name = format!("{} of {}, {}", row.of, row.code, row.image.words());
        let verdict = match (row.verdict, of.verdict) {
            (Verdict::Disagree, Verdict::Undetermined) => Verdict::Undetermined,
            (verdict, _) => verdict,
        };
        let far = row.relative.map(|far| format!("changes by {}", size(far)));
        let why = match row.verdict.passes() {
            true => String::new(),
            false => row.reason.clone().or(far).unwrap_or_default(),
        };
        TestCase::new(suite, name, verdict, why)
    })
}
