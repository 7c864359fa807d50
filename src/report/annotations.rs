//! The output that CI servers show with a run: GitHub's workflow commands and its summary, GitLab's report of annotations. Each
//! is written if the environment shows that this server runs the command.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Component, Path, PathBuf};

use serde_json::json;

use super::console::plain;
use super::deliver::Output;
use super::json::{is_stdout, write_text};
use super::model::{Report, Suite, TestCase};
use faceoff_mesh::error::{Error, Result};

/// The most annotations of one run; GitHub shows ten per step.
const MOST: usize = 10;

/// The fault, and the case that has it.
struct Note {
    title: String,
    message: String,
}

/// Writes the findings of a report that did not pass for the CI server; commands go to standard error if standard
/// output is in use. If nothing is judged, nothing is written.
///
/// # Errors
/// Files that cannot be written.
pub(super) fn annotate(report: &Report, output: &Output) -> Result<()> {
    let Some((_, word)) = report.verdict else {
        return Ok(());
    };
    let of_suite = |suite: &Suite| -> Vec<Note> {
        let failed = suite.cases.iter().filter(|c| !c.verdict.passes());
        let usual = |case: &TestCase| format!("{}: {}", suite.name, case.name);
        let note = |case: &TestCase| Note {
            title: plain(&case.title.clone().unwrap_or_else(|| usual(case))),
            message: plain(&case.message),
        };
        failed.map(note).collect()
    };
    let notes: Vec<Note> = report.suites.iter().flat_map(of_suite).collect();
    let is_set = |name: &str| std::env::var_os(name).is_some_and(|v| v == "true");
    if is_set("GITHUB_ACTIONS") {
        let commands = github_commands(&notes);
        let to: &mut dyn std::io::Write = match is_stdout(output.json) {
            true => &mut std::io::stderr(),
            false => &mut std::io::stdout(),
        };
        let written = to.write_all(commands.as_bytes());
        written.map_err(Error::io(Path::new("-"), "write"))?;
        if let Some(summary) = std::env::var_os("GITHUB_STEP_SUMMARY").map(PathBuf::from) {
            std::fs::OpenOptions::new()
                .append(true)
                .create(true)
                .open(&summary)
                .and_then(|mut file| file.write_all(github_summary(word, &notes).as_bytes()))
                .map_err(Error::io(&summary, "write"))?;
        }
    }
    if is_set("GITLAB_CI")
        && let Some(folder) = output.report
    {
        let job = std::env::var("CI_JOB_URL").unwrap_or_default();
        let project = std::env::var_os("CI_PROJECT_DIR").map(PathBuf::from);
        let inside = in_project(folder, project.as_deref());
        let links = gitlab_annotations(word, &notes, &job, &inside);
        let path = folder.join("gitlab-annotations.json");
        write_text(&path, &format!("{links:#}\n"))?;
    }
    Ok(())
}

/// `::error title=…::…`, one per line.
fn github_commands(notes: &[Note]) -> String {
    let escape = |text: &str| {
        text.replace('%', "%25")
            .replace('\r', "%0D")
            .replace('\n', "%0A")
    };
    let mut text = String::new();
    for note in notes.iter().take(MOST) {
        let title = escape(&note.title).replace(':', "%3A").replace(',', "%2C");
        let _ = writeln!(text, "::error title={title}::{}", escape(&note.message));
    }
    if let Some(more @ 1..) = notes.len().checked_sub(MOST) {
        let _ = writeln!(text, "::error title=faceoff::and {more} more");
    }
    text
}

fn github_summary(verdict: &str, notes: &[Note]) -> String {
    let mut text = format!("### faceoff: {verdict}\n\n");
    if !notes.is_empty() {
        text.push_str("| what | how much and where |\n| --- | --- |\n");
    }
    let cell = |text: &str| {
        text.replace('|', "\\|")
            .replace('\n', " ")
            .replace('<', "&lt;")
    };
    for note in notes {
        let _ = writeln!(text, "| {} | {} |", cell(&note.title), cell(&note.message));
    }
    text
}

/// The path of a folder in the project, as used in the addresses of artifacts.
fn in_project(folder: &Path, project: Option<&Path>) -> String {
    let inside = project.and_then(|project| folder.strip_prefix(project).ok());
    let parts = inside.unwrap_or(folder).components();
    let names = parts.filter_map(|part| match part {
        Component::Normal(name) => Some(name.to_string_lossy()),
        _ => None,
    });
    names.collect::<Vec<_>>().join("/")
}

/// Links from the job's page to the report among its artifacts.
fn gitlab_annotations(verdict: &str, notes: &[Note], job: &str, folder: &str) -> serde_json::Value {
    let url = format!("{job}/artifacts/file/{folder}/index.html");
    let link = |label: String| json!({ "external_link": { "label": label, "url": url } });
    let mut links = vec![link(format!("faceoff: {verdict}"))];
    links.extend(notes.iter().take(MOST).map(|note| link(note.title.clone())));
    json!({ "faceoff": links })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn notes() -> Vec<Note> {
        let note = |k: usize| Note {
            title: format!("a, b: {k}"),
            message: "50 % | 1\n2 <script>".into(),
        };
        (0..12).map(note).collect()
    }

    #[test]
    fn nothing_breaks_out_of_a_command_or_a_table() {
        let commands = github_commands(&notes());
        assert_eq!(commands.lines().count(), MOST + 1);
        assert_eq!(
            commands.lines().next(),
            Some("::error title=a%2C b%3A 0::50 %25 | 1%0A2 <script>")
        );
        assert!(commands.ends_with("and 2 more\n"));
        let summary = github_summary("disagree", &notes());
        assert_eq!(summary.lines().count(), 2 + 2 + 12);
        assert!(summary.contains("50 % \\| 1 2 &lt;script>"));
    }

    #[test]
    fn annotations_lead_to_the_report() {
        let told = gitlab_annotations("disagree", &notes(), "https://ci/jobs/1", "r");
        let first = &told["faceoff"][0]["external_link"];
        assert_eq!(first["label"], "faceoff: disagree");
        assert_eq!(
            first["url"],
            "https://ci/jobs/1/artifacts/file/r/index.html"
        );
        assert_eq!(told["faceoff"].as_array().unwrap().len(), 1 + MOST);
        let project = Some(Path::new("/builds/me"));
        for folder in ["out/report", "./out/report", "/builds/me/out/report"] {
            assert_eq!(in_project(Path::new(folder), project), "out/report");
        }
    }
}
