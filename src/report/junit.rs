//! JUnit XML, as CI servers read it. What disagrees is a failure, what could not be judged an error; nothing is skipped.

use std::io;

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesText, Event};

use super::console::misleads;
use super::model::{Report, Suite, TestCase};
use faceoff_judge::Verdict;
use faceoff_mesh::error::{Error, Result};

/// What a report has judged, as XML.
///
/// # Errors
/// Texts that XML cannot hold.
pub(super) fn junit(report: &Report) -> Result<Vec<u8>> {
    let name = format!("faceoff {}", report.command);
    let mut suites: Vec<&Suite> = report.suites.iter().collect();
    let cases = || report.suites.iter().flat_map(|suite| &suite.cases);
    let verdict = report.verdict.map(|(verdict, _)| verdict);
    // Who reads no more than this must not take what was not judged for a pass.
    let is_told = |verdict: Verdict| match verdict.passes() {
        true => cases().next().is_some(),
        false => cases().any(|case| !case.verdict.passes()),
    };
    let whole = verdict.filter(|verdict| !is_told(*verdict)).map(|verdict| {
        let case = TestCase::new(
            "faceoff",
            report.command,
            verdict,
            report.headline.to_string(),
        );
        Suite::new(report.command, [case])
    });
    suites.extend(&whole);
    encode(&name, &suites).map_err(|e| Error::Solver {
        what: format!("no XML can be made of what {name} found: {e}"),
        remedy: "report this".into(),
    })
}

/// Cases, failures, errors.
fn counts<'a>(cases: impl Iterator<Item = &'a TestCase>) -> [String; 3] {
    let mut counts = [0, 0, 0];
    for case in cases {
        counts[0] += 1;
        match case.verdict {
            Verdict::Agree | Verdict::Conditioned => {}
            Verdict::Several | Verdict::Disagree => counts[1] += 1,
            Verdict::Undetermined => counts[2] += 1,
        }
    }
    counts.map(|count: usize| count.to_string())
}

fn seconds<'a>(cases: impl Iterator<Item = &'a TestCase>) -> String {
    let finite = cases.map(|c| c.seconds).filter(|s| s.is_finite());
    format!("{:.3}", finite.fold(0.0, |sum, s| sum + s))
}

fn encode(name: &str, suites: &[&Suite]) -> io::Result<Vec<u8>> {
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
        Verdict::Agree | Verdict::Conditioned => {
            element.write_empty()?;
            return Ok(());
        }
        Verdict::Undetermined => ("error", case.verdict.word()),
        Verdict::Several | Verdict::Disagree => ("failure", case.verdict.word()),
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

/// Without the characters that XML 1.0 cannot hold, which engines' own messages may have, and with those that mislead shown.
fn clean(text: &str) -> String {
    let shown = |c: char| if misleads(c) { '\u{fffd}' } else { c };
    let allowed = |c: &char| matches!(c, '\t' | '\n' | ' '..='\u{d7ff}' | '\u{e000}'..='\u{fffd}' | '\u{10000}'..);
    text.chars().filter(allowed).map(shown).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_and_texts_are_those_of_the_cases() {
        let case = |verdict, message: &str| TestCase {
            class: "a.b".into(),
            name: "x <&\"> \u{1b}[31m".into(),
            title: None,
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
        let text = String::from_utf8(encode("all", &[&suite]).unwrap()).unwrap();
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
