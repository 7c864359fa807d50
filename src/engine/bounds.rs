//! Limits for a sandboxed program: processes, and room on the disk of its job folder. The system's own
//! limits are for each process, or do not bind root; so all processes that the program has started are checked while it runs.

use std::collections::{HashMap, HashSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::machine;
use faceoff_mesh::file;

/// The largest file, and the largest size of the job folder; half of the free space, if that is less.
const MOST_BYTES: u64 = 16 << 30;

/// The most files and folders.
const MOST_FILES: usize = 200_000;

/// The intervals at which processes and files are counted.
const OFTEN: [Duration; 2] = [Duration::from_millis(20), Duration::from_millis(400)];

/// The limits of one run in a job folder.
#[derive(Debug)]
pub(super) struct Bounds {
    folder: PathBuf,
    most_bytes: u64,
    tasks_before: usize,
    looked: [Instant; 2],
}

/// The most processes and threads.
pub(super) fn most_tasks() -> usize {
    1024 + 16 * std::thread::available_parallelism().map_or(1, usize::from)
}

/// The largest size of the job folder.
pub(super) fn most_bytes(folder: &Path) -> u64 {
    file::room(folder).map_or(MOST_BYTES, |room| MOST_BYTES.min(room / 2))
}

impl Bounds {
    /// The limits of a program that is about to start.
    pub fn new(folder: &Path) -> Self {
        Bounds {
            folder: folder.to_owned(),
            most_bytes: most_bytes(folder),
            tasks_before: machine::tasks(),
            looked: [Instant::now(); 2],
        }
    }

    /// Whether the process `id` and its children are within them. If not, what they did.
    pub fn look(&mut self, id: u32) -> Result<(), String> {
        if self.looked[0].elapsed() >= OFTEN[0] {
            self.looked[0] = Instant::now();
            // Finding the owners of processes takes longer than counting processes.
            let most = most_tasks();
            if machine::tasks() > self.tasks_before + most && has_more(id, most) {
                return Err(format!("started more than {most} processes and threads"));
            }
        }
        if self.looked[1].elapsed() >= OFTEN[1] {
            self.looked[1] = Instant::now();
            let mut held = Held::default();
            self.count(&mut held)?;
            held.removed(id);
            if held.bytes() > self.most_bytes {
                let most = self.most_bytes / 1_000_000;
                return Err(format!("wrote more than {most} MB into its job folder"));
            }
        }
        Ok(())
    }

    fn count(&self, held: &mut Held) -> Result<(), String> {
        let mut todo = vec![(self.folder.clone(), 0)];
        let mut files = 0;
        while let Some((folder, depth)) = todo.pop() {
            let entries = match fs::read_dir(&folder) {
                Err(e) if e.kind() == std::io::ErrorKind::NotFound => continue,
                Err(e) => return Err(format!("made a folder that cannot be looked into ({e})")),
                Ok(entries) => entries,
            };
            for entry in entries.flatten() {
                files += 1;
                if files > MOST_FILES || depth > 100 {
                    return Err(format!(
                        "made more than {MOST_FILES} files, or folders more than 100 deep"
                    ));
                }
                let Ok(found) = entry.metadata() else {
                    continue;
                };
                held.add(&found);
                if found.is_dir() {
                    todo.push((entry.path(), depth + 1));
                }
            }
        }
        Ok(())
    }
}

/// Whether the process `ancestor` has more than `most` descendants, threads included. They are stopped while they are
/// counted, since a program that forks without end would start thousands more in the meantime; they go on if they are few enough.
#[cfg(unix)]
fn has_more(ancestor: u32, most: usize) -> bool {
    use nix::sys::signal::{Signal, kill};
    use nix::unistd::Pid;
    let send = |id: u32, signal: Signal| {
        // It may have ended.
        let _ = kill(Pid::from_raw(id as i32), signal);
    };
    let all = fs::read_dir("/proc").into_iter().flatten().flatten();
    let name = |entry: fs::DirEntry| entry.file_name().to_str()?.parse().ok();
    let mut ids: Vec<u32> = all.filter_map(name).collect();
    // Parents come before their children, but where numbers begin again at 1; then a later look finds them.
    ids.sort_unstable();
    let mut found = HashSet::from([ancestor]);
    let mut tasks = 0;
    for id in ids {
        let stat = fs::read_to_string(format!("/proc/{id}/stat")).unwrap_or_default();
        // The name of the program, in parentheses, may contain anything.
        let fields: Vec<&str> = stat
            .rsplit(')')
            .next()
            .unwrap_or("")
            .split_whitespace()
            .collect();
        let number = |at: usize| fields.get(at)?.parse::<usize>().ok();
        if number(1).is_some_and(|parent| found.contains(&(parent as u32))) {
            send(id, Signal::SIGSTOP);
            found.insert(id);
            tasks += number(17).unwrap_or(1);
            if tasks > most {
                return true;
            }
        }
    }
    found.remove(&ancestor);
    found.into_iter().for_each(|id| send(id, Signal::SIGCONT));
    false
}

#[cfg(not(unix))]
fn has_more(_: u32, _: usize) -> bool {
    false
}

/// Room that files take, each once.
#[derive(Default)]
struct Held(HashMap<[u64; 2], u64>);

impl Held {
    #[cfg(unix)]
    fn add(&mut self, found: &fs::Metadata) {
        use std::os::unix::fs::MetadataExt as _;
        self.0
            .insert([found.dev(), found.ino()], found.blocks() * 512);
    }

    #[cfg(not(unix))]
    fn add(&mut self, found: &fs::Metadata) {
        let key = [u64::MAX, self.0.len() as u64];
        self.0.insert(key, found.len());
    }

    /// Adds open files that have been deleted.
    fn removed(&mut self, id: u32) {
        #[cfg(unix)]
        for id in machine::below(id) {
            use std::os::unix::fs::MetadataExt as _;
            let open = fs::read_dir(format!("/proc/{id}/fd")).into_iter().flatten();
            for entry in open.flatten() {
                let found = fs::metadata(entry.path());
                if let Ok(found) = found
                    && found.is_file()
                    && found.nlink() == 0
                {
                    self.add(&found);
                }
            }
        }
        #[cfg(not(unix))]
        let _ = id;
    }

    fn bytes(&self) -> u64 {
        self.0.values().sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_program_writes_is_counted_and_bounded() {
        let folder = tempfile::tempdir().unwrap();
        let mut bounds = Bounds::new(folder.path());
        let mut look = |most: u64| {
            bounds.looked = [Instant::now() - Duration::from_secs(1); 2];
            bounds.most_bytes = most;
            bounds.look(std::process::id())
        };
        fs::create_dir(folder.path().join("below")).unwrap();
        fs::write(folder.path().join("below/file"), vec![1; 1 << 20]).unwrap();
        fs::hard_link(
            folder.path().join("below/file"),
            folder.path().join("again"),
        )
        .unwrap();
        assert_eq!(look(3 << 20), Ok(()));
        assert!(look(1 << 19).unwrap_err().contains("wrote more than"));
        let deep = folder.path().join(["d"; 103].join("/"));
        fs::create_dir_all(deep).unwrap();
        assert!(look(3 << 20).unwrap_err().contains("100 deep"));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn too_many_processes_are_stopped_and_few_go_on() {
        use std::process::{Command, Stdio};
        let script = "for k in 1 2 3 4 5; do sleep 60 & done; wait";
        // What is left of it, should this fail, holds no pipe of the tests.
        let mut shell = Command::new("sh");
        shell.stdout(Stdio::null()).stderr(Stdio::null());
        let mut shell = shell.args(["-c", script]).spawn().unwrap();
        let states = || -> String {
            let of = |id: &u32| fs::read_to_string(format!("/proc/{id}/stat")).unwrap();
            let all = machine::below(shell.id());
            let children = all.iter().filter(|id| **id != shell.id());
            children
                .map(|id| of(id).rsplit(") ").next().unwrap().chars().next().unwrap())
                .collect()
        };
        // A signal is delivered when the process has its turn.
        let until = |wanted: &dyn Fn(&str) -> bool| {
            let begun = Instant::now();
            while !wanted(&states()) {
                assert!(begun.elapsed() < Duration::from_secs(60), "{}", states());
                std::thread::sleep(Duration::from_millis(10));
            }
        };
        until(&|states| states == "SSSSS");
        assert!(!has_more(shell.id(), 5));
        until(&|states| states == "SSSSS");
        assert!(has_more(shell.id(), 4));
        until(&|states| states == "TTTTT");
        for id in machine::below(shell.id()) {
            let id = nix::unistd::Pid::from_raw(id as i32);
            nix::sys::signal::kill(id, nix::sys::signal::Signal::SIGKILL).unwrap();
        }
        shell.wait().unwrap();
    }
}
