//! What the runs with one thing changed say of the differences of one field or number: no more than was seen.

use std::collections::BTreeSet;

use serde::Serialize;

use super::fields::worst;
use super::{Apart, Moved, OfField, OfPair};
use crate::engine::unique;
use crate::run::{Label, Same};
use crate::text::{Number, Text, text};
use crate::why::Change;
use faceoff_judge::Verdict;

/// A move explains a difference if it is at least this part of it: what moves by less leaves most of the difference.
const EXPLAINS: f64 = 0.5;
/// The other code must move by less than this part of it, or nothing says which of the two it is.
const STAYS: f64 = 0.1;

/// What a parameter, changed by a tenth, moves a code by, for anything to be said of it.
const MOVES: f64 = 1e-6;

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
    /// A parameter, changed by a tenth, moves one code otherwise than the other.
    Parameter {
        /// Its name.
        parameter: String,
        /// The two codes.
        codes: [String; 2],
        /// How far it moves either.
        moves: [f64; 2],
        /// Do they agree with its value in the file, but not with another?
        only_here: bool,
    },
    /// Nothing that was changed moves either so.
    Unexplained,
    /// Nothing does, and the codes share the problem only.
    Discretisation,
}

/// Of all pairs of one field or number: first the code that differs from the others, which agree, then each pair that differs, or
/// that parameters move otherwise.
pub(super) fn findings(
    of: &str,
    same: Same,
    pairs: &[Pair],
    (moved, apart): (&[Moved], &[Apart]),
) -> Vec<Finding> {
    let odd = odd(pairs).map(|(code, agree)| {
        let words = odd_words(&code, &agree);
        Finding {
            of: of.to_owned(),
            words: text!("`{}`: {}", of, words),
            cause: Cause::Odd { code, agree },
        }
    });
    let each = pairs.iter().flat_map(|pair| {
        let mut found = by_parameters(of, same, pair, moved, apart);
        if !pair.agrees {
            let by_order = finding(of, same, pair, moved);
            let is_open = matches!(by_order.cause, Cause::Unexplained | Cause::Discretisation);
            if !is_open || found.is_empty() {
                found.insert(0, by_order);
            }
        }
        found
    });
    odd.into_iter().chain(each).collect()
}

/// The parameters that two codes take otherwise: each, changed by a tenth, moves one of them by more than the other, or takes
/// apart what agrees with the value in the file.
fn by_parameters(
    of: &str,
    same: Same,
    pair: &Pair,
    moved: &[Moved],
    apart: &[Apart],
) -> Vec<Finding> {
    let codes = [pair.a, pair.b];
    let of_code = |code: &'_ str| {
        let rows = moved.iter().filter(move |m| m.of == of);
        let code = code.to_owned();
        rows.filter(move |m| m.code == code)
    };
    let names = moved.iter().filter_map(|m| match &m.change {
        Change::Parameter(name, _) => Some(name),
        _ => None,
    });
    let of_name = |name: &String| {
        let is_of = |change: &Change| matches!(change, Change::Parameter(of, _) if of == name);
        let by = codes.map(|code| {
            let moves = of_code(code).filter(|m| is_of(&m.change));
            moves.filter_map(|m| m.relative).max_by(f64::total_cmp)
        });
        let moves = [by[0]?, by[1]?];
        let again = codes.map(|code| {
            let again = of_code(code).find(|m| m.change == Change::Again);
            again.and_then(|m| m.relative).unwrap_or(0.0)
        });
        let noise = 10.0 * again[0].max(again[1]);
        let (least, most) = (moves[0].min(moves[1]), moves[0].max(moves[1]));
        // Two discretisations feel a parameter alike, but for their errors.
        let share = match same {
            Same::Discretisation => 0.1,
            Same::Problem => 0.5,
        };
        let takes_otherwise = most > MOVES.max(noise) && most - least > share * most;
        let broken = apart
            .iter()
            .filter(|row| is_of(&row.change) && row.of == of);
        let broken = broken.filter(|row| [&*row.a, &*row.b] == codes && !row.agrees && pair.agrees);
        let broken = broken.max_by(|x, y| x.relative.total_cmp(&y.relative));
        // What is not a number is as far as can be.
        let broken = broken.filter(|row| !(row.relative <= noise));
        if !takes_otherwise && broken.is_none() {
            return None;
        }
        let [a, b] = codes;
        let words = match least <= f64::EPSILON.max(noise) {
            _ if !takes_otherwise => text!("`{}` moves {} and {} to different answers", name, a, b),
            true => {
                let [stays, moves] = if moves[0] < moves[1] { [a, b] } else { [b, a] };
                text!(
                    "`{}` does not move {}; changed by a tenth, it moves {} by {} of it",
                    name,
                    stays,
                    moves,
                    Number::new(most, 2)
                )
            }
            false => text!(
                "`{}`, changed by a tenth, moves {} by {} of it and {} by {}",
                name,
                a,
                Number::new(moves[0], 2),
                b,
                Number::new(moves[1], 2)
            ),
        };
        let words = match broken {
            None => words,
            Some(row) => text!(
                "{}: they agree with the value that it has, and with {} they are {} of it apart",
                words,
                row.change.words(),
                Number::new(row.relative, 2)
            ),
        };
        Some(Finding {
            of: of.to_owned(),
            cause: Cause::Parameter {
                parameter: name.clone(),
                codes: codes.map(str::to_owned),
                moves,
                only_here: broken.is_some(),
            },
            words: text!("`{}`: {}", of, words),
        })
    };
    unique(names).into_iter().filter_map(of_name).collect()
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
    /// A sentence, where on some level all codes but one of three or more agree.
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
        let of_kind = of_code.filter(|m| match m.change {
            Change::Parameter(..) => false,
            _ => (m.change == Change::Rounding) == is_rounding,
        });
        let moves = of_kind.filter_map(|m| Some((m.relative?, &m.change)));
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

