//! An engine that is a program and implements the protocol.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::{Value, json};

use super::bounds::Bounds;
use super::depends;
use super::sandbox::{self, Allowed};
use super::shown;
use super::within::Within;
use super::{
    Answer, Case, Engine, Launch, Progress, Run, Settings, fenicsx, freefem, job, process,
};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::file::Temporary;

/// A program and its form of the protocol.
pub(super) struct Program {
    pub name: String,
    pub kind: Kind,
    pub within: Within,
}

pub(super) enum Kind {
    /// FreeFEM with the companion script, or with a copy of it in this folder.
    FreeFem { scripts: Option<PathBuf> },
    /// dolfinx with the companion script, or with a copy of it in this folder.
    Fenicsx { scripts: Option<PathBuf> },
    /// Any other program; it gets the job as dolfinx does, with expressions as the scene has them.
    Other {
        command: Vec<String>,
        folder: PathBuf,
    },
}

impl Program {
    pub fn freefem() -> Self {
        Program {
            name: "freefem".into(),
            kind: Kind::FreeFem { scripts: None },
            within: Within::default(),
        }
    }

    pub fn fenicsx() -> Self {
        Program {
            name: "fenicsx".into(),
            kind: Kind::Fenicsx { scripts: None },
            within: Within::default(),
        }
    }

    /// Writes the job and returns the command that does it.
    fn prepare(&self, folder: &Path, cases: &[&Case], settings: &Settings) -> Result<Command> {
        let mut command = self.command(folder, cases, settings)?;
        if !settings.sandbox {
            return Ok(command);
        }
        if !self.within.is_here() {
            let what = format!("{} runs within another system already", self.name);
            return Err(Error::usage(what, "leave --sandbox out"));
        }
        if matches!(settings.launch, Launch::By(_)) {
            let remedy = "use --ranks, or leave --sandbox out";
            return Err(Error::usage(
                "a launcher starts processes elsewhere, where no sandbox is",
                remedy,
            ));
        }
        let mut allowed = Allowed::default();
        match &self.kind {
            Kind::FreeFem { .. } => {}
            Kind::Fenicsx { scripts } => {
                // Programs without a sandbox load the files in their cache.
                let cache = match scripts {
                    None => fenicsx::cache(folder).join(fenicsx::OF_SANDBOXES),
                    Some(_) => folder.join("cache"),
                };
                fs::create_dir_all(&cache).map_err(Error::io(&cache, "make"))?;
                command.env("XDG_CACHE_HOME", &cache);
                allowed.write.push(cache);
                allowed.programs.extend(fenicsx::python(&self.within));
            }
            Kind::Other { folder: home, .. } => allowed.read.push(home.clone()),
        }
        sandbox::enclose(&command, folder, &allowed)
    }

    fn command(&self, folder: &Path, cases: &[&Case], settings: &Settings) -> Result<Command> {
        match &self.kind {
            Kind::FreeFem { scripts } => {
                freefem::write_job(&self.name, folder, cases, settings)?;
                freefem::command(folder, scripts.as_deref(), &self.within)
            }
            Kind::Fenicsx { scripts } => {
                fenicsx::write_job(&self.name, folder, cases, settings, |e| e.to_ufl())?;
                fenicsx::command(folder, scripts.as_deref(), &settings.launch, &self.within)
            }
            Kind::Other {
                command,
                folder: home,
            } => {
                fenicsx::write_job(&self.name, folder, cases, settings, |e| e.text().to_owned())?;
                let command = other_command(command, home);
                Ok(self.within.enclose(command, folder))
            }
        }
    }
}

/// The command of an engine file; words that are files next to it mean those files.
fn other_command(words: &[String], home: &Path) -> Command {
    // With links and `..` resolved, so that a sandbox with this folder contains them.
    let home = shown::real(home).unwrap_or(home.to_owned());
    let resolve = |word: &String| {
        let beside = home.join(word);
        if beside.is_file() {
            beside.into_os_string()
        } else {
            word.into()
        }
    };
    let mut command = Command::new(resolve(&words[0]));
    command
        .args(words[1..].iter().map(resolve))
        .env("LC_ALL", "C");
    command
}

