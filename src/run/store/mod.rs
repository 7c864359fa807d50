//! Stored answers: in a journal, from which an interrupted run is resumed, or in a record, which replaces codes that are not installed.
//!
//! Both consist of entries. An entry is valid if the current inputs equal those at the time of the answer. The inputs are everything that
//! the answer depends on: the problem, and, if the program is installed, the program with the files that it reads. The files of an
//! entry must have the recorded digests.

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
    /// The name of the engine; may be empty.
    by: String,
    /// A description of the case: `one-zone, cr, n = 4`; empty if there is only one.
    at: String,
    /// All inputs.
    asked: Value,
    found: Value,
    /// Data that changed during the run: files that a program writes to its folder are not among its inputs. Its scripts, and
    /// the files that its command names, always are.
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

/// The engine and the case: `rust: one-zone, cr, n = 4`.
fn name([by, at]: [&str; 2]) -> String {
    match (by, at) {
        (one, "") | ("", one) => one.to_owned(),
        _ => format!("{by}: {at}"),
    }
}
