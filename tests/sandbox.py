"""Programs that try to leave the sandbox: each way out, and whether it holds.

    python3 tests/sandbox.py PROGRAM [--as-user] [--without] [PART OF A NAME …]

As root with `--as-user` all is done by an ordinary user, with copies of the program and of this file. `--without` leaves
--sandbox out, to see that the ways lead out. What cannot be tried here is listed with the reason, and counts as neither.
Ends with 1 if something got out, and with 3 if there is no sandbox here and nothing ran.
"""

import ctypes
import json
import os
import pty
import resource
import select
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

options = {word for word in sys.argv[1:] if word.startswith("--")}
words = [word for word in sys.argv[1:] if not word.startswith("--")]
PROGRAM, PARTS = str(Path(words[0]).resolve()), words[1:]
SANDBOX = [] if "--without" in options else ["--sandbox"]
PYTHON = "/usr/bin/python3"
TOKEN = "token-5b1f0c"
PATIENCE = 120

results = {}


def found(name, escaped, evidence=""):
    """Whether a way led out; None: it was not tried, for the reason that is the evidence."""
    results[name] = (escaped, str(evidence)[:200])


def has_token(*texts):
    return next((text[max(0, text.find(TOKEN) - 60):][:120] for text in texts if TOKEN in text), None)


