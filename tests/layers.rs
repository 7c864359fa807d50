//! Imports point one way. The table says which module may use which; the `use` lines, and the
//! paths in the code, are held against it. Above all: the judge never imports the judged.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Module, and what it may use besides itself. Everything may use `error`.
const LAYERS: [(&str, &[&str]); 26] = [
    ("error", &[]),
    ("drawing", &[]),
    ("quadrature", &[]),
    ("linear", &[]),
    ("truth", &[]),
    ("mesh", &[]),
    ("field", &["mesh"]),
    ("compare", &["field"]),
    ("io", &["mesh", "field"]),
    ("scene", &["mesh", "io", "quadrature", "truth"]),
    ("element", &["mesh"]),
    (
        "assembly",
        &["mesh", "scene", "element", "quadrature", "linear"],
    ),
    (
        "contact",
        &[
            "mesh",
            "field",
            "scene",
            "element",
            "quadrature",
            "assembly",
            "linear",
        ],
    ),
    (
        "certify",
        &[
            "mesh",
            "scene",
            "element",
            "quadrature",
            "assembly",
            "linear",
            "contact",
        ],
    ),
    ("adapt", &["mesh", "scene", "contact", "linear", "certify"]),
    ("orders", &["truth", "compare", "scene", "contact"]),
    ("engine", &["scene", "contact", "quadrature", "linear"]),
    (
        "verify",
        &[
            "mesh",
            "field",
            "scene",
            "contact",
            "certify",
            "engine",
            "compare",
            "quadrature",
        ],
    ),
    (
        "diagnose",
        &[
            "mesh",
            "field",
            "scene",
            "contact",
            "engine",
            "compare",
            "linear",
            "quadrature",
            "verify",
        ],
    ),
    (
        "paper",
        &[
            "drawing",
            "truth",
            "quadrature",
            "mesh",
            "scene",
            "element",
            "contact",
            "orders",
            "engine",
            "verify",
        ],
    ),
    (
        "study",
        &[
            "drawing",
            "truth",
            "quadrature",
            "linear",
            "mesh",
            "scene",
            "contact",
            "certify",
            "adapt",
            "engine",
            "paper",
        ],
    ),
    (
        "stress",
        &[
            "drawing", "truth", "linear", "mesh", "scene", "element", "contact", "engine",
        ],
    ),
    (
        "report",
        &[
            "mesh", "field", "io", "contact", "certify", "engine", "compare", "verify", "scene",
            "diagnose",
        ],
    ),
    (
        "cli",
        &[
            "adapt", "certify", "compare", "contact", "engine", "field", "linear", "mesh", "io",
            "orders", "paper", "report", "diagnose", "scene", "stress", "study", "verify",
        ],
    ),
    ("main", &["cli"]),
    ("lib", &[]),
];

#[test]
fn imports_point_one_way() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let table: BTreeMap<_, _> = LAYERS.into_iter().collect();
    let mut used: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    let mut faults = Vec::new();
    for path in rust_files(&root) {
        let inside = path.strip_prefix(&root).unwrap();
        let module = inside.iter().next().unwrap().to_string_lossy();
        let module = module.trim_end_matches(".rs").to_owned();
        let Some(allowed) = table.get(module.as_str()) else {
            faults.push(format!("{module} is not in the table"));
            continue;
        };
        let text = std::fs::read_to_string(&path).unwrap();
        for name in crate_paths(&text) {
            used.entry(module.clone()).or_default().insert(name.clone());
            if name != module && name != "error" && !allowed.contains(&name.as_str()) {
                faults.push(format!("{} uses {name}", inside.display()));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    // The reading itself must see imports, or the test could not fail.
    assert!(used["compare"].contains("field") && used["cli"].contains("verify"));
    // No circles: along the table a module only ever uses what stands above it.
    for (k, (module, allowed)) in LAYERS.iter().enumerate() {
        for name in *allowed {
            let place = LAYERS.iter().position(|(other, _)| other == name).unwrap();
            assert!(place < k, "{module} may use {name}, which stands below it");
        }
    }
}

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
    files
}

/// The first names of all paths that start with `crate::`, test modules and comments left out.
fn crate_paths(text: &str) -> BTreeSet<String> {
    let code = text.split("#[cfg(test)]").next().unwrap();
    let code: String = code
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"))
        .collect::<Vec<_>>()
        .join("\n");
    code.match_indices("crate::")
        .filter(|(k, _)| {
            !code[..*k].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == '$')
        })
        .map(|(k, found)| {
            let rest = &code[k + found.len()..];
            let end = rest
                .find(|c: char| !c.is_alphanumeric() && c != '_')
                .unwrap_or(rest.len());
            rest[..end].to_owned()
        })
        .collect()
}
