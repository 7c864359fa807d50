//! Names with `*` and `?`, as a shell has them.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// Whether this is a pattern rather than the name of a file that exists.
pub fn is_pattern(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.contains(['*', '?']) && !path.exists()
}

/// Whether a name matches a pattern, in which `*` stands for any characters and `?` for one. In time proportional to the product
/// of their lengths.
///
/// ```
/// use faceoff_mesh::io::matches;
///
/// assert!(matches("u*", "u_0001.vtu") && matches("*.vt?", "a.vtu") && !matches("u", "uv"));
/// ```
pub fn matches(pattern: &str, name: &str) -> bool {
    let (pattern, name): (Vec<char>, Vec<char>) =
        (pattern.chars().collect(), name.chars().collect());
    let (mut p, mut n) = (0, 0);
    // Behind the last star, and what of the name that star has taken so far.
    let mut star = None;
    while n < name.len() {
        match pattern.get(p) {
            Some('*') => {
                star = Some((p + 1, n));
                p += 1;
            }
            Some(c) if *c == '?' || *c == name[n] => (p, n) = (p + 1, n + 1),
            _ => {
                let Some((after, taken)) = &mut star else {
                    return false;
                };
                *taken += 1;
                (p, n) = (*after, *taken);
            }
        }
    }
    pattern[p..].iter().all(|c| *c == '*')
}

/// The files in the folder of a pattern whose names it matches, in the order of their names.
///
/// # Errors
/// A folder that cannot be read.
pub fn files(path: &Path) -> Result<Vec<PathBuf>> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let pattern = path.file_name().unwrap_or_default().to_string_lossy();
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(Error::io(folder, "list"))? {
        let entry = entry.map_err(Error::io(folder, "list"))?;
        if matches(&pattern, &entry.file_name().to_string_lossy()) {
            found.push(path.with_file_name(entry.file_name()));
        }
    }
    found.sort();
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::matches;

    #[test]
    fn stars_and_question_marks_stand_for_what_they_do() {
        for (pattern, name, is) in [
            ("u", "u", true),
            ("u", "v", false),
            ("*", "", true),
            ("u*", "u", true),
            ("*ab*b", "aabxb", true),
            ("*ab*b", "aabx", false),
            ("?", "ö", true),
            ("?", "", false),
            ("a*?c", "ac", false),
            ("a*?c", "abc", true),
        ] {
            assert_eq!(matches(pattern, name), is, "{pattern} {name}");
        }
        // No more work than a product, where a simple search has 2^n ways.
        assert!(!matches(&"*a".repeat(200), &"a".repeat(199)));
    }
}
