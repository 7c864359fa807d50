//! Writes all requested output: the folder with its page, JSON, JUnit, a badge, the terminal, and the output for
//! CI servers.

use std::fs;
use std::io::Read as _;
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use serde_json::json;

use super::annotations::annotate;
use super::badge::badge;
use super::console::{answer, note, output as say};
use super::folder::{check_folder, list, write_report};
use super::html::{WIDEST, page};
use super::json::{is_stdout, slug, write_text};
use super::junit::junit;
use super::model::{Report, Suite, TestCase};
use super::provenance;
use super::terminal::text;
use crate::text::Text;
use faceoff_judge::Verdict;
use faceoff_mesh::cancel::{self, Cause};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::file;
use faceoff_mesh::io::save;

/// Where the results of a command go.
#[derive(Debug, Clone, Default)]
pub struct Output<'a> {
    /// As it is typed.
    pub command: &'static str,
    /// The subject, if it is not that of the command.
    pub subject: Option<String>,
    /// Does it judge something?
    pub judges: bool,
    /// File of the result as JSON; standard output for `-`.
    pub json: Option<&'a Path>,
    /// The folder of the page.
    pub report: Option<&'a Path>,
    /// The file for the judged cases as JUnit XML.
    pub junit: Option<&'a Path>,
    /// The file for the verdict as SVG.
    pub badge: Option<&'a Path>,
    /// Print nothing on the terminal.
    pub quiet: bool,
}

/// The marks by which our pages are recognised, and below those of JSON, JUnit and a badge.
const MARK: &str = "<title>faceoff";
const MARKS: [&str; 3] = ["\"schema\": \"faceoff/", "<testsuites name=\"faceoff", MARK];

/// Is everything written? Locked while results are written, so that no verdict follows an abort.
static IS_CLOSED: Mutex<bool> = Mutex::new(false);

/// How long an abort waits for results that are being written.
const PATIENCE: Duration = Duration::from_millis(200);

impl Output<'_> {
    /// Refuses, before anything is run, a folder with contents other than an earlier report; and marks the results of an earlier run
    /// as incomplete, so that they are not mistaken for those of this run, however it ends.
    ///
    /// # Errors
    /// Such a folder, or a file.
    pub fn begin(&self) -> Result<()> {
        provenance::begin();
        self.check()?;
        let [json, junit, badge] = MARKS;
        let earlier = Output {
            json: self.json.filter(|path| begins_with(path, json)),
            junit: self.junit.filter(|path| begins_with(path, junit)),
            badge: self.badge.filter(|path| begins_with(path, badge)),
            report: self
                .report
                .filter(|folder| folder.join("index.html").exists()),
            ..self.clone()
        };
        if [earlier.json, earlier.junit, earlier.badge, earlier.report] == [None; 4] {
            return Ok(());
        }
        let message = "it has not ended; if it does not run any more, it was killed: run it again";
        let written = write(&earlier.failure(message)?, &earlier);
        if written.is_err() {
            earlier.remove();
        }
        written
    }

    /// Removes the results of an earlier run, which needs no space on the disk.
    fn remove(&self) {
        let page = self.report.map(|folder| folder.join("index.html"));
        let files = [self.json, self.junit, self.badge, page.as_deref()];
        for path in files.into_iter().flatten() {
            // The target of a link: its contents must not be an earlier verdict.
            let real = path.canonicalize().unwrap_or_else(|_| path.to_owned());
            let emptied = || {
                fs::OpenOptions::new()
                    .write(true)
                    .truncate(true)
                    .open(&real)
            };
            let removed = fs::remove_file(&real).or_else(|_| emptied().map(drop));
            let path = path.display();
            match removed {
                Ok(()) => note!("faceoff: {path} was of an earlier run, and is removed"),
                Err(e) => note!("faceoff: {path} is of an earlier run, and cannot be removed: {e}"),
            }
        }
    }

    fn check(&self) -> Result<()> {
        let is_ours = |folder: &Path| {
            let page = file::text(&folder.join("index.html"));
            page.is_ok_and(|page| page.contains(MARK))
        };
        self.report
            .map_or(Ok(()), |folder| check_folder(folder, is_ours))
    }

    /// Is anything printed on the terminal?
    pub fn speaks(&self) -> bool {
        !self.quiet && !is_stdout(self.json)
    }

    /// Records in all requested output that the command ended early: a result of an earlier run must not be mistaken for
    /// one of this run.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub fn fail(&self, error: &Error) -> Result<()> {
        let report = self.failure(&error.to_string())?;
        let mut output = self.clone();
        output.report = self.report.filter(|_| self.check().is_ok());
        write(&report, &output)?;
        annotate(&report, &output)
    }

    /// [`Output::fail`] for a command that does not end: its later output is not written.
    pub fn give_up(&self, error: &Error) {
        let begun = Instant::now();
        while begun.elapsed() < PATIENCE {
            if let Ok(mut is_closed) = IS_CLOSED.try_lock() {
                *is_closed = true;
                break;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        let mut output = self.clone();
        output.report = self.report.filter(|_| self.check().is_ok());
        // It cannot be reported that this cannot be written.
        let _ = self
            .failure(&error.to_string())
            .and_then(|report| put(&report, &output));
    }

    /// The report of a command without a result.
    fn failure(&self, message: &str) -> Result<Report<'static>> {
        let subject = self.subject.as_deref().unwrap_or(self.command);
        let result = match self.judges {
            true => json!({ "verdict": Verdict::Undetermined, "error": message }),
            false => json!({ "error": message }),
        };
        let title = format!("faceoff {}", self.command);
        let mut report = Report::new(self.command, &title, Text::message(message), &result)?;
        if self.judges {
            report.verdict = Some((Verdict::Undetermined, "undetermined"));
            let case = TestCase {
                title: Some(format!("{subject} could not be judged")),
                ..TestCase::new(
                    "faceoff",
                    subject,
                    Verdict::Undetermined,
                    message.to_owned(),
                )
            };
            report.suites.push(Suite::new(subject, [case]));
        }
        Ok(report)
    }
}

