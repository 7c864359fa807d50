//! The machine on which times are measured, and the memory of this process.

use std::collections::HashMap;
use std::fs;

use faceoff_mesh::memory;
use serde::Serialize;

/// Where, and with what build, something was measured.
#[derive(Debug, Clone, Serialize)]
pub struct Machine {
    /// The processor's name as reported by the system; empty if it is not reported.
    pub processor: String,
    /// Threads that may be used.
    pub threads: usize,
    /// All memory, in MB; None if the system does not report it.
    pub memory_mb: Option<f64>,
    /// `linux`, `macos`, `windows`.
    pub system: &'static str,
    /// The version of this program.
    pub version: &'static str,
    /// Whether the program was built with optimisation: times of a debug build mean little.
    pub optimised: bool,
}

impl Machine {
    /// This one.
    pub fn here() -> Self {
        let processor = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let processor = field(&processor, "model name").unwrap_or_default();
        let memory = fs::read_to_string("/proc/meminfo").unwrap_or_default();
        Machine {
            processor: processor.to_owned(),
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            memory_mb: megabytes(&memory, "MemTotal"),
            system: std::env::consts::OS,
            version: env!("CARGO_PKG_VERSION"),
            optimised: !cfg!(debug_assertions),
        }
    }
}

/// Peak resident memory in MB: of this process, or of the largest program it ran.
pub fn peak_memory_mb(children: bool) -> f64 {
    // For a process, getrusage reports at least the memory that its parent had when it started the process.
    if let Some(own) = status("VmHWM").filter(|_| !children) {
        return own;
    }
    largest(children)
}

#[cfg(unix)]
fn largest(children: bool) -> f64 {
    use nix::sys::resource::{UsageWho, getrusage};
    let who = if children {
        UsageWho::RUSAGE_CHILDREN
    } else {
        UsageWho::RUSAGE_SELF
    };
    // Linux counts in KiB, macOS in bytes.
    let kilo = if cfg!(target_os = "macos") {
        1024.0 * 1024.0
    } else {
        1024.0
    };
    getrusage(who).map_or(f64::NAN, |usage| usage.max_rss() as f64 / kilo)
}

#[cfg(not(unix))]
fn largest(_: bool) -> f64 {
    f64::NAN
}

/// Memory of this process and its descendants, in bytes, with the files that sandboxed programs have in memory; 0
/// if the system does not report it.
pub fn held_memory() -> u64 {
    let (mut own, mut shared) = (0, 0);
    let mut folders = HashMap::new();
    for id in below(std::process::id()) {
        let text = fs::read_to_string(format!("/proc/{id}/status")).unwrap_or_default();
        own += megabytes(&text, "RssAnon").map_or(0, bytes);
        // Shared memory counts once, and takes longer to measure.
        if megabytes(&text, "RssShmem").is_some_and(|held| held > 16.0) {
            let text = fs::read_to_string(format!("/proc/{id}/smaps_rollup")).unwrap_or_default();
            shared += megabytes(&text, "Pss_Shmem").map_or(0, bytes);
        }
        for place in ["dev/shm", "tmp"] {
            let path = format!("/proc/{id}/root/{place}");
            folders.extend(memory::of_folder(path.as_ref()));
        }
    }
    // Those of the system are not ours.
    for place in ["/dev/shm", "/tmp"] {
        if let Some((device, _)) = memory::of_folder(place.as_ref()) {
            folders.remove(&device);
        }
    }
    own + shared.max(folders.values().sum())
}

fn bytes(megabytes: f64) -> u64 {
    (megabytes * 1024.0 * 1024.0) as u64
}

/// The numbers of the process `ancestor` and of its descendants.
pub(super) fn below(ancestor: u32) -> Vec<u32> {
    let entries = fs::read_dir("/proc").into_iter().flatten().flatten();
    let processes: Vec<(u32, u32)> = entries
        .filter_map(|entry| {
            let id = entry.file_name().to_str()?.parse().ok()?;
            let text = fs::read_to_string(entry.path().join("stat")).ok()?;
            // A name, in brackets, may contain anything.
            let parent = text.rsplit_once(')')?.1.split_whitespace().nth(1)?;
            Some((id, parent.parse().ok()?))
        })
        .collect();
    let mut ours = vec![ancestor];
    let mut looked = 0;
    while let Some(parent) = ours.get(looked).copied() {
        looked += 1;
        for (id, of) in &processes {
            // As processes end and begin meanwhile, one may seem to be its own ancestor.
            if *of == parent && !ours.contains(id) {
                ours.push(*id);
            }
        }
    }
    ours
}

/// Processes and threads of the whole system; 0 if it does not report them.
pub(super) fn tasks() -> usize {
    let text = fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let all = text.split(['/', ' ']).nth(4);
    all.and_then(|all| all.parse().ok()).unwrap_or(0)
}

/// The peak memory of this process since a given moment.
pub struct HighWater {
    before: f64,
}

impl HighWater {
    /// From now on. None if the system does not support this.
    pub fn begin() -> Option<Self> {
        // 5 resets the peak to the current memory.
        fs::write("/proc/self/clear_refs", "5").ok()?;
        Some(HighWater {
            before: status("VmRSS")?,
        })
    }

    /// MB beyond the memory at the beginning; None below 1 MB, which may have been allocated before.
    pub fn megabytes(&self) -> Option<f64> {
        Some(status("VmHWM")? - self.before).filter(|more| *more >= 1.0)
    }
}

fn status(name: &str) -> Option<f64> {
    megabytes(&fs::read_to_string("/proc/self/status").ok()?, name)
}

/// A line `name: 12 kB`.
fn megabytes(text: &str, name: &str) -> Option<f64> {
    let kilobytes = field(text, name)?.split_whitespace().next()?;
    Some(kilobytes.parse::<f64>().ok()? / 1024.0)
}

fn field<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    text.lines().find_map(|line| {
        let (key, value) = line.split_once(':')?;
        (key.trim() == name).then(|| value.trim())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_system_tells_is_read() {
        let text = "model name\t: A 1\nVmHWM:\t  2048 kB\n";
        assert_eq!(field(text, "model name"), Some("A 1"));
        assert_eq!(megabytes(text, "VmHWM"), Some(2.0));
        assert_eq!(megabytes(text, "VmRSS"), None);
        assert!(Machine::here().threads > 0);
        let parent = std::os::unix::process::parent_id();
        assert!(below(parent).contains(&std::process::id()));
        assert!(!below(std::process::id()).contains(&parent));
        assert!(tasks() > 1 && held_memory() > 0);
    }

    /// The peak is one of a whole process, so this test runs itself again in a separate process.
    #[test]
    fn memory_that_is_held_for_a_moment_is_seen() {
        if std::env::var_os("FACEOFF_ALONE").is_none() {
            let name = "engine::machine::tests::memory_that_is_held_for_a_moment_is_seen";
            let alone = std::process::Command::new(std::env::current_exe().unwrap())
                .args(["--exact", name])
                .env("FACEOFF_ALONE", "1")
                .output()
                .unwrap();
            let said = String::from_utf8_lossy(&alone.stdout);
            assert!(said.contains("1 passed"), "{said}");
            return;
        }
        let Some(water) = HighWater::begin() else {
            return;
        };
        let held = vec![1_u8; 64 << 20];
        assert!(held.iter().map(|b| u64::from(*b)).sum::<u64>() == 64 << 20);
        drop(held);
        let seen = water.megabytes().unwrap();
        assert!(seen > 60.0, "{seen}");
    }
}