# What runs inside: all that needs no start of its own. `try_` says what came of an attempt; None is that nothing did.
LOOK = r'''
import ctypes, glob, json, os, pathlib, socket, struct, sys, time
given = json.loads(pathlib.Path(sys.argv[1]).read_text())
libc = ctypes.CDLL(None, use_errno=True)
TOKEN, told = given["token"], {}
def try_(name):
    def run(attempt):
        try:
            told[name] = attempt()
        except BaseException as e:
            told[name] = None
            told["why " + name] = repr(e)[:200]
    return run
def call(*arguments):
    if libc.syscall(*arguments) < 0:
        raise OSError(ctypes.get_errno(), "refused")
    return "done"
def secret(path):
    text = pathlib.Path(path).read_bytes()
    return path if TOKEN.encode() in text else None

try_("variables: its own")(lambda: [k for k, v in os.environ.items() if TOKEN in v] or None)
def of_others(what):
    seen = []
    for path in glob.glob("/proc/[0-9]*/" + what):
        try:
            seen += [path] if TOKEN.encode() in pathlib.Path(path).read_bytes() else []
        except OSError:
            pass
    return seen or None
try_("variables: those of its ancestors, in /proc/*/environ")(lambda: of_others("environ"))
try_("processes: their command lines")(lambda: of_others("cmdline"))
for name, path in given["secrets"].items():
    try_("files: " + name)(lambda path=path: secret(path))
try_("files: the system's list of users")(lambda: any(u in pathlib.Path("/etc/passwd").read_text() for u in given["users"]) or None)
try_("files: devices of the machine")(lambda: [p for p in ("/dev/kmsg", "/dev/mem", "/dev/sda", "/dev/vda", "/dev/loop0", "/dev/fuse", "/dev/kvm", "/dev/net/tun") if os.path.exists(p)] or None)
def write(path):
    with open(path, "a") as file:
        file.write("x")
    return path
for name, path in given["writes"].items():
    try_("writing: " + name)(lambda path=path: write(path))
try_("writing: the system")(lambda: next((p for p in ("/usr/lib/x-faceoff", "/etc/x-faceoff", "/bin/x-faceoff") if write_or(p)), None))
def write_or(path):
    try:
        return write(path)
    except OSError:
        return None
def full(path, most):
    """How many bytes go there, up to `most`."""
    chunk, count = b"x" * (1 << 22), 0
    try:
        with open(path, "wb", buffering=0) as file:
            while count < most:
                count += file.write(chunk)
    except OSError:
        pass
    try:
        os.unlink(path)
    except OSError:
        pass
    return count
try_("memory: files in the root folder and in /dev")(lambda: [p for p in ("/x-faceoff", "/dev/x-faceoff", "/run/x-faceoff") if full(p, 1 << 24) == 1 << 24] or None)
def connect(family, address):
    with socket.socket(family) as s:
        s.settimeout(3)
        s.connect(address)
    return "connected"
try_("network: a server of this machine")(lambda: connect(socket.AF_INET, ("127.0.0.1", given["port"])))
try_("network: interfaces besides its own")(lambda: [n for _, n in socket.if_nameindex() if n != "lo"] or None)
try_("sockets: by name, of another program")(lambda: connect(socket.AF_UNIX, given["socket"]))
try_("sockets: without a name in the file system")(lambda: connect(socket.AF_UNIX, "\0" + given["abstract"]))
def families():
    opened = []
    for family in (40, 17, 38, 31, 5):  # vsock, packets, the kernel's cryptography, Bluetooth, AppleTalk
        for kind in (socket.SOCK_STREAM, socket.SOCK_DGRAM, socket.SOCK_RAW, socket.SOCK_SEQPACKET):
            try:
                socket.socket(family, kind).close()
                opened.append(family)
            except OSError:
                pass
    return opened or None
try_("sockets: of the machine, which no namespace has")(families)
def kill():
    os.kill(given["victim"], 0)
    return pathlib.Path(f"/proc/{given['victim']}/comm").read_text().strip() == "sleep" or None
try_("processes: signals to one outside")(kill)
try_("processes: all that run are seen")(lambda: (lambda n: n if n > 8 else None)(len(glob.glob("/proc/[0-9]*"))))
def trace():
    if not kill(): return None
    if libc.ptrace(16, given["victim"], None, None) < 0: raise OSError(ctypes.get_errno(), "refused")
    libc.ptrace(17, given["victim"], None, None)
    return "attached"
try_("processes: tracing one outside")(trace)
def memory():
    if not kill(): return None
    return open(f"/proc/{given['victim']}/mem", "rb").fileno() and "opened"
try_("processes: memory of one outside")(memory)
try_("processes: limits of one outside")(lambda: (kill() and __import__("resource").prlimit(given["victim"], 7)) or None)
try_("processes: files of one outside, by /proc/PID/root")(lambda: kill() and os.listdir(f"/proc/{given['victim']}/root"))
try_("terminals: the user's is opened")(lambda: os.open("/dev/tty", os.O_RDWR) and "opened")
def typed():
    import fcntl, termios
    for path in ("/dev/tty", *glob.glob("/dev/pts/[0-9]*"), "/proc/self/fd/0", "/proc/self/fd/1", "/proc/self/fd/2"):
        try:
            fd = os.open(path, os.O_RDWR | os.O_NOCTTY)
            for c in b"echo typed-by-an-engine\n":
                fcntl.ioctl(fd, termios.TIOCSTI, bytes([c]))
            return path
        except OSError:
            pass
    return None
try_("terminals: keys are typed into the user's")(typed)
def descriptors():
    seen = []
    for number in range(0, 256):
        try:
            where = os.readlink(f"/proc/self/fd/{number}")
        except OSError:
            continue
        if "descriptor" in where:
            seen.append((number, where))
    return seen or None
try_("descriptors: open files of the user")(descriptors)
try_("descriptors: those of its ancestors, in /proc/*/fd")(lambda: [p for p in glob.glob("/proc/[0-9]*/fd/*") if TOKEN.encode() in (lambda p: open(p, "rb", 0).read(99) if os.path.isfile(p) and "descriptor" in os.readlink(p) else b"")(p)] or None)
try_("namespaces: one of users")(lambda: call(272, 0x10000000) if os.uname().machine == "x86_64" else libc.unshare(0x10000000) == 0 or None)
def cloned():
    # clone, which a filter of flags would have to look into, rather than unshare
    if os.uname().machine != "x86_64": return None
    pid = libc.syscall(56, 0x10000000 | 17, 0, 0, 0, 0)
    if pid == 0: os._exit(0)
    if pid < 0: raise OSError(ctypes.get_errno(), "refused")
    os.waitpid(pid, 0)
    return "cloned"
try_("namespaces: one of users, by clone")(cloned)
def entered():
    for path in glob.glob("/proc/[0-9]*/ns/mnt"):
        if os.readlink(path) != os.readlink("/proc/self/ns/mnt"):
            fd = os.open(path, os.O_RDONLY)
            if libc.setns(fd, 0) == 0: return path
    return None
try_("namespaces: that of another process")(entered)
try_("mounts: of a folder elsewhere")(lambda: "mounted" if libc.mount(b"tmpfs", b"/tmp", b"tmpfs", 0, None) == 0 else None)
try_("mounts: the old root is still there")(lambda: [p for p in ("/oldroot", "/newroot", "/.old") if os.path.exists(p)] or None)
try_("mounts: made writable again")(lambda: "remounted" if libc.mount(None, b"/usr", None, 32 | 4096, None) == 0 else None)
def handle():
    buffer = ctypes.create_string_buffer(struct.pack("Ii", 128, 0) + bytes(128))
    mount = ctypes.c_int()
    libc.name_to_handle_at(-100, b"/usr", buffer, ctypes.byref(mount), 0)
    fd = os.open("/usr", os.O_RDONLY)
    got = libc.open_by_handle_at(fd, buffer, os.O_RDONLY)
    return "opened" if got >= 0 else None
try_("mounts: files by their handles")(handle)
try_("rights: capabilities, or more by setuid programs")(lambda: (lambda t: None if "NoNewPrivs:\t1" in t and all(int(l.split()[1], 16) == 0 for l in t.splitlines() if l.startswith(("CapPrm", "CapEff", "CapInh", "CapAmb"))) else "they are there")(pathlib.Path("/proc/self/status").read_text()))
try_("rights: settings of the kernel")(lambda: [p for p in ("/proc/sys/kernel/core_pattern", "/proc/sys/kernel/hostname", "/proc/sysrq-trigger", "/proc/sys/vm/drop_caches") if os.access(p, os.W_OK) and open(p, "r+b" if "sys/" in p else "ab")] or None)
def keys():
    found = libc.syscall(250, 10, -3, b"user", b"faceoff-red-team", 0)
    if found < 0: raise OSError(ctypes.get_errno(), "refused")
    buffer = ctypes.create_string_buffer(99)
    libc.syscall(250, 11, found, buffer, 99)
    return TOKEN.encode() in buffer.raw or None
try_("keys: of the user's session")(lambda: keys() if os.uname().machine == "x86_64" else None)
def segment():
    libc.shmget.restype = ctypes.c_int
    got = libc.shmget(given["segment"], 64, 0)
    return "found" if got >= 0 else None
try_("memory: shared by System V, of another program")(segment)
def hidden_memory():
    seen = []
    if libc.shmget(0, 1 << 28, 0o1600) >= 0: seen.append("System V")
    if hasattr(os, "memfd_create"):
        try: os.close(os.memfd_create("x")); seen.append("memfd")
        except OSError: pass
    return seen or None
try_("memory: kinds that no limit sees")(hidden_memory)
def sparse():
    with open("huge", "wb") as file:
        file.truncate(1 << 45)
    os.unlink("huge")
    return "32 TB"
try_("disk: a file of any size")(sparse)
import resource
try_("disk: cores of crashes")(lambda: None if resource.getrlimit(resource.RLIMIT_CORE)[1] == 0 else "written")
pathlib.Path("out").mkdir(exist_ok=True)
pathlib.Path("out/told.json").write_text(json.dumps(told))
print("\x1b]0;title-of-an-engine\x07 said", flush=True)
print("error \x1b[2J\x1b]0;title-of-an-engine\x07 ended on purpose", flush=True)
raise SystemExit(3)
'''