impl Engine for Program {
    fn name(&self) -> &str {
        &self.name
    }

    fn probe(&self) -> Result<String> {
        let probed = match &self.kind {
            Kind::FreeFem { .. } => freefem::probe(&self.within),
            Kind::Fenicsx { .. } => fenicsx::probe(&self.within),
            Kind::Other { .. } => Ok("reported in its answers".into()),
        };
        probed.map_err(|error| match error {
            Error::Engine { what, .. } if !self.within.is_here() => {
                let remedy =
                    "type the words of `within` before a command to see whether it runs there";
                Error::engine(&self.name, what, remedy)
            }
            other => other,
        })
    }

    fn is_installed(&self) -> bool {
        match &self.kind {
            Kind::FreeFem { .. } => freefem::program(&self.within).is_some(),
            Kind::Fenicsx { .. } => fenicsx::python(&self.within).is_some(),
            Kind::Other { .. } => true,
        }
    }

    fn distributes(&self) -> bool {
        matches!(self.kind, Kind::Fenicsx { .. })
    }

    fn identity(&self) -> Result<Value> {
        let mut identity = match &self.kind {
            Kind::FreeFem { scripts } => json!({
                "version": self.probe()?,
                "companion": freefem::digest(scripts.as_deref())?,
            }),
            Kind::Fenicsx { scripts } => json!({
                "version": self.probe()?,
                "companion": fenicsx::digest(scripts.as_deref())?,
            }),
            Kind::Other { .. } if !self.within.is_here() => {
                let what = format!(
                    "{} runs within another system, so that nobody can tell what its answer depends on",
                    self.name
                );
                return Err(Error::usage(what, "run it without --resume"));
            }
            Kind::Other { command, folder } => {
                json!({ "command": command, "depends": depends::digests(command, folder)? })
            }
        };
        if !self.within.is_here() {
            identity["within"] = json!(self.within.0);
        }
        Ok(identity)
    }

    fn refuses_other_protocols(&self, case: &Case, settings: &Settings) -> Result<bool> {
        // FreeFEM's job has no number of a protocol: it is written for its script.
        if matches!(self.kind, Kind::FreeFem { .. }) {
            return Ok(true);
        }
        let folder = Folder::new(None, &self.name)?;
        let command = self.prepare(&folder.path, &[case], settings)?;
        job::pretend_protocol(&folder.path, job::PROTOCOL + 1)?;
        match process::run(
            &self.name,
            &command,
            &folder.path,
            settings.time_limit,
            settings.sandbox.then(|| Bounds::new(&folder.path)),
            |_| {},
        ) {
            Err(Error::Ended(cause)) => Err(Error::Ended(cause)),
            Err(_) => Ok(!folder.path.join(job::STATUS).exists()),
            Ok(()) => Ok(false),
        }
    }

    fn run(&self, cases: &[&Case], settings: &Settings, progress: &dyn Progress) -> Result<Run> {
        let mut version = String::new();
        let mut answers = vec![None; cases.len()];
        for (number, job) in job::jobs(cases).iter().enumerate() {
            let kept = match number {
                0 => self.name.clone(),
                _ => format!("{}-{}", self.name, number + 1),
            };
            let folder = Folder::new(settings.keep.as_deref(), &kept)?;
            let of_job: Vec<&Case> = job.iter().map(|k| cases[*k]).collect();
            let step = |case: usize, step, increment| {
                let case = job.get(case).copied().unwrap_or_default();
                progress.step(&self.name, case, step, increment);
            };
            let run = || self.run_job(&folder.path, &of_job, settings, step);
            let mut done = run();
            if let (Kind::Fenicsx { .. }, Err(failure)) = (&self.kind, &done)
                && self.within.is_here()
                && fenicsx::give_up_cache(&folder.path, failure)
            {
                // The job is written again, and never through a link that the program left.
                empty(&folder.path)?;
                done = run();
            }
            let told;
            (version, told) = done?;
            for (k, answer) in job.iter().zip(told) {
                answers[*k] = Some(answer);
            }
        }
        progress.done(&self.name);
        let answers = answers.into_iter().flatten().collect();
        Ok(Run { version, answers })
    }
}

