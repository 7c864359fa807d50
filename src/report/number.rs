//! Numbers as a person writes them: `0`, `1.86`, `3 136`, `2.5 · 10⁻⁷`.

/// Between thousands, and around the dot of a product: narrow, and no place to break a line.
pub const THIN: char = '\u{202f}';

/// Below this and from that on powers of ten read better.
const PLAIN: std::ops::Range<f64> = 1e-3..1e5;

/// With so many digits that count; 0 is `0`, and what is not finite a dash.
pub fn number(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return "–".into();
    }
    if value == 0.0 {
        return "0".into();
    }
    let text = format!("{value:.*e}", digits.saturating_sub(1));
    // Rust writes a power behind every number of this form.
    let (mantissa, power) = text.split_once('e').unwrap_or((&text, "0"));
    let power: i32 = power.parse().unwrap_or(0);
    let rounded: f64 = text.parse().unwrap_or(value);
    if PLAIN.contains(&rounded.abs()) {
        let decimals = (digits as i32 - 1 - power).max(0) as usize;
        return signed(&thousands(&format!("{value:.decimals$}")));
    }
    let is_one = mantissa
        .trim_start_matches('-')
        .trim_end_matches(['0', '.'])
        == "1";
    match is_one && format!("1e{power}").parse() == Ok(value.abs()) {
        true if value < 0.0 => format!("−{}", power_of_ten(power)),
        true => power_of_ten(power),
        false => signed(&format!("{mantissa}{THIN}·{THIN}{}", power_of_ten(power))),
    }
}

/// Two digits: what differences and residuals have.
pub fn size(value: f64) -> String {
    number(value, 2)
}

/// `3 136`
pub fn whole(count: usize) -> String {
    thousands(&count.to_string())
}

/// How large a share is: percent above a thousandth, else as it is.
pub fn share(part: f64) -> String {
    match part.abs() {
        p if p >= 1e-3 => format!("{}{THIN}%", trimmed(&number(100.0 * part, 3))),
        _ => number(part, 2),
    }
}

/// `10⁻³`
pub fn power_of_ten(exponent: i32) -> String {
    let digits = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let of = |c: char| c.to_digit(10).map_or('⁻', |d| digits[d as usize]);
    let power: String = exponent.to_string().chars().map(of).collect();
    format!("10{power}")
}

/// `(0.2031, 0)`: four digits of the largest coordinate, as many of the others.
pub fn place(x: &[f64]) -> String {
    let largest = x.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let of = |x: &f64| match PLAIN.contains(&largest) {
        true => {
            let decimals = (3.0 - largest.log10().floor()).clamp(0.0, 6.0) as usize;
            signed(&trimmed(&format!("{x:.decimals$}")))
        }
        false => number(*x, 4),
    };
    format!("({})", x.iter().map(of).collect::<Vec<_>>().join(", "))
}

/// A sentence in which numbers stand as programs write them, `2.5e-7` and `0.12345678901234567`, as a person writes them.
pub fn in_words(text: &str) -> String {
    let bytes = text.as_bytes();
    let (mut told, mut from, mut at) = (String::with_capacity(text.len()), 0, 0);
    while at < bytes.len() {
        let length = numeral(&bytes[at..]);
        let ends = |byte: Option<&u8>| {
            byte.is_none_or(|b| !(b.is_ascii_alphanumeric() || *b == b'_' || *b == b'/'))
        };
        let is_word = |byte: Option<&u8>| !ends(byte);
        if length == 0 {
            at += 1;
            continue;
        }
        let before = at.checked_sub(1).map(|k| &bytes[k]);
        let after = bytes.get(at + length);
        // A name of a file goes on behind its dot or dash.
        let goes_on = matches!(after, Some(b'.' | b'-')) && is_word(bytes.get(at + length + 1));
        if ends(before) && before != Some(&b'.') && ends(after) && !goes_on {
            let numeral = &text[at..at + length];
            let is_minus = before == Some(&b'-') && ends(at.checked_sub(2).map(|k| &bytes[k]));
            let shown = rewritten(numeral);
            if is_minus || shown.is_some() {
                told.push_str(&text[from..at - usize::from(is_minus)]);
                told.push_str(if is_minus { "−" } else { "" });
                told.push_str(shown.as_deref().unwrap_or(numeral));
                from = at + length;
            }
        }
        at += length;
    }
    told.push_str(&text[from..]);
    told
}

/// The length of the number that a text begins with.
fn numeral(bytes: &[u8]) -> usize {
    let digits = |from: usize| {
        bytes[from..]
            .iter()
            .take_while(|b| b.is_ascii_digit())
            .count()
    };
    let mut length = digits(0);
    if length == 0 {
        return 0;
    }
    if bytes.get(length) == Some(&b'.') && digits(length + 1) > 0 {
        length += 1 + digits(length + 1);
    }
    if bytes.get(length) == Some(&b'e') {
        let sign = usize::from(matches!(bytes.get(length + 1), Some(b'-' | b'+')));
        let from = length + 1 + sign;
        if from < bytes.len() && digits(from) > 0 {
            length = from + digits(from);
        }
    }
    length
}