/// Does a file begin like one of ours?
fn begins_with(path: &Path, mark: &str) -> bool {
    let mut start = Vec::new();
    // A pipe has no contents of an earlier run, and reading from it may block forever.
    let read = file::open(path).and_then(|file| file.take(400).read_to_end(&mut start));
    read.is_ok() && String::from_utf8_lossy(&start).contains(mark)
}

/// Writes a report to all requested outputs, and to the terminal.
///
/// # Errors
/// Files that cannot be written, and errors in making the page.
pub fn deliver(report: &Report, output: &Output) -> Result<()> {
    write(report, output)?;
    if output.speaks() {
        say(format_args!("{}", text(report)));
        answer(
            &report.headline().to_string(),
            report.verdict.map(|(verdict, _)| verdict),
        );
    }
    annotate(report, output)
}

/// Writes the page of a report that belongs to another one into a subfolder of that one's.
///
/// # Errors
/// A folder with contents other than an earlier report; those of [`deliver`].
pub fn write_page(report: &Report, whole: &Path, name: &str) -> Result<()> {
    let folder = whole.join(name);
    let output = Output {
        report: Some(&folder),
        ..Output::default()
    };
    output.check()?;
    write(report, &output)?;
    list(whole, name)
}

fn write(report: &Report, output: &Output) -> Result<()> {
    let is_closed = IS_CLOSED.lock().unwrap_or_else(PoisonError::into_inner);
    if *is_closed {
        return Err(Error::Ended(cancel::cause().unwrap_or(Cause::Signal)));
    }
    put(report, output)
}

fn put(report: &Report, output: &Output) -> Result<()> {
    if let Some(folder) = output.report {
        write_report(folder, |beside| {
            for write in &report.files {
                write(beside)?;
            }
            for figure in report.figures() {
                let drawn = (figure.picture)(WIDEST);
                write_text(&beside.join(figure.file()), &drawn.file())?;
            }
            write_text(&beside.join(slug(report.command) + ".json"), &report.json)?;
            write_text(&beside.join("index.html"), &page(report, beside)?)
        })?;
    }
    if let Some(path) = output.junit {
        save(path, [junit(report).as_bytes()])?;
    }
    if let (Some(path), Some((verdict, word))) = (output.badge, report.verdict) {
        write_text(path, &badge(verdict, word))?;
    }
    output
        .json
        .map_or(Ok(()), |path| write_text(path, &report.json))
}
