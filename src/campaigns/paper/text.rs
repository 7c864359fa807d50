//! Words for what was found.

const MOST_INTERVALS: usize = 8;

/// `[0, 0.1] ∪ [0.3, 0.4]`; of very many the first ones.
pub fn intervals(set: &[[f64; 2]], digits: usize) -> String {
    let shown = set.iter().take(MOST_INTERVALS);
    let words: Vec<String> = shown
        .map(|[a, b]| format!("[{a:.digits$}, {b:.digits$}]"))
        .collect();
    let more = if set.len() > MOST_INTERVALS {
        format!(" ∪ … ({} in all)", set.len())
    } else {
        String::new()
    };
    words.join(" ∪ ") + &more
}
