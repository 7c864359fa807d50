//! What the runs with one thing changed say of the differences of one field or number: no more than was seen.

use std::collections::BTreeSet;

use serde::Serialize;

use super::diagnosis::Change;
use super::fields::worst;
use super::{Moved, OfField, OfPair};
use crate::run::{Label, Same};
use crate::text::{Number, Text, text};
use faceoff_judge::Verdict;

/// A move explains a difference if it is at least this part of it: what moves by less leaves most of the difference.
const EXPLAINS: f64 = 0.5;
/// The other code must move by less than this part of it, or nothing says which of the two it is.
const STAYS: f64 = 0.1;

/// Two codes on the level that was run again.
pub(super) struct Pair<'a> {
    pub a: &'a str,
    pub b: &'a str,
    /// Relative, as moves are.
    pub apart: f64,
    /// By the tolerance of the field or number.
    pub agrees: bool,
}

/// What was found of one field or number.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// The field or the number, by name.
    pub of: String,
    /// What it says.
    #[serde(flatten)]
    pub cause: Cause,
    /// In a sentence, without its full stop.
    pub words: Text,
}

/// What is said of a difference.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "outcome", rename_all = "kebab-case")]
pub enum Cause {
    /// All codes but one agree.
    Odd {
        /// That one.
        code: String,
        /// The others.
        agree: Vec<String>,
    },
    /// One code moves with a change that must not move it, by as much as the two differ.
    Fault {
        /// That code.
        code: String,
        /// What was changed.
        change: Change,
    },
    /// One code moves so with the last digits of its parameters.
    Sensitive {
        /// That code.
        code: String,
    },
    /// Both move so with the last digits of their parameters.
    Rounding,
    /// Both move so with some change: nothing says which.
    Both,
    /// Nothing that was changed moves either so.
    Unexplained,
    /// Nothing does, and the codes share the problem only.
    Discretisation,
}

/// Of all pairs of one field or number: first the code that differs from the others, which agree, then each pair that differs.
pub(super) fn findings(of: &str, same: Same, pairs: &[Pair], moved: &[Moved]) -> Vec<Finding> {
    let odd = odd(pairs).map(|(code, agree)| {
        let words = odd_words(&code, &agree);
        Finding {
            of: of.to_owned(),
            words: text!("`{}`: {}", of, words),
            cause: Cause::Odd { code, agree },
        }
    });
    let differ = pairs.iter().filter(|pair| !pair.agrees);
    let each = differ.map(|pair| finding(of, same, pair, moved));
    odd.into_iter().chain(each).collect()
}

/// The pairs of a field that are judged on one level, each at its worst time.
pub(super) fn of_field<'a>(field: &'a OfField, level: &Label) -> Vec<Pair<'a>> {
    let is_judged = |p: &&OfPair| p.judged && p.level == *level;
    let codes: BTreeSet<(&str, &str)> = field
        .pairs
        .iter()
        .filter(is_judged)
        .map(|p| (&*p.a, &*p.b))
        .collect();
    let pairs = codes.into_iter().filter_map(|codes| {
        let of_codes = field.pairs.iter().filter(is_judged);
        worst(of_codes.filter(|p| (&*p.a, &*p.b) == codes))
    });
    // What could not be judged is neither equal nor different.
    let pairs = pairs.filter(|p| p.compared.field.verdict != Verdict::Undetermined);
    let pair = |p: &'a OfPair| Pair {
        a: &p.a,
        b: &p.b,
        apart: p.compared.field.max_rel,
        agrees: p.compared.field.verdict.passes(),
    };
    pairs.map(pair).collect()
}

impl OfField {
    /// In words, where on some level all codes but one of three or more agree.
    pub fn odd_one(&self) -> Option<Text> {
        let levels: BTreeSet<&Label> = self.pairs.iter().map(|pair| &pair.level).collect();
        let mut odd = levels
            .iter()
            .filter_map(|level| odd(&of_field(self, level)));
        let (code, agree) = odd.next()?;
        Some(odd_words(&code, &agree))
    }
}

