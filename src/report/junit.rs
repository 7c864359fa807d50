//! JUnit XML, as CI servers read it: a suite for each scene, method and mesh, and in it a case for each engine, and
//! for each pair and field. What disagrees is a failure, what could not be judged an error; nothing is skipped.

use std::io;
use std::path::Path;

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesText, Event};

use crate::campaigns::verify::{CaseOutcome, VerifyOutcome};
use crate::run::Failure;
use faceoff_judge::{Comparison, FieldVerdict, Verdict};
use faceoff_mesh::error::{Error, Place, Result};
use faceoff_mesh::io::save;

struct Suite {
    name: String,
    properties: Vec<(&'static str, String)>,
    cases: Vec<TestCase>,
}

struct TestCase {
    class: String,
    name: String,
    seconds: f64,
    verdict: Verdict,
    /// Why it is no pass.
    message: String,
}

/// Writes what [`crate::campaigns::verify::verify`] found to `path`. `missing` are engines that were asked for and left out.
///
/// # Errors
/// A file that cannot be written.
pub fn write_junit(
    path: Option<&Path>,
    outcome: &VerifyOutcome,
    missing: &[Failure],
) -> Result<()> {
    let mut suites: Vec<Suite> = outcome.cases.iter().map(suite).collect();
    let cross: Vec<TestCase> = outcome
        .cross
        .iter()
        .filter_map(|c| Some((c, c.judged?)))
        .map(|(c, judged)| TestCase {
            class: format!("{}.methods", c.scene),
            name: format!(
                "{}{} {} – {} {}",
                c.n.map_or(String::new(), |n| format!("n = {n}: ")),
                c.a.engine,
                c.a.method,
                c.b.engine,
                c.b.method
            ),
            seconds: 0.0,
            verdict: judged.verdict,
            message: format!(
                "distance {:e}, certified bounds {:e} and {:e}, the best on this mesh {:e}",
                judged.distance, judged.bounds[0], judged.bounds[1], judged.best
            ),
        })
        .collect();
    let engines = outcome.failures.iter().chain(missing);
    let engines: Vec<TestCase> = engines
        .map(|failure| TestCase {
            class: "engines".into(),
            name: failure.engine.clone(),
            seconds: 0.0,
            verdict: Verdict::Undetermined,
            message: failure.message.clone(),
        })
        .collect();
    for (name, cases) in [("methods", cross), ("engines", engines)] {
        if !cases.is_empty() {
            suites.push(Suite {
                name: name.into(),
                properties: Vec::new(),
                cases,
            });
        }
    }
    write(path, "faceoff verify", &suites)
}

/// Writes what a comparison of two files found to `path`.
///
/// # Errors
/// A file that cannot be written.
pub fn write_comparison_junit(path: Option<&Path>, comparison: &Comparison) -> Result<()> {
    let name = format!("{} – {}", comparison.a, comparison.b);
    let cases = comparison.fields.iter().map(|field| TestCase {
        class: name.clone(),
        name: format!("{} on {:?}", field.field.field, field.on).to_lowercase(),
        seconds: 0.0,
        verdict: field.field.verdict,
        message: why(&field.field),
    });
    let suite = Suite {
        cases: cases.collect(),
        properties: Vec::new(),
        name,
    };
    write(path, "faceoff compare", &[suite])
}

/// Writes that a run ended before anything was judged: one case, which is an error.
///
/// # Errors
/// A file that cannot be written.
pub fn write_failed_junit(path: Option<&Path>, name: &str, error: &Error) -> Result<()> {
    let case = TestCase {
        class: "faceoff".into(),
        name: name.to_owned(),
        seconds: 0.0,
        verdict: Verdict::Undetermined,
        message: error.to_string(),
    };
    let suite = Suite {
        name: name.to_owned(),
        properties: Vec::new(),
        cases: vec![case],
    };
    write(path, "faceoff", &[suite])
}

fn suite(case: &CaseOutcome) -> Suite {
    let n = case.n.map_or(String::new(), |n| format!(", n = {n}"));
    // A dot would open a package of its own in the servers' trees.
    let class = format!("{}.{}{n}", case.scene.replace('.', "_"), case.method);
    let mut cases: Vec<TestCase> = Vec::new();
    for engine in &case.engines {
        cases.push(TestCase {
            class: class.clone(),
            name: format!("{} solves the scheme", engine.engine),
            seconds: engine.seconds,
            verdict: engine.verdict,
            message: match engine.converged {
                true => format!("its backward error is {:.1e}", engine.residual),
                false => format!("it did not converge in {} steps", engine.iterations),
            },
        });
    }
    for pair in &case.pairs {
        cases.push(TestCase {
            class: class.clone(),
            name: format!("{} – {}: {}", pair.a, pair.b, pair.field.field),
            seconds: 0.0,
            verdict: pair.field.verdict,
            message: why(&pair.field),
        });
    }
    if case.pairs.is_empty() {
        cases.push(TestCase {
            class: class.clone(),
            name: "a pair to compare".into(),
            seconds: 0.0,
            verdict: Verdict::Undetermined,
            message: "fewer than two engines answered".into(),
        });
    }
    let versions = case.engines.iter();
    let versions = versions.map(|e| format!("{} {}", e.engine, e.version));
    Suite {
        name: format!("{}, {}{n}", case.scene, case.method),
        properties: vec![
            ("engines", versions.collect::<Vec<_>>().join(", ")),
            ("mesh", case.mesh_digest.clone()),
            ("faces", case.faces.to_string()),
        ],
        cases,
    }
}

/// How much, where and how many, in one sentence.
pub(super) fn why(field: &FieldVerdict) -> String {
    let place = field.worst.as_ref().map_or(String::new(), |worst| {
        format!(
            ", worst at {:?} {:?}: {:e} against {:e}",
            worst.vertices, worst.midpoint, worst.a, worst.b
        )
    });
    match &field.reason {
        Some(reason) => reason.clone(),
        None => format!(
            "{} of {} beyond {:.0e}: |a-b| up to {:.3e}, relative {:.3e}{place}",
            field.beyond, field.faces, field.tolerance, field.max_abs, field.max_rel
        ),
    }
}

fn write(path: Option<&Path>, name: &str, suites: &[Suite]) -> Result<()> {
    let Some(path) = path else { return Ok(()) };
    let bytes = encode(name, suites).map_err(|e| {
        Error::file(
            path,
            Place::Whole,
            format!("no XML can be made: {e}"),
            "report this",
        )
    })?;
    save(path, [bytes.as_slice()])
}

/// Cases, failures, errors.
fn counts<'a>(cases: impl Iterator<Item = &'a TestCase>) -> [String; 3] {
    let mut counts = [0, 0, 0];
    for case in cases {
        counts[0] += 1;
        match case.verdict {
            Verdict::Agree => {}
            Verdict::Disagree => counts[1] += 1,
            Verdict::Undetermined => counts[2] += 1,
        }
    }
    counts.map(|count: usize| count.to_string())
}