impl Program {
    /// Runs one job; `step` is called with the case, the iteration and its increment.
    fn run_job(
        &self,
        folder: &Path,
        cases: &[&Case],
        settings: &Settings,
        step: impl Fn(usize, usize, f64) + Send + Sync,
    ) -> Result<(String, Vec<Answer>)> {
        let command = self.prepare(folder, cases, settings)?;
        let bounds = settings.sandbox.then(|| Bounds::new(folder));
        let limit = settings.time_limit;
        process::run(&self.name, &command, folder, limit, bounds, |line| {
            if let Some((case, iteration, increment)) = parse_progress(line) {
                step(case, iteration, increment);
            }
        })?;
        let (told, answers) = job::read(&self.name, folder, cases)?;
        let version = match self.kind {
            // The version that FreeFEM reports is older than what Debian ships: 4.9 for 4.11.
            Kind::FreeFem { .. } => freefem::package_version(&self.within, folder).unwrap_or(told),
            _ => told,
        };
        Ok((version, answers))
    }
}

/// A job's folder, which is removed with the job unless it is to be kept.
pub(super) struct Folder {
    pub path: PathBuf,
    _temporary: Option<Temporary>,
    /// Locked while the job runs, so that no other run uses the folder.
    _lock: Option<File>,
}

impl Folder {
    pub fn new(keep: Option<&Path>, name: &str) -> Result<Self> {
        let Some(keep) = keep else {
            let temporary = Temporary::new()?;
            return Ok(Folder {
                path: temporary.path().to_owned(),
                _temporary: Some(temporary),
                _lock: None,
            });
        };
        let folder = keep.join(name);
        let refuse = |what: &str| {
            let what = format!("{} {what}", folder.display());
            Error::usage(what, "name another folder with --keep")
        };
        let is_new = !folder.exists();
        fs::create_dir_all(&folder).map_err(Error::io(&folder, "make"))?;
        let lock = File::open(&folder).map_err(Error::io(&folder, "open"))?;
        if lock.try_lock().is_err() {
            return Err(refuse("is in use by another run"));
        }
        // What an earlier run left here must not pass for an answer of this one; what is not a job
        // folder is somebody's work.
        let mut entries = fs::read_dir(&folder).map_err(Error::io(&folder, "read"))?;
        if !is_new && entries.next().is_some() {
            if !folder.join("job.json").is_file() {
                return Err(refuse("exists but is not a job folder"));
            }
            empty(&folder)?;
        }
        // From now on it is one, whatever happens to this run.
        let job = folder.join("job.json");
        fs::write(&job, "").map_err(Error::io(&job, "write"))?;
        Ok(Folder {
            path: std::path::absolute(&folder).map_err(Error::io(&folder, "find"))?,
            _temporary: None,
            _lock: Some(lock),
        })
    }
}

fn empty(folder: &Path) -> Result<()> {
    for entry in fs::read_dir(folder).map_err(Error::io(folder, "read"))? {
        let path = entry.map_err(Error::io(folder, "read"))?.path();
        let removed = if path.is_dir() && !path.is_symlink() {
            fs::remove_dir_all(&path)
        } else {
            fs::remove_file(&path)
        };
        removed.map_err(Error::io(&path, "remove"))?;
    }
    Ok(())
}

/// `progress case-3 7 1.25e-05`
fn parse_progress(line: &str) -> Option<(usize, usize, f64)> {
    let mut words = line.strip_prefix("progress case-")?.split(' ');
    let parsed = (
        words.next()?.parse().ok()?,
        words.next()?.parse().ok()?,
        words.next()?.parse().ok()?,
    );
    words.next().is_none().then_some(parsed)
}