/// The one code of three or more that differs from all others, which agree.
pub(super) fn odd(pairs: &[Pair]) -> Option<(String, Vec<String>)> {
    let mut codes: Vec<&str> = pairs.iter().flat_map(|pair| [pair.a, pair.b]).collect();
    codes.sort_unstable();
    codes.dedup();
    // Of recorded answers not every two are a pair, so that nothing follows.
    if codes.len() < 3 || pairs.len() != codes.len() * (codes.len() - 1) / 2 {
        return None;
    }
    let is_odd = |code: &&str| {
        let is_of = |pair: &Pair| pair.a == *code || pair.b == *code;
        pairs.iter().all(|pair| pair.agrees != is_of(pair))
    };
    let code = *codes.iter().find(|code| is_odd(code))?;
    let others = codes.iter().filter(|other| **other != code);
    Some((code.to_owned(), others.map(|c| (*c).to_owned()).collect()))
}

pub(super) fn odd_words(code: &str, agree: &[String]) -> Text {
    text!("{} agree; {} differs", agree.join(" and "), code)
}

fn finding(of: &str, same: Same, pair: &Pair, moved: &[Moved]) -> Finding {
    let (a, b, apart) = (pair.a, pair.b, pair.apart);
    let most = |code: &str, is_rounding: bool| {
        let of_code = moved.iter().filter(|m| m.code == code && m.of == of);
        let of_kind = of_code.filter(|m| (m.change == Change::Rounding) == is_rounding);
        let moves = of_kind.filter_map(|m| Some((m.relative?, m.change)));
        moves.max_by(|a, b| a.0.total_cmp(&b.0))
    };
    let [with_order, with_digits] = [false, true].map(|k| {
        let moves = [most(a, k), most(b, k)];
        let is_explained = moves
            .iter()
            .flatten()
            .any(|(by, _)| apart > 0.0 && *by >= EXPLAINS * apart);
        moves.map(|of| of.filter(|(by, _)| is_explained && *by >= STAYS * apart))
    });
    let (cause, words) = match (with_order, with_digits) {
        (_, [Some((by, _)), Some(_)]) => (
            Cause::Rounding,
            text!(
                "{} and {} both move as far as they are apart ({} of it) with {}: the problem is so conditioned that \
                 rounding decides",
                a,
                b,
                Number::new(by, 2),
                Change::Rounding.words()
            ),
        ),
        ([Some((by, change)), Some((by_b, change_b))], _) => (
            Cause::Both,
            text!(
                "{} moves by {} of it with {}, {} by {} with {}, as far as they are apart: what they \
                 compute is not determined to more",
                a,
                Number::new(by, 2),
                change.words(),
                b,
                Number::new(by_b, 2),
                change_b.words()
            ),
        ),
        ([Some(by), None], _) => fault(a, by),
        ([None, Some(by)], _) => fault(b, by),
        (_, [Some((by, _)), None]) => sensitive(a, by),
        (_, [None, Some((by, _))]) => sensitive(b, by),
        _ if same == Same::Problem => (
            Cause::Discretisation,
            text!(
                "{} and {} differ by {} of it, more than is allowed; nothing that was changed explains it. Their \
                 discretisations differ, which may be all: finer meshes tell",
                a,
                b,
                Number::new(apart, 2)
            ),
        ),
        _ => (
            Cause::Unexplained,
            text!(
                "nothing that was changed explains why {} and {} differ by {} of it",
                a,
                b,
                Number::new(apart, 2)
            ),
        ),
    };
    Finding {
        of: of.to_owned(),
        cause,
        words: text!("`{}`: {}", of, words),
    }
}

fn fault(code: &str, (by, change): (f64, Change)) -> (Cause, Text) {
    let words = text!(
        "{} moves by {} of it with {}, as far as the codes are apart, and must not: look for the fault there, or for what leaves the answer open, as the sign of a mode",
        code,
        Number::new(by, 2),
        change.words()
    );
    let code = code.to_owned();
    (Cause::Fault { code, change }, words)
}