class World:
    """A user with secrets in the usual places, and what else runs on the machine."""

    def __init__(self):
        self.at = Path(tempfile.mkdtemp(prefix="red-team-", dir=os.environ.get("TMPDIR", "/tmp")))
        self.home = self.at / "home"
        self.project = self.home / "project"
        self.engine = self.project / "engines"
        self.undo = [lambda: shutil.rmtree(self.at, ignore_errors=True)]
        for folder in (self.engine / ".git", self.home / "bin", self.home / ".ssh", self.home / ".cache/faceoff"):
            folder.mkdir(parents=True)
        self.secrets = {}
        self.secret("of the home folder", self.home / ".ssh/id")
        self.secret("of the rest of the project", self.project / "settings")
        self.secret("settings of Git, beside the engine", self.engine / ".git/config")
        self.secret("beside the folders of the run", self.at / "neighbour")
        for name, place in (
            ("temporary, of other programs", "/tmp"), ("temporary, of the other kind", "/var/tmp"), ("in shared memory", "/dev/shm"),
            ("of services", "/srv"), ("of services that run", "/run"), ("of programs", "/opt"), ("variable", "/var/lib"),
            ("of builds", "/builds"), ("settings of the system", "/etc"), ("mounted", "/mnt"),
        ):
            path = Path(place) / f"{self.at.name}-secret"
            try:
                self.secret(name, path)
                self.undo.append(lambda path=path: path.unlink(missing_ok=True))
            except OSError as e:
                found(f"files: {name}", None, f"{place} cannot be written here: {e.strerror}")
        (self.home / ".bashrc").write_text("# the user's\n")
        self.env = {
            "PATH": os.environ.get("PATH", "/usr/bin:/bin"), "HOME": str(self.home), "TMPDIR": str(self.at), "LANG": "C.UTF-8",
            "SECRET": TOKEN, "XDG_CACHE_HOME": str(self.home / ".cache"),
        }
        self.serve()
        self.victim = subprocess.Popen(["sleep", "600"])
        self.undo.append(lambda: (self.victim.kill(), self.victim.wait()))
        # In one process: what a shell starts would outlive it, and hold our output.
        self.lines = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)", TOKEN])
        self.undo.append(lambda: (self.lines.kill(), self.lines.wait()))

    def secret(self, name, path):
        path.write_text(TOKEN + "\n")
        self.secrets[name] = str(path)

    def serve(self):
        self.servers = [socket.socket(), socket.socket(socket.AF_UNIX), socket.socket(socket.AF_UNIX)]
        self.abstract = f"{self.at.name}-abstract"
        for server, address in zip(self.servers, [("127.0.0.1", 0), str(self.at / "socket"), "\0" + self.abstract]):
            server.bind(address)
            server.listen()
        self.port = self.servers[0].getsockname()[1]

    def end(self):
        for undo in reversed(self.undo):
            undo()

    def write(self, path, text, mode=0o644):
        path = self.engine / path
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        path.chmod(mode)
        return path

    def engine_file(self, name, *command, folder=""):
        return self.write(f"{folder}{name}.toml", f"name = {json.dumps(name)}\ncommand = {json.dumps(list(map(str, command)))}\n")

    def verify(self, file, *more, cwd=None, sandbox=SANDBOX, **kwargs):
        """Runs an engine on a small problem."""
        words = ["verify", "one-zone", "--n", "4", "--methods", "cr", "--engines", f"rust,{file}"]
        return self.run(*words, *sandbox, *more, cwd=cwd, **kwargs)

    def face_off(self, name, command, *more, numbers="v.csv", **kwargs):
        """Runs a face-off whose first code is this command."""
        text = f"""name = "mine"
[codes.a]
command = {json.dumps(command)}
mesh = "none"
numbers = "{numbers}"
[codes.b]
command = ["/bin/sh", "-c", "echo x,1 > $0/v.csv", "{{out}}"]
mesh = "none"
numbers = "v.csv"
[numbers.x]
same = "problem"
rtol = 1e-3
"""
        self.write(f"{name}/f.toml", text)
        return self.run("verify", *RUN, f"{name}/f.toml", *SANDBOX, "--junit", f"{name}.xml", *more, **kwargs)

    def run(self, *words, cwd=None, env=None, limit=PATIENCE, **kwargs):
        began = time.monotonic()
        process = subprocess.run(
            [PROGRAM, *map(str, words)], cwd=cwd or self.engine, env={**self.env, **(env or {})}, stdin=subprocess.DEVNULL,
            capture_output=True, text=True, errors="replace", timeout=limit, check=False, **kwargs,
        )
        process.seconds = time.monotonic() - began
        process.said = process.stdout + process.stderr
        return process


