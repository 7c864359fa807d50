//! Commands as a user would type them.

/// Words as a shell reads them back, quoted where necessary.
pub fn quoted<S: AsRef<str>>(words: impl IntoIterator<Item = S>) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_.,/=+:@%".contains(c);
    let quote = |word: S| match word.as_ref() {
        word if !word.is_empty() && word.chars().all(plain) => word.to_owned(),
        word => format!("'{}'", word.replace('\'', "'\\''")),
    };
    let words: Vec<String> = words.into_iter().map(quote).collect();
    words.join(" ")
}

/// The arguments of this process, as a user would type them; characters outside Unicode are replaced.
pub fn typed() -> String {
    quoted(
        std::env::args_os()
            .skip(1)
            .map(|word| word.to_string_lossy().into_owned()),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_can_be_typed() {
        let words = ["solve", "a b.toml", "--method", "p2(1,0)", "it's", ""];
        let typed = r"solve 'a b.toml' --method 'p2(1,0)' 'it'\''s' ''";
        assert_eq!(quoted(words), typed);
    }
}