fn sensitive(code: &str, by: f64) -> (Cause, Text) {
    let words = text!(
        "{} moves by {} of it with {}, as far as the codes are apart, and the other does not: it is the one that \
         loses digits",
        code,
        Number::new(by, 2),
        Change::Rounding.words()
    );
    let code = code.to_owned();
    (Cause::Sensitive { code }, words)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROUNDING: Change = Change::Rounding;
    const CELLS: Change = Change::Cells;

    fn moved(code: &str, change: Change, by: f64) -> Moved {
        Moved {
            code: code.into(),
            change,
            of: "u".into(),
            relative: Some(by),
            reason: None,
        }
    }

    fn of(same: Same, pairs: &[(&str, &str, f64, bool)], moved: &[Moved]) -> Vec<Cause> {
        let pair = |&(a, b, apart, agrees): &(_, _, f64, bool)| Pair {
            a,
            b,
            apart,
            agrees,
        };
        let pairs: Vec<Pair> = pairs.iter().map(pair).collect();
        let found = findings("u", same, &pairs, moved);
        assert!(
            found
                .iter()
                .all(|f| !f.words.to_string().contains("different problems"))
        );
        found.into_iter().map(|f| f.cause).collect()
    }

    /// What agrees by its own tolerance is not spoken of, however it moves.
    #[test]
    fn codes_that_agree_are_not_accused() {
        let moves = [moved("a", CELLS, 4.3e-16)];
        assert!(of(Same::Discretisation, &[("a", "b", 4.3e-16, true)], &moves).is_empty());
        let three = [
            ("a", "b", 4e-13, true),
            ("a", "c", 1e-2, false),
            ("b", "c", 1e-2, false),
        ];
        let found = of(Same::Discretisation, &three, &[]);
        let odd = Cause::Odd {
            code: "c".into(),
            agree: vec!["a".into(), "b".into()],
        };
        assert_eq!(found, [odd, Cause::Unexplained, Cause::Unexplained]);
    }

    #[test]
    fn a_code_is_at_fault_only_if_its_move_explains_the_difference() {
        let apart = [("a", "b", 1e-2, false)];
        let fault = Cause::Fault {
            code: "a".into(),
            change: CELLS,
        };
        let by = |by| of(Same::Discretisation, &apart, &[moved("a", CELLS, by)]);
        assert_eq!(by(1e-2), [fault]);
        assert_eq!(by(2e-3), [Cause::Unexplained]);
        let both = [moved("a", CELLS, 1.0), moved("b", CELLS, 1.0)];
        assert_eq!(of(Same::Discretisation, &apart, &both), [Cause::Both]);
        let both = [moved("a", ROUNDING, 1.0), moved("b", ROUNDING, 1.0)];
        assert_eq!(of(Same::Discretisation, &apart, &both), [Cause::Rounding]);
        let both = [moved("a", ROUNDING, 1e-2), moved("b", ROUNDING, 4e-3)];
        assert_eq!(of(Same::Discretisation, &apart, &both), [Cause::Rounding]);
        let one = of(Same::Discretisation, &apart, &[moved("b", ROUNDING, 1.0)]);
        assert_eq!(one, [Cause::Sensitive { code: "b".into() }]);
        assert_eq!(of(Same::Problem, &apart, &[]), [Cause::Discretisation]);
    }

    #[test]
    fn of_several_faults_none_is_the_odd_one() {
        let pairs = [
            ("a", "b", 1e-2, false),
            ("a", "c", 1e-2, false),
            ("b", "c", 1e-2, false),
        ];
        assert_eq!(
            of(Same::Problem, &pairs, &[]),
            vec![Cause::Discretisation; 3]
        );
        let only_one = [
            ("a", "b", 0.0, true),
            ("a", "c", 0.0, true),
            ("b", "c", 1e-2, false),
        ];
        assert_eq!(of(Same::Problem, &only_one, &[]).len(), 1);
        let recorded = [("a", "b", 1e-2, false), ("a", "c", 1e-2, false)];
        assert_eq!(of(Same::Problem, &recorded, &[]).len(), 2);
    }
}
