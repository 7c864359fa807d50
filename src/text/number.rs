//! Numbers as a person writes them: `0`, `1.86`, `3 136`, `2.5 · 10⁻⁷`.

/// Between thousands, and around the dot of a product: narrow, and no place to break a line.
pub const THIN: char = '\u{202f}';

/// Below the first and from the second on, powers of ten are used.
const PLAIN: std::ops::Range<f64> = 1e-3..1e5;

/// With a given number of significant digits; 0 is `0`, and a value that is not finite is a dash.
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

/// Two digits, for differences and residuals.
pub fn size(value: f64) -> String {
    number(value, 2)
}

/// `3 136`
pub fn whole(count: usize) -> String {
    thousands(&count.to_string())
}

/// A share: in percent above a thousandth, otherwise as a number.
pub fn share(part: f64) -> String {
    match part.abs() {
        p if p >= 1e-3 => format!("{}{THIN}%", trimmed(&number(100.0 * part, 3))),
        _ => number(part, 2),
    }
}

/// `10⁻³`
pub fn power_of_ten(exponent: i32) -> String {
    format!("10{}", superscript(exponent))
}

/// `⁻³`
pub fn superscript(exponent: i32) -> String {
    let digits = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let of = |c: char| c.to_digit(10).map_or('⁻', |d| digits[d as usize]);
    exponent.to_string().chars().map(of).collect()
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

/// With a real minus sign; 0 has none.
pub fn signed(text: &str) -> String {
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| matches!(c, '0' | '.')) => rest.to_owned(),
        Some(rest) => format!("−{rest}"),
        None => text.to_owned(),
    }
}

/// Without redundant zeros at the end.
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
}