def under(program, name):
    return name in subprocess.run([program, "verify", "--help"], capture_output=True, text=True, check=False).stdout


RUN = ["--run"] if under(PROGRAM, "--run") else []


def session_key():
    """A key in a session of its own, as services keep passwords there. None, or why there is none."""
    if os.uname().machine != "x86_64":
        return "numbers of system calls are known here for x86_64 alone"
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.syscall(250, 1, None) < 0:
        return f"this kernel keeps no keys: {os.strerror(ctypes.get_errno())}"
    token = TOKEN.encode()
    if libc.syscall(248, b"user", b"faceoff-red-team", token, len(token), -3) < 0:
        return f"no key can be kept: {os.strerror(ctypes.get_errno())}"
    return None


def segment():
    libc = ctypes.CDLL(None, use_errno=True)
    key = 0x5B1F0C
    got = libc.shmget(key, 64, 0o1600)
    return key, got


def in_terminal(words, cwd, env, seconds):
    """What a user sees of a command in a terminal, with open files 7 and 63 besides."""
    name = Path(env["HOME"]) / "descriptor"
    name.write_text(TOKEN)
    child, terminal = pty.fork()
    if child == 0:
        fd = os.open(name, os.O_RDWR)
        for number in (7, 63):
            os.dup2(fd, number)
        os.chdir(cwd)
        os.execvpe(words[0], words, env)
    seen, end = b"", time.monotonic() + seconds
    while time.monotonic() < end:
        if select.select([terminal], [], [], 0.2)[0]:
            try:
                part = os.read(terminal, 65536)
            except OSError:
                break
            if not part:
                break
            seen += part
    os.close(terminal)
    os.waitpid(child, 0)
    return seen.decode(errors="replace")