/// More digits than this are those of a machine, which is no way to tell a bound.
const READABLE: usize = 10;

/// With the digits that it has, so that a bound stays one whatever the words about it; those of a machine are cut to a few.
fn rewritten(numeral: &str) -> Option<String> {
    let value: f64 = numeral.parse().ok()?;
    let (mantissa, power) = numeral
        .split_once('e')
        .map_or((numeral, None), |(m, p)| (m, Some(p)));
    let digits = mantissa
        .trim_start_matches(['0', '.'])
        .bytes()
        .filter(u8::is_ascii_digit)
        .count();
    match power {
        Some(_) if digits > READABLE => Some(number(value, 4)),
        Some(_) => Some(number(value, digits.max(1))),
        None if mantissa.contains('.') && value == 0.0 => Some("0".into()),
        None if digits > READABLE && mantissa.contains('.') => Some(number(value, 6)),
        None => None,
    }
}

/// With thin spaces between thousands, from four digits on.
fn thousands(text: &str) -> String {
    let (sign, rest) = text
        .strip_prefix('-')
        .map_or(("", text), |rest| ("-", rest));
    let (whole, part) = rest
        .split_once('.')
        .map_or((rest, None), |(w, p)| (w, Some(p)));
    let mut grouped = String::from(sign);
    for (k, digit) in whole.chars().enumerate() {
        if k > 0 && (whole.len() - k) % 3 == 0 {
            grouped.push(THIN);
        }
        grouped.push(digit);
    }
    if let Some(part) = part {
        grouped.push('.');
        grouped.push_str(part);
    }
    grouped
}

fn signed(text: &str) -> String {
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| matches!(c, '0' | '.')) => rest.to_owned(),
        Some(rest) => format!("−{rest}"),
        None => text.to_owned(),
    }
}

/// Without zeros at the end that say nothing.
pub fn trimmed(text: &str) -> String {
    match text.contains('.') && !text.contains('·') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_a_person() {
        let of = |value, digits| number(value, digits).replace(THIN, " ");
        for (value, text) in [
            (0.0, "0"),
            (-0.0, "0"),
            (1.864_775_194, "1.86"),
            (0.123_45, "0.123"),
            (0.099_96, "0.100"),
            (-1.2345e-7, "−1.23 · 10⁻⁷"),
            (1e-12, "10⁻¹²"),
            (1.004e-12, "1.00 · 10⁻¹²"),
            (3136.2, "3 136"),
            (99_999.9, "1.00 · 10⁵"),
            (9.996e-4, "0.00100"),
            (9.9e-4, "9.90 · 10⁻⁴"),
            (f64::NAN, "–"),
            (f64::INFINITY, "–"),
        ] {
            assert_eq!(of(value, 3), text, "{value}");
        }
        assert_eq!(of(1e-8, 1), "10⁻⁸");
        assert_eq!(size(2.53e-7).replace(THIN, " "), "2.5 · 10⁻⁷");
        assert_eq!(whole(1_234_567).replace(THIN, " "), "1 234 567");
        assert_eq!(
            [0.01, 0.5, 2e-4].map(share).join("; ").replace(THIN, " "),
            "1 %; 50 %; 2.0 · 10⁻⁴"
        );
        assert_eq!(place(&[0.203_125, 0.0]), "(0.2031, 0)");
        assert_eq!(place(&[-0.5, 1e-17]), "(−0.5, 0)");
        assert_eq!(place(&[12.0, 0.25]), "(12, 0.25)");
    }

    #[test]
    fn numbers_in_sentences_are_rewritten_and_names_are_not() {
        let of = |text: &str| in_words(text).replace(THIN, " ");
        assert_eq!(
            of("Residual 2.5e-7; 2 of 3136 rows"),
            "Residual 2.5 · 10⁻⁷; 2 of 3136 rows"
        );
        assert_eq!(
            of("at most 1e-12, or 50 steps"),
            "at most 10⁻¹², or 50 steps"
        );
        assert_eq!(
            of("u is 0.12345678901234567, not 1"),
            "u is 0.123457, not 1"
        );
        assert_eq!(of("γ is × 1.00000100"), "γ is × 1.00000100");
        assert_eq!(
            of("in [-0.25, 1], (0.2, 0.0000), a-1"),
            "in [−0.25, 1], (0.2, 0), a-1"
        );
        assert_eq!(
            of("in [-4.61928e-1, 3.27671e-3], up to 1.23410e-5"),
            "in [−0.461928, 0.00327671], up to 1.23410 · 10⁻⁵"
        );
        assert_eq!(of("0.0e0 against 1.864775194431245e0"), "0 against 1.865");
        for name in [
            "a-1e-7.vtu",
            "run_1e-7",
            "x1e-7",
            "1e-7/u.vtu",
            "2026-11-22",
            "0.5.2",
            "1e",
        ] {
            assert_eq!(in_words(name), name);
        }
    }
}
