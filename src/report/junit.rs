//! JUnit XML for CI servers. A disagreement is a failure, a case that could not be judged an error; nothing is skipped.

use maud::{Markup, html};

use super::console::misleads;
use super::model::{Report, Suite, TestCase};
use faceoff_judge::Verdict;

/// The judged cases of a report, as XML.
pub(super) fn junit(report: &Report) -> String {
    let mut suites: Vec<&Suite> = report.suites.iter().collect();
    let cases = || report.suites.iter().flat_map(|suite| &suite.cases);
    let verdict = report.verdict.map(|(verdict, _)| verdict);
    // A reader of only this must not mistake an unjudged case for a pass.
    let is_told = |verdict: Verdict| match verdict.passes() {
        true => cases().next().is_some(),
        false => cases().any(|case| !case.verdict.passes()),
    };
    let whole = verdict.filter(|verdict| !is_told(*verdict)).map(|verdict| {
        let (command, message) = (report.command, report.headline().to_string());
        let case = TestCase::new("faceoff", command, verdict, message);
        Suite::new(command, [case])
    });
    suites.extend(&whole);
    encode(&format!("faceoff {}", report.command), &suites)
}

/// The name of a verdict that does not pass.
fn kind(verdict: Verdict) -> Option<&'static str> {
    match verdict {
        Verdict::Agree | Verdict::Conditioned => None,
        Verdict::Several | Verdict::Disagree => Some("failure"),
        Verdict::Undetermined => Some("error"),
    }
}

/// Cases, failures, errors, and the total time in seconds.
fn counts(suites: &[&Suite]) -> ([usize; 3], String) {
    let cases = || suites.iter().flat_map(|suite| &suite.cases);
    let of = |wanted| {
        cases()
            .filter(|case| kind(case.verdict) == Some(wanted))
            .count()
    };
    let finite = cases().map(|c| c.seconds).filter(|s| s.is_finite());
    let seconds = finite.fold(0.0, |sum, s| sum + s);
    (
        [cases().count(), of("failure"), of("error")],
        format!("{seconds:.3}"),
    )
}

fn encode(name: &str, suites: &[&Suite]) -> String {
    let ([tests, failures, errors], time) = counts(suites);
    let all = html! {
        testsuites name=(name) tests=(tests) failures=(failures) errors=(errors) time=(time) {
            @for suite in suites { "\n  " (of_suite(suite)) }
            "\n"
        }
    };
    // Without the characters that XML 1.0 does not allow, which messages of engines may contain, and with misleading ones made visible.
    let shown = |c: char| if misleads(c) { '\u{fffd}' } else { c };
    let allowed = |c: &char| matches!(c, '\t' | '\n' | ' '..='\u{d7ff}' | '\u{e000}'..='\u{fffd}' | '\u{10000}'..);
    let all = all.into_string();
    let all: String = all.chars().filter(allowed).map(shown).collect();
    format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{all}\n")
}

fn of_suite(suite: &Suite) -> Markup {
    let ([tests, failures, errors], time) = counts(&[suite]);
    html! {
        testsuite name=(suite.name) tests=(tests) failures=(failures) errors=(errors) skipped="0" time=(time) {
            @if !suite.properties.is_empty() {
                "\n    "
                properties {
                    @for (name, value) in &suite.properties { "\n      " property name=(name) value=(value) {} }
                    "\n    "
                }
            }
            @for case in &suite.cases { "\n    " (of_case(case)) }
            "\n  "
        }
    }
}

fn of_case(case: &TestCase) -> Markup {
    let (message, word) = (&case.message, case.verdict.word());
    html! {
        testcase classname=(case.class) name=(case.name) time=(format!("{:.3}", case.seconds)) {
            @match kind(case.verdict) {
                Some("failure") => failure type=(word) message=(message) { (message) },
                Some(_) => error type=(word) message=(message) { (message) },
                None => {}
            }
        }
    }
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
        let text = encode("all", &[&suite]);
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