fn fault(code: &str, (by, change): (f64, &Change)) -> (Cause, Text) {
    let advice = match change {
        Change::Tolerances => "it stops too early",
        _ => {
            "and must not: look for the fault there, or for what leaves the answer open, as the sign of a mode"
        }
    };
    let words = text!(
        "{} moves by {} of it with {}, as far as the codes are apart{}{}",
        code,
        Number::new(by, 2),
        change.words(),
        if *change == Change::Tolerances {
            ": "
        } else {
            ", "
        },
        advice
    );
    let (code, change) = (code.to_owned(), change.clone());
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
    const TOLERANCES: Change = Change::Tolerances;

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
        let found = findings("u", same, &pairs, (moved, &[]));
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
    fn parameters_that_codes_take_otherwise_are_named() {
        let nu = |percent| Change::Parameter("nu".into(), percent);
        let of = |same, agrees, by: [f64; 2], apart: f64| {
            let pair = Pair {
                a: "a",
                b: "b",
                apart: 1e-3,
                agrees,
            };
            let row = Apart {
                a: "a".into(),
                b: "b".into(),
                change: nu(110),
                of: "u".into(),
                relative: apart,
                agrees: apart < 1e-9,
            };
            let moved = [moved("a", nu(110), by[0]), moved("b", nu(90), by[1])];
            let found = findings("u", same, &[pair], (&moved, &[row]));
            let words: Vec<String> = found.iter().map(|f| f.words.to_string()).collect();
            words.join("\n")
        };
        let all = Same::Discretisation;
        assert_eq!(
            of(all, false, [0.1, 0.1], 1.0),
            "`u`: nothing that was changed explains why a and b differ by 1.0e-3 of it"
        );
        assert_eq!(
            of(all, false, [0.1, 0.2], 1.0),
            "`u`: `nu`, changed by a tenth, moves a by 1.0e-1 of it and b by 2.0e-1"
        );
        assert_eq!(
            of(all, false, [0.1, 0.0], 1.0),
            "`u`: `nu` does not move b; changed by a tenth, it moves a by 1.0e-1 of it"
        );
        assert_eq!(of(all, true, [0.1, 0.1], 0.0), "");
        assert_eq!(
            of(all, true, [0.1, 0.1], 0.05),
            "`u`: `nu` moves a and b to different answers: they agree with the value that it has, and with nu times 1.1 they are \
             5.0e-2 of it apart"
        );
        // Their errors are not the same.
        assert_eq!(of(Same::Problem, true, [0.1, 0.13], 0.0), "");
        assert!(of(Same::Problem, true, [0.1, 0.0], 0.0).contains("does not move b"));
    }

    #[test]
    fn what_stops_too_early_is_told() {
        let apart = [("a", "b", 1e-2, false)];
        let found = of(
            Same::Discretisation,
            &apart,
            &[moved("a", TOLERANCES, 1e-2)],
        );
        let fault = Cause::Fault {
            code: "a".into(),
            change: TOLERANCES,
        };
        assert_eq!(found, [fault]);
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