def looks(world):
    if not os.access(PYTHON, os.X_OK):
        found("all that one program looks for", None, f"there is no {PYTHON}")
        return
    no_key = session_key()
    key, of_segment = segment()
    given = {
        "token": TOKEN, "secrets": {**world.secrets, "answers of other codes": str(world.engine / "kept/other/answer")},
        "writes": {
            "the folder of the engine": str(world.engine / "x"), "the home folder": str(world.home / "x"),
            "the user's cache": str(world.home / ".cache/faceoff/x"), "temporary files of others": str(world.at / "neighbour"),
        },
        "users": [line.split(":")[0] for line in Path("/etc/passwd").read_text().splitlines() if "/home/" in line or ":0:0:" in line],
        "port": world.port, "socket": str(world.at / "socket"), "abstract": world.abstract, "victim": world.victim.pid, "segment": key,
    }
    world.write("look.py", LOOK)
    world.write("given.json", json.dumps(given))
    world.write("kept/other/answer", TOKEN)
    world.write("kept/other/job.json", "")
    world.engine_file("look", PYTHON, "look.py", "given.json")
    words = [PROGRAM, "verify", "one-zone", "--n", "4", "--methods", "cr", "--engines", "rust,./look.toml", "--keep", "kept", *SANDBOX]
    seen = in_terminal(words, world.engine, world.env, PATIENCE)
    # What it wrote is where it was to write, or in one of the places that it tried.
    file = world.engine / "kept/look/out/told.json"
    if not file.exists():
        raise SystemExit(f"the program that looks around did not run: {seen}")
    told = json.loads(file.read_text())
    if of_segment >= 0:
        ctypes.CDLL(None).shmctl(of_segment, 0, None)
    for name, value in told.items():
        if name.startswith("why "):
            continue
        place = given["writes"].get(name.removeprefix("writing: "))
        if place:
            # What it writes into memory of its own goes with it.
            was = TOKEN + "\n" if place in world.secrets.values() else ""
            found(name, Path(place).exists() and Path(place).read_text() != was, value or told.get("why " + name))
        elif name == "keys: of the user's session" and no_key:
            found(name, None, no_key)
        elif name == "memory: shared by System V, of another program" and of_segment < 0:
            found(name, None, "this kernel has none")
        else:
            found(name, value is not None and value is not False, value or told.get("why " + name, ""))
    found("terminals: what a program says is obeyed", "\x1b]0;title" in seen or "\x1b[2J" in seen, repr(seen[-200:]))


