//! Pages and comments are in plain English: subject, verb, object, and the terms of the field. Phrases that once were frequent
//! and read badly are named here with what to write instead; `codespell`, which `tests/run` calls, checks the spelling.

use std::fs;
use std::path::{Path, PathBuf};

use crate::common::source;

/// Phrases in lower case, and what to write instead.
const BANNED: [(&str, &str); 25] = [
    (
        "so many",
        "name the number: `count` rows, at most MOST bytes",
    ),
    ("so much", "name the amount"),
    ("whole number", "integer"),
    ("whole numbers", "integers"),
    ("in place of", "instead of"),
    ("beside", "next to; in the same folder"),
    ("told", "reported, printed, recorded"),
    ("tells", "reports, prints, states"),
    ("alone", "only, before the word that it limits"),
    ("of one's own", "your, separate"),
    ("of a user's own", "the user's, separate"),
    ("of yours", "your"),
    ("stranger's", "untrusted"),
    ("strangers", "untrusted"),
    ("mend", "repair, fix"),
    ("mended", "repaired, fixed"),
    ("lend", "borrow"),
    ("thrown away", "discarded"),
    ("as it stands", "unchanged"),
    ("as they stand", "unchanged"),
    ("knows nothing", "does not depend on"),
    ("in words", "with a message"),
    ("whoever", "name the person or the program"),
    ("cells of second order", "quadratic cells"),
    ("one dimension less", "facets"),
];

/// Words that may follow `is no`.
const AFTER_NO: [&str; 26] = [
    "", "better", "cheaper", "closer", "earlier", "farther", "faster", "fewer", "finer", "greater",
    "higher", "larger", "later", "less", "longer", "lower", "more", "nearer", "need", "reason",
    "shorter", "slower", "smaller", "tighter", "wider", "worse",
];

/// The clauses of a line, without code in backticks: a phrase does not go over a full stop.
fn clauses(line: &str) -> Vec<String> {
    let parts: Vec<&str> = line.split('`').collect();
    let plain = match parts.len() % 2 {
        1 => parts
            .iter()
            .step_by(2)
            .copied()
            .collect::<Vec<_>>()
            .join(" x "),
        _ => line.to_owned(),
    };
    let marked = [". ", "; ", ": ", "? ", "| ", " ("]
        .iter()
        .fold(plain, |text, mark| text.replace(mark, "\n"));
    marked.lines().map(str::to_lowercase).collect()
}

/// The phrases in a line that are banned, each with what to write instead.
fn faults(line: &str) -> Vec<String> {
    let mut found = Vec::new();
    for clause in clauses(line) {
        let words: Vec<&str> = clause
            .split(|c: char| !c.is_alphanumeric() && !"'’._".contains(c))
            .map(|word| word.trim_matches(['\'', '’', '.', '_']))
            .filter(|word| !word.is_empty())
            .collect();
        for (phrase, instead) in BANNED {
            let phrase: Vec<&str> = phrase.split(' ').collect();
            if words.windows(phrase.len()).any(|at| at == phrase) {
                found.push(format!("`{}`: {instead}", phrase.join(" ")));
            }
        }
        for (k, word) in words.iter().enumerate() {
            let at = |k: usize| words.get(k).copied().unwrap_or_default();
            let (next, after) = (at(k + 1), at(k + 2));
            if matches!(*word, "stand" | "stands") && next != "for" {
                found.push(format!("`{word} {next}`: is, is in, comes"));
            }
            // "There is no file" and "is no larger" are English; "is no number" is not.
            let is_usual = k.checked_sub(1).map(at) == Some("there") || AFTER_NO.contains(&after);
            if matches!(*word, "is" | "are" | "was" | "were") && next == "no" && !is_usual {
                found.push(format!("`{word} no {after}`: {word} not a"));
            }
        }
    }
    found
}

/// The files with an ending of this folder and those below.
fn files(folder: &Path, ending: &str, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, ending, found);
        } else if path.extension().is_some_and(|e| e == ending) {
            found.push(path);
        }
    }
}

/// The part of a line of Rust that is a comment.
fn comment(line: &str) -> &str {
    match line.trim_start().starts_with("//") {
        true => line,
        false => line.split_once(" // ").map_or("", |(_, comment)| comment),
    }
}

#[test]
fn no_banned_words() {
    let mut pages = Vec::new();
    files(&source("docs"), "md", &mut pages);
    let further = [
        "README.md",
        "ARCHITECTURE.md",
        "CONTRIBUTING.md",
        "SECURITY.md",
        "CHANGELOG.md",
    ];
    pages.extend(further.map(source));
    let mut code = Vec::new();
    files(&source("src"), "rs", &mut code);
    for entry in fs::read_dir(source("crates")).unwrap() {
        files(&entry.unwrap().path().join("src"), "rs", &mut code);
    }
    assert!(pages.len() > 30 && code.len() > 400, "{}", code.len());
    let mut all = Vec::new();
    for path in pages.iter().chain(&code) {
        let name = path.strip_prefix(source("")).unwrap();
        let is_code = path.extension().is_some_and(|e| e == "rs");
        let mut is_example = false;
        for (k, line) in fs::read_to_string(path).unwrap().lines().enumerate() {
            let text = if is_code { comment(line) } else { line };
            // The code of an example in a comment is not prose.
            is_example ^= is_code && text.contains("```");
            if is_example {
                continue;
            }
            for fault in faults(text) {
                all.push(format!("{}:{}: {fault}", name.display(), k + 1));
            }
        }
    }
    assert!(all.is_empty(), "{} phrases\n{}", all.len(), all.join("\n"));
}

#[test]
fn phrases_are_found_as_words() {
    for (line, count) in [
        ("/// A row of so many bytes, beside it.", 2),
        ("x is no number, and there is no file", 1),
        ("this is no larger, and there are no more", 0),
        ("γ₀ stands for a number, aloneness", 0),
        ("What stands there is told alone.", 3),
        ("docs/strangers.md, and `beside` of `told`", 0),
        ("The data are no longer there. No data are read", 0),
    ] {
        assert_eq!(faults(line).len(), count, "{line}: {:?}", faults(line));
    }
}
