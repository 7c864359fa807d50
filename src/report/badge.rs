//! A badge: the verdict as a small SVG for READMEs and pipelines.

use faceoff_judge::Verdict;

/// The word and the colour of a verdict; the contrast with white is at least 4.5.
pub(super) fn badge(verdict: Verdict, word: &str) -> String {
    let colour = match verdict {
        Verdict::Agree | Verdict::Conditioned => "#1a6e3c",
        Verdict::Several | Verdict::Disagree => "#b3261e",
        Verdict::Undetermined => "#5f5f5f",
    };
    // textLength fixes the widths, about 6.5 px per letter at 11 px, for any font.
    let (left, right) = (52, 16 + 13 * word.len() / 2);
    let (width, text) = (left + right, right - 14);
    let middle = left + right / 2;
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"20\" role=\"img\" aria-label=\"faceoff: {word}\">\
         <title>faceoff: {word}</title>\
         <rect width=\"{width}\" height=\"20\" rx=\"3\" fill=\"#333\"/>\
         <path d=\"M{left} 0h{}a3 3 0 0 1 3 3v14a3 3 0 0 1-3 3h-{}z\" fill=\"{colour}\"/>\
         <g fill=\"#fff\" font-family=\"DejaVu Sans,Verdana,sans-serif\" font-size=\"11\" text-anchor=\"middle\">\
         <text x=\"26\" y=\"14\" textLength=\"40\" lengthAdjust=\"spacingAndGlyphs\">faceoff</text>\
         <text x=\"{middle}\" y=\"14\" textLength=\"{text}\" lengthAdjust=\"spacingAndGlyphs\">{word}</text></g></svg>\n",
        right - 3,
        right - 3,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_badge_says_the_verdict_in_words() {
        for (verdict, word) in [
            (Verdict::Agree, "agree"),
            (Verdict::Disagree, "unsound"),
            (Verdict::Undetermined, "undetermined"),
        ] {
            assert!(badge(verdict, word).contains(&format!(">{word}<")));
        }
    }
}
