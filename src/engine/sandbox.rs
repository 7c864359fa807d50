//! A sandbox for untrusted programs, with bubblewrap. It is empty at first; then what a program needs is added: the system's
//! programs and libraries to read, what `shown` finds that this program needs, its job folder to write in, and folders for
//! temporary files that are small and its own. It has no network, no variables, processes, keys, terminals or open files of the user.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

use super::bounds;
use super::process::find_in_path;
use super::seccomp;
use super::shown::{Shown, is_of_system, real};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::memory;

/// Folders that a sandboxed program may use besides the system and its job folder.
#[derive(Debug, Default)]
pub(super) struct Allowed {
    /// Programs that its own starts.
    pub programs: Vec<PathBuf>,
    pub read: Vec<PathBuf>,
    pub write: Vec<PathBuf>,
}

/// The system configuration that programs and libraries read and that contains nothing about the user.
const CONFIGURATION: [&str; 21] = [
    "alternatives",
    "ld.so.cache",
    "ld.so.conf",
    "ld.so.conf.d",
    "fonts",
    "freefem++.pref",
    "host.conf",
    "libibverbs.d",
    "locale.alias",
    "localtime",
    "mime.types",
    "mpich",
    "nsswitch.conf",
    "openmpi",
    "openmpi-x86_64",
    "os-release",
    "pmix",
    "protocols",
    "python3",
    "services",
    "timezone",
];

/// The first folders of the system, or links to others of them.
const SYSTEM: [&str; 7] = [
    "/bin",
    "/sbin",
    "/lib",
    "/lib32",
    "/lib64",
    "/libx32",
    "/gnu/store",
];

/// Becomes bubblewrap: with no variable, as its own first process shows to all what it was started with; with no open file
/// of the user, who may have started this process with more than three; and with a filter and a few files that it reads from
/// here.
const OUTSIDE: &str = r#"filter=$1 passwd=$2 group=$3 hosts=$4; shift 4
for number in /proc/self/fd/*; do
  number=${number##*/}
  [ "$number" -gt 2 ] && exec {number}>&-
done
exec -c "$@" 9< <(printf "$filter") 10<<<"$passwd" 11<<<"$group" 12<<<"$hosts""#;

/// Becomes the program, which writes no core and no larger files, and starts no more processes, than this.
const INSIDE: &str =
    r#"ulimit -c 0; ulimit -f "$1" 2>/dev/null; ulimit -u "$2" 2>/dev/null; shift 2; exec "$@""#;

/// The user that the program is in the sandbox, for any real user.
const USER: &str = "1000";

/// The largest of its folders for temporary files: in memory, which such files take.
const MOST_TEMPORARY: u64 = 1 << 30;

/// The command that runs `command` in a sandbox, in `folder`.
///
/// # Errors
/// A system that has no sandbox; a program that is not there; a folder whose sight would give more away than a program needs.
pub(super) fn enclose(command: &Command, folder: &Path, allowed: &Allowed) -> Result<Command> {
    let tools = Tools::find()?;
    let options = tools.options()?;
    let mut shown = Shown::default();
    for path in &allowed.read {
        shown.folder(path)?;
    }
    let program = shown.program(Path::new(command.get_program()), command.get_current_dir())?;
    for path in &allowed.programs {
        shown.program(path, None)?;
    }
    let mut arguments = options.clone();
    let mut put = |words: &[&std::ffi::OsStr]| arguments.extend(words.iter().map(Into::into));
    for path in shown.paths() {
        put(&["--ro-bind".as_ref(), path.as_ref(), path.as_ref()]);
    }
    for path in shown.hidden(folder) {
        put(&[
            "--size".as_ref(),
            "65536".as_ref(),
            "--tmpfs".as_ref(),
            path.as_ref(),
        ]);
    }
    for path in allowed.write.iter().map(PathBuf::as_path).chain([folder]) {
        put(&["--bind".as_ref(), path.as_ref(), path.as_ref()]);
    }
    put(&["--remount-ro", "/dev", "--remount-ro", "/"].map(AsRef::as_ref));
    let place = command.get_current_dir().unwrap_or(folder);
    let place = match place == folder {
        true => folder.to_owned(),
        false => real(place)?,
    };
    put(&["--chdir".as_ref(), place.as_ref()]);
    put(&[
        "--setenv".as_ref(),
        "PATH".as_ref(),
        shown.search_path().as_ref(),
    ]);
    put(&["--setenv".as_ref(), "HOME".as_ref(), folder.as_ref()]);
    for (name, value) in command.get_envs() {
        if let Some(value) = value {
            put(&["--setenv".as_ref(), name, value]);
        }
    }
    let most = bounds::most_bytes(folder) / 1024;
    let tasks = bounds::most_tasks();
    put(&[
        "--".as_ref(),
        tools.shell.as_ref(),
        "-p".as_ref(),
        "-c".as_ref(),
        INSIDE.as_ref(),
    ]);
    put(&[
        "sandbox".as_ref(),
        most.to_string().as_ref(),
        tasks.to_string().as_ref(),
    ]);
    put(&[program.as_ref()]);
    arguments.extend(command.get_args().map(OsString::from));
    Ok(tools.command(folder, &arguments))
}

/// The programs that make a sandbox.
struct Tools {
    bubblewrap: PathBuf,
    shell: PathBuf,
}

