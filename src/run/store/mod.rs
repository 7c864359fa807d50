//! What was answered, kept: in a journal, from which an interrupted run goes on, or in a record, which stands in for codes that are not here.
//!
//! Both hold entries, and of every entry one question is asked: is what would be asked now what was asked then? What is asked is all that
//! the answer depends on: the problem, and of a program that is here also the program with the files that it reads. Files that belong to an
//! entry must have the digests that they had.

mod answer;
mod files;
mod journal;
mod record;
mod recorded;

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};
use serde_json::Value;

pub use answer::{Kept, identity};
pub use files::Store;
pub use journal::Journal;
pub use record::{BASELINE, Record};

/// One answer.
#[derive(Debug, Serialize, Deserialize)]
struct Entry {
    /// Who gave it; may be empty.
    by: String,
    /// To what, in words: `one-zone, cr, n = 4`; empty where there is one question alone.
    at: String,
    /// All that it depends on.
    asked: Value,
    found: Value,
    /// Data that were changed while it was found: what a program writes beside itself is no part of what it depends on. Its scripts, and
    /// what its command names, always are.
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    wrote: BTreeSet<String>,
}

/// The first key whose values differ, with both: `gamma0 was 100.0 and is 10.0`.
fn first_difference(at: &str, kept: &Value, asked: &Value) -> Option<String> {
    if let (Value::Object(of_kept), Value::Object(of_asked)) = (kept, asked) {
        let keys = of_kept.keys().chain(of_asked.keys());
        return keys
            .into_iter()
            .find_map(|key| first_difference(key, &kept[key], &asked[key]));
    }
    (kept != asked).then(|| format!("{at} was {kept} and is {asked}"))
}

/// Whose entry it is, and of what: `rust: one-zone, cr, n = 4`.
fn name([by, at]: [&str; 2]) -> String {
    match (by, at) {
        (one, "") | ("", one) => one.to_owned(),
        _ => format!("{by}: {at}"),
    }
}