def links(world):
    """The log, the folder for results, results and answers, replaced by links to what is not theirs."""
    secret = world.secrets["of the home folder"]

    def told(run, name):
        junit = world.engine / f"{name}.xml"
        return has_token(run.said, junit.read_text() if junit.exists() else "")

    for name, script in (
        ("the log, to a file of the user", f"rm -f log.txt; ln -s {secret} log.txt; exit 1"),
        ("the log, to the variables of faceoff", "rm -f log.txt; ln -s /proc/self/environ log.txt; exit 1"),
        ("a status, to a file of the user", f"mkdir -p out; ln -s {secret} out/status.json"),
        ("the folder of answers, to one of the user", f"rm -rf out; mkdir -p {world.home}/.ssh 2>/dev/null; ln -s {world.home}/.ssh out; ln -s id out/status.json"),
    ):
        label = f"l{len(results)}"
        world.engine_file(label, "/bin/sh", "-c", script)
        run = world.verify(f"./{label}.toml", "--junit", f"{label}.xml")
        found(f"links: {name}", bool(told(run, label)), told(run, label) or run.stderr)
    (world.home / ".ssh/status.json").write_text(TOKEN)
    for name, command, numbers in (
        ("the folder of results, to one of the user", ["/bin/sh", "-c", f"rmdir $0; ln -s {world.home}/.ssh $0", "{out}"], "id"),
        ("the folder of results, to that of a process", ["/bin/sh", "-c", "rmdir $0; ln -s /proc/self $0", "{out}"], "environ"),
        ("a result, to a file of the user", ["/bin/sh", "-c", f"ln -s {secret} $0/v.csv", "{out}"], "v.csv"),
        ("a folder in that of results", ["/bin/sh", "-c", f"ln -s {world.home}/.ssh $0/d", "{out}"], "d/id"),
        ("a result that names others", ["/bin/sh", "-c", f"echo hi > $0/v.csv; ln {secret} $0/w.csv || ln -s {secret} $0/w.csv", "{out}"], "w.csv"),
    ):
        label = f"l{len(results)}"
        run = world.face_off(label, command, numbers=numbers)
        found(f"links: {name}", bool(told(run, label)), told(run, label) or run.stderr)
    # A race: something goes on replacing the result after the end of the program.
    script = f"""echo x,1 > $0/v.csv
( while :; do ln -sf {secret} $0/l; mv -f $0/l $0/v.csv; echo x,1 > $0/w; mv -f $0/w $0/v.csv; done ) >/dev/null 2>&1 &
sleep 0.1"""
    texts = [told(world.face_off("race", ["/bin/sh", "-c", script, "{out}"]), "race") for _ in range(3)]
    found("races: a result is exchanged while it is read", any(texts), next(filter(None, texts), ""))
    run = world.face_off("rec", ["/bin/sh", "-c", f"echo x,1 > $0/v.csv; mkdir $0/d; ln -s {world.home}/.ssh $0/d/l; ln -s {secret} $0/s", "{out}"], "--record", "record")
    copied = [str(p) for p in (world.engine / "record").rglob("*") if p.is_file() and TOKEN in p.read_text(errors="replace")]
    found("links: what a record copies", bool(copied), copied)
    # The same the other way: what is written for the program.
    world.write("copy/signorini.edp", "include \"nitsche.idp\"\n")
    (world.engine / "copy/nitsche.idp").symlink_to(secret)
    world.write("copied.toml", 'name = "copied"\ncompanion = "freefem"\nscripts = "copy"\n')
    if shutil.which("FreeFem++-nw"):
        run = world.verify("./copied.toml", "--keep", "kept-copy")
        kept = world.engine / "kept-copy/copied/nitsche.idp"
        text = kept.read_text() if kept.exists() else ""
        found("links: scripts of a companion", bool(has_token(run.said, text)), run.stderr)
    else:
        found("links: scripts of a companion", None, "there is no FreeFEM")


