//! How much memory there is, and may be taken.

use std::fs;
use std::sync::OnceLock;

use crate::error::{Error, Result};

/// Bytes that this process may take.
static MOST: OnceLock<u64> = OnceLock::new();

/// Sets what this process may take, in bytes; the first time counts.
pub fn set_limit(bytes: u64) {
    let _ = MOST.set(bytes);
}

/// Refuses what is predicted to take more bytes than can be had, before any of it is taken.
///
/// # Errors
/// The task, the memory it needs, and the memory that is available.
pub fn require(bytes: f64, what: &str) -> Result<()> {
    let there = available().map_or(f64::INFINITY, |there| there as f64);
    if bytes <= there {
        return Ok(());
    }
    Err(Error::usage(
        format!(
            "{what} would take about {:.1} MB of memory, and {:.1} MB can be had",
            bytes / 1e6,
            there / 1e6
        ),
        "take a coarser mesh, a machine with more memory, or allow more with --memory",
    ))
}

/// Available bytes, as the system reports, or less if a control group or [`set_limit`] sets a limit. None
/// if nothing is known.
pub fn available() -> Option<u64> {
    let may = MOST.get().map(|most| most.saturating_sub(held()));
    [there(), may].into_iter().flatten().min()
}

/// The memory of this process without mapped files, in bytes; 0 if the system does not report it.
pub fn held() -> u64 {
    let text = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find_map(|l| l.strip_prefix("RssAnon:"));
    let kilobytes = line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok());
    kilobytes.unwrap_or(0).saturating_mul(1024)
}

/// The size in bytes of the files in a folder that is kept in memory, with the number of its device; None for any other folder.
#[cfg(target_os = "linux")]
pub fn of_folder(path: &std::path::Path) -> Option<(u64, u64)> {
    use nix::sys::statfs::{TMPFS_MAGIC, statfs};
    use std::os::unix::fs::MetadataExt as _;
    let found = statfs(path).ok()?;
    if found.filesystem_type() != TMPFS_MAGIC {
        return None;
    }
    let blocks = found.blocks().saturating_sub(found.blocks_free());
    let bytes = blocks.saturating_mul(found.block_size() as u64);
    Some((fs::metadata(path).ok()?.dev(), bytes))
}

/// The size in bytes of the files in a folder that is kept in memory, with the number of its device; None for any other folder.
#[cfg(not(target_os = "linux"))]
pub fn of_folder(_: &std::path::Path) -> Option<(u64, u64)> {
    None
}

fn there() -> Option<u64> {
    let system = fs::read_to_string("/proc/meminfo")
        .ok()
        .as_deref()
        .and_then(from_meminfo);
    let group = fs::read_to_string("/proc/self/cgroup")
        .ok()
        .and_then(|text| left_in_group(&text, |path| fs::read_to_string(path).ok()));
    match (system, group) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    }
}

fn from_meminfo(text: &str) -> Option<u64> {
    let line = text.lines().find_map(|l| l.strip_prefix("MemAvailable:"))?;
    let kilobytes: u64 = line.split_whitespace().next()?.parse().ok()?;
    kilobytes.checked_mul(1024)
}

/// The memory that the control groups (version 2, or 1) of the process leave: the smallest of all.
fn left_in_group(groups: &str, read: impl Fn(&str) -> Option<String>) -> Option<u64> {
    let number = |path: String| -> Option<u64> { read(&path)?.trim().parse().ok() };
    let left = |folder: &str, limit: &str, usage: &str| {
        let limit = number(format!("{folder}/{limit}"))?;
        Some(limit.saturating_sub(number(format!("{folder}/{usage}")).unwrap_or(0)))
    };
    let mut least: Option<u64> = None;
    for line in groups.lines() {
        let mut parts = line.splitn(3, ':').skip(1);
        let (Some(controllers), Some(path)) = (parts.next(), parts.next()) else {
            continue;
        };
        let (root, names) = match controllers {
            "" => ("/sys/fs/cgroup", ("memory.max", "memory.current")),
            "memory" => (
                "/sys/fs/cgroup/memory",
                ("memory.limit_in_bytes", "memory.usage_in_bytes"),
            ),
            _ => continue,
        };
        // A group is bound by those above it as well.
        let mut path = path.trim_end_matches('/');
        loop {
            if let Some(here) = left(&format!("{root}{path}"), names.0, names.1) {
                least = Some(least.map_or(here, |other| other.min(here)));
            }
            match path.rfind('/') {
                Some(end) => path = &path[..end],
                None => break,
            }
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tightest_limit_counts() {
        assert_eq!(
            from_meminfo("MemTotal: 9 kB\nMemAvailable:     123 kB\n"),
            Some(123 * 1024)
        );
        assert_eq!(from_meminfo("MemTotal: 9 kB\n"), None);
        let files = |path: &str| {
            let text = match path {
                "/sys/fs/cgroup/memory.max" => "max",
                "/sys/fs/cgroup/a/memory.max" => "1000\n",
                "/sys/fs/cgroup/a/memory.current" => "300\n",
                "/sys/fs/cgroup/a/b/memory.max" => "900\n",
                "/sys/fs/cgroup/a/b/memory.current" => "100\n",
                "/sys/fs/cgroup/memory/memory.limit_in_bytes" => "50\n",
                _ => return None,
            };
            Some(text.to_owned())
        };
        assert_eq!(left_in_group("0::/a/b\n", files), Some(700));
        assert_eq!(left_in_group("0::/\n", files), None);
        assert_eq!(left_in_group("3:cpu:/\n2:memory:/x\n", files), Some(50));
        assert_eq!(left_in_group("rubbish", files), None);
        assert!(available().is_none_or(|bytes| bytes > 0));
        assert!(require(1e3, "a page").is_ok());
        let refused = require(1e18, "a mesh of 7 cells").unwrap_err().to_string();
        let said = "a mesh of 7 cells would take about 1000000000000.0 MB of memory, and ";
        assert!(refused.starts_with(said), "{refused}");
    }
}