impl Tools {
    fn find() -> Result<Self> {
        let tool = |name: &str, title: &str| {
            let found = find_in_path(name).and_then(|path| path.canonicalize().ok());
            found.ok_or_else(|| {
                let what = format!("there is no {title} for --sandbox: `{name}` is not found, and nothing was run");
                let remedy = format!(
                    "on Debian `apt-get install {title}`, or trust the programs and leave --sandbox out"
                );
                Error::usage(what, remedy)
            })
        };
        Ok(Tools {
            bubblewrap: tool("bwrap", "bubblewrap")?,
            // It is started in the sandbox as well.
            shell: tool("bash", "bash").and_then(|shell| match is_of_system(&shell) {
                true => Ok(shell),
                false => {
                    let what = format!(
                        "{} is not a part of the system, as --sandbox needs it",
                        shell.display()
                    );
                    Err(Error::usage(what, "install bash by the system's packages"))
                }
            })?,
        })
    }

    /// The command that starts bubblewrap with these arguments.
    fn command(&self, folder: &Path, arguments: &[OsString]) -> Command {
        let octal = |byte: &u8| format!("\\{byte:03o}");
        let filter: String = seccomp::filter().iter().flatten().map(octal).collect();
        let home = folder.to_string_lossy();
        let home = match home.contains([':', '\n']) {
            true => "/",
            false => &home,
        };
        let passwd =
            format!("user:x:{USER}:{USER}::{home}:/bin/sh\nnobody:x:65534:65534::/:/bin/false");
        let group = format!("user:x:{USER}:\nnogroup:x:65534:");
        let mut command = Command::new(&self.shell);
        command
            .args(["-p", "-c", OUTSIDE, "sandbox", &filter, &passwd, &group])
            .arg("127.0.0.1 localhost sandbox\n::1 localhost")
            .arg(&self.bubblewrap)
            .args(arguments);
        command
    }

    /// The common part of all sandboxes of this process, tested once.
    fn options(&self) -> Result<&'static Vec<OsString>> {
        static OPTIONS: OnceLock<Result<Vec<OsString>, String>> = OnceLock::new();
        let tried = OPTIONS.get_or_init(|| {
            // Older releases cannot prevent a program from creating user namespaces; the filter can.
            self.attempt(true).or_else(|_| self.attempt(false))
        });
        tried.as_ref().map_err(|why| {
            let what = format!("there can be no sandbox here, and nothing was run: {why}");
            let remedy = "let users make namespaces (in a container `--privileged` or a seccomp profile that allows them, on Ubuntu \
                          `sysctl kernel.apparmor_restrict_unprivileged_userns=0`; in a chroot there are none), \
                          or trust the programs and leave --sandbox out";
            Error::usage(what, remedy)
        })
    }

    fn attempt(&self, newest: bool) -> Result<Vec<OsString>, String> {
        let options = common(newest);
        let mut arguments = options.clone();
        arguments.extend(["--", "/bin/sh", "-c", "exit 0"].map(OsString::from));
        let tried = self
            .command(Path::new("/"), &arguments)
            .stdin(Stdio::null())
            .output()
            .map_err(|e| e.to_string())?;
        if tried.status.success() {
            return Ok(options);
        }
        let said = String::from_utf8_lossy(&tried.stderr);
        let last = said.lines().rev().find(|line| !line.trim().is_empty());
        Err(last
            .unwrap_or("bwrap failed and said nothing")
            .trim()
            .to_owned())
    }
}

/// Namespaces, the system, and private folders.
fn common(newest: bool) -> Vec<OsString> {
    let mut words: Vec<OsString> = Vec::new();
    let mut put = |of: &[&str]| words.extend(of.iter().map(OsString::from));
    put(&[
        "--unshare-user",
        "--unshare-all",
        "--die-with-parent",
        "--new-session",
    ]);
    put(&["--uid", USER, "--gid", USER, "--hostname", "sandbox"]);
    if newest {
        put(&["--disable-userns"]);
    }
    if seccomp::filter().is_some() {
        put(&["--seccomp", "9"]);
    }
    put(&[
        "--ro-bind",
        "/usr",
        "/usr",
        "--ro-bind-try",
        "/nix/store",
        "/nix/store",
    ]);
    for place in SYSTEM {
        match std::fs::read_link(place) {
            Ok(to) => put(&["--symlink", &to.to_string_lossy(), place]),
            Err(_) => put(&["--ro-bind-try", place, place]),
        }
    }
    for name in configuration() {
        let path = format!("/etc/{name}");
        put(&["--ro-bind-try", &path, &path]);
    }
    for (descriptor, path) in [
        ("10", "/etc/passwd"),
        ("11", "/etc/group"),
        ("12", "/etc/hosts"),
    ] {
        put(&["--ro-bind-data", descriptor, path]);
    }
    put(&["--proc", "/proc", "--dev", "/dev"]);
    // The number of cores, and how they share memory, for MPI and the linear algebra libraries.
    for path in ["/sys/devices/system/cpu", "/sys/devices/system/node"] {
        put(&["--ro-bind-try", path, path]);
    }
    let size = memory::available().map_or(MOST_TEMPORARY, |there| MOST_TEMPORARY.min(there / 4));
    let size = size.to_string();
    for path in ["/tmp", "/dev/shm"] {
        put(&["--perms", "1777", "--size", &size, "--tmpfs", path]);
    }
    put(&["--symlink", "/tmp", "/var/tmp"]);
    words
}

/// The names of [`CONFIGURATION`], and those of Python's releases.
fn configuration() -> Vec<String> {
    let entries = std::fs::read_dir("/etc").into_iter().flatten().flatten();
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    let is_python = |name: &String| name.starts_with("python3.");
    let pythons = names.filter(is_python);
    CONFIGURATION
        .iter()
        .map(|&name| name.to_owned())
        .chain(pythons)
        .collect()
}