def logs(world):
    world.engine_file("zero", "/bin/sh", "-c", "rm -f log.txt; ln -s /dev/zero log.txt; exit 1")

    def limited():
        resource.setrlimit(resource.RLIMIT_AS, (1 << 32, 1 << 32))

    peak = world.verify("./zero.toml", preexec_fn=limited)
    found("logs: one without an end", peak.seconds > 60 or peak.returncode < 0 or "memory" in peak.stderr, peak.stderr)
    world.engine_file("flood", "/bin/sh", "-c", "yes aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa >&2")
    world.verify("./flood.toml", "--time-limit", "3s", "--keep", "kept-flood")
    size = (world.engine / "kept-flood/flood/log.txt").stat().st_size
    found("logs: one that fills the disk", size > 100e6, f"{size} bytes")
    shutil.rmtree(world.engine / "kept-flood")
    target = world.home / ".bashrc"
    world.engine_file("watch", "/bin/sh", "-c", f"rm -f log.txt; ln -s {target} log.txt; touch out/ready; exec sleep 30")
    words = [PROGRAM, "verify", "one-zone", "--n", "4", "--methods", "cr", "--engines", "rust,./watch.toml", "--keep", "kept-watch", *SANDBOX]
    process = subprocess.Popen(words, cwd=world.engine, env=world.env, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    end = time.monotonic() + 20
    while not (world.engine / "kept-watch/watch/out/ready").exists() and time.monotonic() < end:
        time.sleep(0.05)
    process.kill()
    process.wait()
    time.sleep(0.5)
    found("logs: what faceoff adds goes elsewhere", target.read_text() != "# the user's\n", target.read_text())


def commands(world):
    """Commands that would have more shown than their own folder."""
    secret = world.secrets["of the home folder"]
    peek = f"cat {secret} {world.secrets['beside the folders of the run']}; exit 3"
    for name, prefix in (("`..` after a folder of the project", "engines/../../../../../../../../../bin/sh"), ("`..` after nothing", "../" * 12 + "bin/sh")):
        world.engine_file("dots", prefix, "-c", peek)
        run = world.verify("engines/dots.toml", cwd=world.project)
        found(f"commands: {name}", bool(has_token(run.said)), has_token(run.said) or run.stderr)
    (world.home / "bin/solve").write_text(f"#!/bin/sh\n{peek}\n")
    (world.home / "bin/solve").chmod(0o755)
    world.engine_file("solve", world.home / "bin/solve")
    run = world.verify("./solve.toml")
    found("commands: a program in ~/bin", bool(has_token(run.said)), has_token(run.said) or run.stderr)
    shutil.copy(world.home / "bin/solve", world.home / "solve")
    world.engine_file("athome", world.home / "solve")
    run = world.verify("./athome.toml")
    found("commands: a program in the home folder", bool(has_token(run.said)), has_token(run.said) or run.stderr)
    (world.home / "home.toml").write_text(f'name = "home"\ncommand = ["/bin/sh", "-c", {json.dumps(peek)}]\n')
    run = world.verify("./home.toml", cwd=world.home)
    found("commands: an engine in the home folder", bool(has_token(run.said)), has_token(run.said) or run.stderr)
    (world.engine / "up").symlink_to("../..")
    (world.home / "linked.toml").write_text((world.home / "home.toml").read_text().replace('"home"', '"linked"'))
    run = world.verify("up/linked.toml")
    found("commands: an engine in the home folder, by a link", bool(has_token(run.said)), has_token(run.said) or run.stderr)
    world.write("env/bin/run", f"#!/bin/sh\n{peek}\n", 0o755)
    world.write("env/pyvenv.cfg", f"home = {world.home}/.ssh/x\n")
    (world.home / ".ssh/x").mkdir(exist_ok=True)
    world.engine_file("environment", "env/bin/run")
    run = world.verify("./environment.toml")
    found("commands: an environment that names folders of the user", bool(has_token(run.said)), has_token(run.said) or run.stderr)


def resources(world):
    if not os.access(PYTHON, os.X_OK):
        found("resources", None, f"there is no {PYTHON}")
        return
    world.write("bomb.py", """
import os, sys, time
count = 0
try:
    for _ in range(6000):
        if os.fork() == 0:
            time.sleep(20)
            os._exit(0)
        count += 1
        if count % 100 == 0: open("out/hundreds", "a").write(".")
except OSError: pass
raise SystemExit(3)
""")
    world.engine_file("bomb", PYTHON, "bomb.py")
    run = world.verify("./bomb.toml", "--keep", "kept-bomb", "--time-limit", "20s")
    # It may be ended at any moment: each hundred is one letter.
    hundreds = world.engine / "kept-bomb/bomb/out/hundreds"
    count = 100 * len(hundreds.read_text()) if hundreds.exists() else 0
    found("resources: processes without end", count > 5000, f"{count} processes; {run.stderr}")
    world.engine_file("shm", "/bin/sh", "-c", "for k in 1 2 3 4 5 6 7; do head -c 60000000 /dev/zero > /dev/shm/x$k; head -c 60000000 /dev/zero > /tmp/x$k; done; sleep 2; cat /dev/shm/x? /tmp/x? | wc -c > out/bytes; rm /dev/shm/x? /tmp/x?; exit 4")
    run = world.verify("./shm.toml", "--memory", "500MB", "--keep", "kept-shm", env={"RAYON_NUM_THREADS": "2"})
    subprocess.run("rm -f /dev/shm/x[1-7] /tmp/x[1-7]", shell=True, check=False)
    held = world.engine / "kept-shm/shm/out/bytes"
    held = int(held.read_text() or 0) if held.exists() else 0
    found("resources: files in memory, beyond --memory", held > 500_000_000, f"{held} bytes; {run.stderr}")
    world.engine_file("deep", "/bin/sh", "-c", "for k in $(seq 300); do mkdir d && cd d; done; sleep 20; exit 3")
    run = world.verify("./deep.toml", "--time-limit", "10s")
    found("resources: folders without end", "100 deep" not in run.stderr, run.stderr)
    alive = f"{world.at.name}-daemon"
    world.write("daemon.py", f"""
import os
if os.fork() == 0:
    os.setsid()
    if os.fork() == 0:
        os.execve("/bin/sleep", ["{alive}", "60"], {{}})
    os._exit(0)
raise SystemExit(3)
""")
    world.engine_file("daemon", PYTHON, "daemon.py")
    run = world.verify("./daemon.toml")
    found("resources: a daemon that holds the output keeps faceoff", run.seconds > 50, f"{run.seconds:.1f} s")
    left = subprocess.run(["pgrep", "-f", alive], capture_output=True, text=True, check=False).stdout.split()
    for number in left:
        os.kill(int(number), signal.SIGKILL)
    found("resources: a daemon outlives the run", bool(left), left)


def refusals(world):
    """Where there is no sandbox nothing runs."""
    world.engine_file("mark", "/bin/sh", "-c", f"echo ran > {world.engine}/ran; exit 3")
    tools = world.at / "tools"
    tools.mkdir()
    for name in ("sh", "env", "bash", "cat"):
        (tools / name).symlink_to(shutil.which(name))
    for name, script in (("there is no bubblewrap", None), ("the system makes no namespaces", "#!/bin/sh\necho 'bwrap: No permissions' >&2\nexit 1\n")):
        if script:
            (tools / "bwrap").write_text(script)
            (tools / "bwrap").chmod(0o755)
        run = world.verify("./mark.toml", env={"PATH": str(tools)})
        ran = (world.engine / "ran").exists() or run.returncode != 2 or "nothing was run" not in run.stderr
        found(f"without a sandbox: {name}", ran, run.stderr)
        (world.engine / "ran").unlink(missing_ok=True)


def main():
    if "--as-user" in options and os.getuid() == 0:
        at = Path(tempfile.mkdtemp(prefix="as-user-"))
        try:
            for file in (PROGRAM, __file__):
                shutil.copy(file, at)
            at.chmod(0o755)
            there = [str(at / Path(file).name) for file in (PROGRAM, __file__)]
            (at / "tmp").mkdir()
            os.chown(at / "tmp", 65534, 65534)
            words = ["setpriv", "--reuid", "65534", "--regid", "65534", "--clear-groups", "env", f"TMPDIR={at}/tmp", PYTHON, there[1], there[0]]
            rest = [option for option in options if option != "--as-user"]
            return subprocess.run([*words, *rest, *PARTS], cwd=at, check=False).returncode
        finally:
            shutil.rmtree(at, ignore_errors=True)
    probe = subprocess.run(["bwrap", "--unshare-user", "--unshare-all", "--ro-bind", "/", "/", "true"], capture_output=True, text=True, check=False) if shutil.which("bwrap") else None
    has_sandbox = probe is not None and probe.returncode == 0
    world = World()
    began = time.monotonic()
    try:
        parts = [looks, links, logs, commands, resources] if has_sandbox or not SANDBOX else []
        if SANDBOX:
            parts.append(refusals)
        for part in parts:
            if not PARTS or any(word in part.__name__ for word in PARTS):
                part(world)
                print(f"{part.__name__}: {time.monotonic() - began:.1f} s", file=sys.stderr)
    finally:
        world.end()
    escaped = {name: why for name, (out, why) in results.items() if out}
    untried = {name: why for name, (out, why) in results.items() if out is None}
    for name, why in escaped.items():
        print(f"got out: {name}: {why}")
    for name, why in untried.items():
        print(f"not run: {name}: {why}")
    tried = len(results) - len(untried)
    who = "root" if os.getuid() == 0 else "an ordinary user"
    print(f"{tried - len(escaped)} of {tried} ways out are closed, {len(untried)} were not tried; as {who}, in {time.monotonic() - began:.0f} s")
    if not has_sandbox and SANDBOX:
        print("not run: all but what happens without a sandbox, as this system makes none" + (f": {probe.stderr.strip()}" if probe else " (no bwrap)"))
        return 1 if escaped else 3
    return 1 if escaped else 0


if __name__ == "__main__":
    sys.exit(main())
