//! Words of the command line, converted once to valid values; errors are messages.

use std::time::Duration;

use faceoff_fem::certify::Target;
use faceoff_fem::contact::Method;
use faceoff_judge::{PartialTolerance, UpTo};
use faceoff_mesh::error::distinct;

/// A list of methods; the parameters of a family member contain a comma.
#[derive(Clone)]
pub(super) struct Methods(pub Vec<Method>);

pub(super) fn methods(text: &str) -> Result<Methods, String> {
    let mut depth = 0;
    let words = text.split(|c| {
        match c {
            '(' => depth += 1,
            ')' => depth -= 1,
            _ => {}
        }
        c == ',' && depth == 0
    });
    let methods: Vec<Method> = words.map(method).collect::<Result<_, _>>()?;
    distinct(&methods, "method", "name each once").map_err(|e| e.to_string())?;
    Ok(Methods(methods))
}

pub(super) fn method(text: &str) -> Result<Method, String> {
    text.trim().parse()
}

/// A command, split into words as by a shell.
#[derive(Clone)]
pub(super) struct Words(pub Vec<String>);

pub(super) fn launcher(text: &str) -> Result<Words, String> {
    match shlex::split(text) {
        None => Err("a quotation mark is not closed".into()),
        Some(words) if words.is_empty() => Err("it names no program".into()),
        Some(words) => Ok(Words(words)),
    }
}

/// A parameter and its value.
pub(super) fn setting(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some(("n", value)) => Err(format!("n is a refinement: give --n {value}")),
        Some((name, value)) if !name.trim().is_empty() && !value.trim().is_empty() => {
            Ok((name.trim().to_owned(), value.trim().to_owned()))
        }
        _ => Err(format!("`{text}` is not NAME=VALUE")),
    }
}

/// A positive number of units of `unit` seconds each.
fn duration(number: &str, unit: f64) -> Option<Duration> {
    let seconds = number.parse::<f64>().ok()? * unit;
    let duration = Duration::try_from_secs_f64(seconds).ok();
    duration.filter(|d| !d.is_zero())
}

/// `90s`, `5m`, `1h`, or seconds without a letter.
pub(super) fn time(text: &str) -> Result<Duration, String> {
    let (number, unit) = match text.char_indices().last() {
        Some((at, 's')) => (&text[..at], 1.0),
        Some((at, 'm')) => (&text[..at], 60.0),
        Some((at, 'h')) => (&text[..at], 3600.0),
        _ => (text, 1.0),
    };
    duration(number, unit)
        .ok_or_else(|| format!("`{text}` is not a positive duration (examples: 90s, 5m, 1h)"))
}

/// A number in a range.
fn number(text: &str, is_valid: impl Fn(f64) -> bool, what: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|t| is_valid(*t));
    number.ok_or_else(|| format!("`{text}` is not a {what}"))
}

/// `500MB`, `4GB`, or MB without letters; in bytes.
pub(super) fn memory(text: &str) -> Result<u64, String> {
    let (number, unit) = [("GB", 1e9), ("MB", 1e6)]
        .iter()
        .find_map(|(letters, unit)| Some((text.strip_suffix(letters)?, *unit)))
        .unwrap_or((text, 1e6));
    let bytes = number.trim().parse::<f64>().map_or(0.0, |m| m * unit);
    if (1.0..1e18).contains(&bytes) {
        return Ok(bytes as u64);
    }
    Err(format!(
        "`{text}` is not a memory size (examples: 500MB, 4GB)"
    ))
}

pub(super) fn accuracy(text: &str) -> Result<Accuracy, String> {
    let what = "relative accuracy between 0 and 1 (examples: 1e-2 for 1 %, 1e-2:contact-force)";
    let (first, target) = match text.split_once(':') {
        Some((first, target)) => (first, Some(target.parse::<Target>()?)),
        None => (text, None),
    };
    let tolerance = number(first, |t| t > 0.0 && t < 1.0, what)?;
    Ok(Accuracy { tolerance, target })
}

/// The value of `--accuracy`.
#[derive(Debug, Clone, Copy)]
pub struct Accuracy {
    pub tolerance: f64,
    pub target: Option<Target>,
}

pub(super) fn bound(text: &str) -> Result<f64, String> {
    let what = "tolerance: give a finite number of at least 0";
    number(text, |t| t >= 0.0 && t.is_finite(), what)
}