fn seconds<'a>(cases: impl Iterator<Item = &'a TestCase>) -> String {
    let finite = cases.map(|c| c.seconds).filter(|s| s.is_finite());
    format!("{:.3}", finite.fold(0.0, |sum, s| sum + s))
}

fn encode(name: &str, suites: &[Suite]) -> io::Result<Vec<u8>> {
    let mut writer = Writer::new_with_indent(Vec::new(), b' ', 2);
    writer.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    let all = || suites.iter().flat_map(|suite| &suite.cases);
    let [tests, failures, errors] = counts(all());
    let total = [
        ("name", name),
        ("tests", &tests),
        ("failures", &failures),
        ("errors", &errors),
        ("time", &seconds(all())),
    ];
    writer
        .create_element("testsuites")
        .with_attributes(total)
        .write_inner_content(|writer| {
            for suite in suites {
                write_suite(writer, suite)?;
            }
            Ok(())
        })?;
    let mut bytes = writer.into_inner();
    bytes.push(b'\n');
    Ok(bytes)
}

fn write_suite(writer: &mut Writer<Vec<u8>>, suite: &Suite) -> io::Result<()> {
    let [tests, failures, errors] = counts(suite.cases.iter());
    let head = [
        ("name", clean(&suite.name)),
        ("tests", tests),
        ("failures", failures),
        ("errors", errors),
        ("skipped", "0".into()),
        ("time", seconds(suite.cases.iter())),
    ];
    let head = head.iter().map(|(key, value)| (*key, value.as_str()));
    writer
        .create_element("testsuite")
        .with_attributes(head)
        .write_inner_content(|writer| {
            if !suite.properties.is_empty() {
                writer
                    .create_element("properties")
                    .write_inner_content(|writer| {
                        for (name, value) in &suite.properties {
                            writer
                                .create_element("property")
                                .with_attributes([("name", *name), ("value", &clean(value))])
                                .write_empty()?;
                        }
                        Ok(())
                    })?;
            }
            for case in &suite.cases {
                write_case(writer, case)?;
            }
            Ok(())
        })?;
    Ok(())
}

fn write_case(writer: &mut Writer<Vec<u8>>, case: &TestCase) -> io::Result<()> {
    let (class, name) = (clean(&case.class), clean(&case.name));
    let seconds = format!("{:.3}", case.seconds);
    let element = writer.create_element("testcase").with_attributes([
        ("classname", class.as_str()),
        ("name", &name),
        ("time", &seconds),
    ]);
    let kind = match case.verdict {
        Verdict::Agree => {
            element.write_empty()?;
            return Ok(());
        }
        Verdict::Disagree => ("failure", "disagree"),
        Verdict::Undetermined => ("error", "undetermined"),
    };
    let message = clean(&case.message);
    element.write_inner_content(|writer| {
        writer
            .create_element(kind.0)
            .with_attributes([("type", kind.1), ("message", &message)])
            .write_text_content(BytesText::new(&message))?;
        Ok(())
    })?;
    Ok(())
}

/// Without the characters that XML 1.0 cannot hold, which engines' own messages may have.
fn clean(text: &str) -> String {
    let allowed = |c: &char| matches!(c, '\t' | '\n' | ' '..='\u{d7ff}' | '\u{e000}'..='\u{fffd}' | '\u{10000}'..);
    text.chars().filter(allowed).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_and_texts_are_those_of_the_cases() {
        let case = |verdict, message: &str| TestCase {
            class: "a.b".into(),
            name: "x <&\"> \u{1b}[31m".into(),
            seconds: 0.25,
            verdict,
            message: message.into(),
        };
        let suite = Suite {
            name: "s".into(),
            properties: vec![("mesh", "'<".into())],
            cases: vec![
                case(Verdict::Agree, ""),
                case(Verdict::Disagree, "1 < 2"),
                case(Verdict::Undetermined, "gone"),
            ],
        };
        let text = String::from_utf8(encode("all", &[suite]).unwrap()).unwrap();
        assert!(
            text.contains("tests=\"3\" failures=\"1\" errors=\"1\" skipped=\"0\" time=\"0.750\""),
            "{text}"
        );
        assert!(
            text.contains("<failure type=\"disagree\" message=\"1 &lt; 2\">1 &lt; 2</failure>"),
            "{text}"
        );
        assert!(text.contains("<error type=\"undetermined\""));
        assert!(
            !text.contains('\u{1b}') && text.contains("x &lt;&amp;&quot;&gt; [31m"),
            "{text}"
        );
    }
}