/// The settings of one field.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct OfField {
    /// Its name, or a pattern.
    pub name: String,
    pub tolerance: PartialTolerance,
    /// What its problem leaves open.
    pub up_to: Vec<UpTo>,
}

/// The name may contain colons and spaces; the bounds follow the last colon.
pub(super) fn of_field(text: &str) -> Result<OfField, String> {
    let form = || format!("`{text}` is not NAME:rtol=R,atol=A,up_to=WHAT");
    let (name, bounds) = text.rsplit_once(':').ok_or_else(form)?;
    let mut found = OfField {
        name: name.to_owned(),
        tolerance: PartialTolerance::default(),
        up_to: Vec::new(),
    };
    for word in bounds.split(',') {
        let (key, value) = word.split_once('=').ok_or_else(form)?;
        let value = value.trim();
        let is_twice = match key.trim() {
            "rtol" => found.tolerance.rtol.replace(bound(value)?).is_some(),
            "atol" => found.tolerance.atol.replace(bound(value)?).is_some(),
            "up_to" => {
                let words = value.split('+').map(|word| word.trim().parse());
                let all = words.collect::<Result<Vec<UpTo>, String>>()?;
                !std::mem::replace(&mut found.up_to, all).is_empty()
            }
            _ => return Err(form()),
        };
        if is_twice {
            return Err(form());
        }
    }
    Ok(found)
}

/// Names of fields on either side of the first `=`.
pub(super) fn pair(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((a, b)) if !a.is_empty() && !b.is_empty() => Ok((a.into(), b.into())),
        _ => Err(format!("`{text}` is not NAME=OTHER")),
    }
}

pub(super) fn increment(text: &str) -> Result<f64, String> {
    number(text, |t| t > 0.0 && t < 1.0, "tolerance between 0 and 1")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_launcher_is_split_as_a_shell_does() {
        let words = |text| launcher(text).map(|words| words.0);
        let of = Ok(["env", "A=two words", "srun", "-n", "2"]
            .map(String::from)
            .to_vec());
        assert_eq!(words("env 'A=two words' srun -n 2"), of);
        assert_eq!(words(r"env A=two\ words srun -n 2"), of);
        assert!(words("env 'A=two").is_err_and(|what| what.contains("not closed")));
        assert!(words("  ").is_err());
    }

    #[test]
    fn tolerances_of_fields_are_read_from_behind() {
        let given = |name: &str, rtol, atol, up_to| {
            let tolerance = PartialTolerance { rtol, atol };
            let name = name.to_owned();
            Ok(OfField {
                name,
                tolerance,
                up_to,
            })
        };
        let read = of_field("u: mean:rtol=1e-6,atol=0");
        assert_eq!(read, given("u: mean", Some(1e-6), Some(0.0), vec![]));
        assert_eq!(of_field("u:atol=2"), given("u", None, Some(2.0), vec![]));
        let read = of_field("p:up_to=constant");
        assert_eq!(read, given("p", None, None, vec![UpTo::Constant]));
        let read = of_field("p:up_to=sign+constant,rtol=1");
        let both = vec![UpTo::Sign, UpTo::Constant];
        assert_eq!(read, given("p", Some(1.0), None, both));
        assert!(
            of_field("p:up_to=const")
                .is_err_and(|what| what.contains("give one of constant, sign"))
        );
        for wrong in [
            "u",
            "u:",
            "u:1e-6",
            "u:tol=1",
            "u:rtol=-1",
            "u:rtol=nan",
            "u:rtol=1,rtol=2",
            "u:up_to=sign,up_to=sign",
        ] {
            assert!(of_field(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn budgets_have_units() {
        assert_eq!(time("1.5m"), Ok(Duration::from_secs(90)));
        assert_eq!(time("90s"), time("90"));
        assert_eq!(time("1h"), time("60m"));
        for wrong in ["", "m", "-1s", "0s", "nan", "1e400", "5 m s", "∞"] {
            assert!(time(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn methods_with_parameters_split_at_the_right_commas() {
        let names: Vec<String> = methods("cr,p2(1,0), p1")
            .unwrap_or(Methods(vec![]))
            .0
            .iter()
            .map(ToString::to_string)
            .collect();
        assert_eq!(names, ["cr", "p2(1,0)", "p1"]);
        assert!(methods("cr,cr").is_err());
        assert!(methods("cr,p2(1,1),p2").is_err());
    }
}
