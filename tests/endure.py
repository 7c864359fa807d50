"""What can happen to a run: does each of it, and tells what the user saw and what was kept, as a table.

    python3 tests/endure.py PROGRAM [PART OF A NAME …]

Ends with 1 if something was not as it must be. The full and the read-only disk want root, or user namespaces; a clock
that jumps wants libfaketime (Debian: faketime), without which only the times of files do.
"""

import contextlib
import fcntl
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SOURCE = Path(__file__).resolve().parent.parent
PROGRAM = str(Path(sys.argv[1]).resolve())
SMALL = ["verify", "one-zone", "--n", "4", "--methods", "cr"]


class Wrong(Exception):
    pass


def must(condition, *what):
    if not condition:
        raise Wrong(" ".join(str(w) for w in what))


def start(words, cwd, env=None, **more):
    environment = {**os.environ, "FACEOFF_ENDURE": str(cwd), **(env or {})}
    return subprocess.Popen(
        [PROGRAM, *map(str, words)], cwd=cwd, env=environment, text=True, stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, **more
    )


# Only what hangs takes so long, on the busiest machine: no verdict is to depend on the clock.
PATIENCE = 1800


def run(words, cwd, env=None, **more):
    process = start(words, cwd, env, **more)
    out, err = process.communicate(timeout=PATIENCE)
    return process.returncode, out, err.strip()


def of_run(cwd):
    """The processes that a run in `cwd` left: all that have its mark in their environment."""
    found = []
    for entry in Path("/proc").iterdir():
        with contextlib.suppress(OSError, ValueError):
            mark = f"FACEOFF_ENDURE={cwd}".encode()
            if mark in (entry / "environ").read_bytes().split(b"\0"):
                found.append((int(entry.name), (entry / "cmdline").read_bytes().replace(b"\0", b" ").decode().strip()))
    return [(pid, line) for pid, line in found if line]


def wait_for(condition):
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        if value := condition():
            return value
        time.sleep(0.02)
    raise Wrong("waited in vain")


def nothing_left(cwd):
    wait_for(lambda: not of_run(cwd))


def companion(folder, which, old, new, name="changed"):
    """An engine file for a companion with one change."""
    copy = folder / f"copy of {name}"
    shutil.copytree(SOURCE / which, copy, dirs_exist_ok=True)
    places = 0
    for path in copy.iterdir():
        if path.is_file() and path.suffix in (".py", ".edp"):
            text = path.read_text()
            places += text.count(old)
            path.write_text(text.replace(old, new))
    must(places == 1, f"{old!r} is {places} times in the {which} companion")
    file = folder / f"{name}.toml"
    file.write_text(f'name = "{name}"\ncompanion = "{which}"\nscripts = "{copy.name}"\n')
    return file.name


FIRST = "if (cases < 1) fail("


def freefem_that(folder, does, name="changed"):
    return companion(folder, "freefem", FIRST, f"{does} {FIRST}", name)


def is_json(path):
    return path.exists() and isinstance(json.loads(path.read_text()), dict)


@contextlib.contextmanager
def disk(folder, options):
    """A file system of its own, mounted on `folder`."""
    folder.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", options, "tmpfs", folder], check=True)
    try:
        yield folder
    finally:
        subprocess.run(["umount", "-l", folder], check=True)


# ---- One after the other ---------------------------------------------------------------------------------------------


def killed_engine(at):
    engine = freefem_that(at, 'exec("kill -9 $PPID; sleep 5");')
    code, _, err = run([*SMALL, "--engines", f"rust,{engine}", "--keep", "jobs"], at)
    must(code == 2 and "was killed from outside" in err, code, err)
    nothing_left(at)
    must((at / "jobs/changed/log.txt").exists())
    return "exit 2; the other engines' answers are told", err, "the job folder, where --keep names one"


def killed_faceoff(at):
    engine = freefem_that(at, 'exec("sleep 613.5");')
    process = start([*SMALL, "--engines", f"rust,{engine}", "--keep", "jobs", "--json", "out.json"], at)
    wait_for(lambda: any(line == "sleep 613.5" for _, line in of_run(at)))
    process.kill()
    process.communicate()
    nothing_left(at)
    said = (at / "jobs/changed/log.txt").read_text().strip()
    must("faceoff itself was ended" in said, said)
    must(not (at / "out.json").exists() and not (at / "jobs/changed/out/status.json").exists())
    code, _, err = run([*SMALL, "--engines", "rust,freefem", "--keep", "jobs"], at)
    must(code == 0, "the folder cannot be used again:", err)
    return "every child ended", f"nothing; log.txt: {said}", "the job folder, without a status"


def killed_faceoff_with_ranks(at):
    line = "        check_ranks(comm)\n"
    engine = companion(at, "fenicsx", line, line + "        time.sleep(617)\n")
    process = start([*SMALL, "--engines", f"rust,{engine}", "--ranks", "2"], at)
    wait_for(lambda: sum("-m mpi4py" in line and "mpirun" not in line for _, line in of_run(at)) == 2)
    time.sleep(1)
    process.kill()
    process.communicate()
    nothing_left(at)
    return "mpirun and both ranks ended", "nothing", "nothing"


def full_disk(at):
    seen = []
    with disk(at / "full", "size=256k") as full:
        code, _, err = run(["verify", "one-zone", "--n", "64", "--engines", "rust,freefem"], at, {"TMPDIR": str(full)})
        must(code == 2 and "No space left" in err, code, err)
        must(not any(full.iterdir()), "left:", *full.iterdir())
        seen.append(err.splitlines()[-1])
        for words in (
            ["solve", "one-zone", "--n", "128", "--out", "full/u.vtu"],
            ["verify", "one-zone", "--n", "64", "--engines", "rust,freefem", "--report", "full/report"],
            ["mesh", "make", "one-zone", "full/mesh.msh", "--n", "128"],
        ):
            code, _, err = run(words, at)
            must(code == 2 and "No space left" in err, words, code, err)
            # What says that the run failed may be there; nothing of its results.
            left = [path for path in full.rglob("*") if path.is_file()]
            left = [path for path in left if "No space left" not in path.read_text() and path.name != ".faceoff-report"]
            must(not left, "left:", *left)
    # Nor must what an earlier run said pass for this one's.
    with disk(at / "filled", "size=4m") as filled:
        outputs = ["--report", "filled/page", "--json", "filled/a.json", "--junit", "filled/a.xml", "--badge", "filled/a.svg"]
        code, _, err = run([*SMALL, "--engines", "rust,freefem", *outputs], at)
        must(code == 0, code, err)
        with open(filled / "filler", "wb", buffering=0) as filler, contextlib.suppress(OSError):
            while True:
                filler.write(bytes(4096))
        code, _, err = run([*SMALL, "--engines", "rust,freefem", *outputs], at)
        must(code == 2 and "is removed" in err, code, err)
        for name in ["page/index.html", "a.json", "a.xml", "a.svg"]:
            path = filled / name
            must(not path.exists() or "agree" not in path.read_text(), "an earlier verdict is left:", path)
    # What an engine cannot write must not pass for an answer.
    with disk(at / "small", "size=1500k") as small:
        code, _, err = run(["verify", "one-zone", "--n", "64", "--engines", "rust,freefem"], at, {"TMPDIR": str(small)})
        must(code == 2, code, err)
        must(not any(small.iterdir()))
        seen.append(err.splitlines()[-1])
    return "exit 2", "; ".join(seen), "at most a page that says so; temporary folders removed"


def read_only_folder(at):
    with disk(at / "fixed", "size=4m") as fixed:
        (fixed / "scene.toml").write_text((SOURCE / "crates/fem/src/scene/builtin/one-zone.toml").read_text())
        subprocess.run(["mount", "-o", "remount,ro", fixed], check=True)
        seen = []
        for words in (["--json", "out.json"], ["--keep", "jobs"], ["--report", "report"], ["--resume", "kept"]):
            code, _, err = run([*SMALL, "--engines", "rust,freefem", *words], fixed)
            must(code == 2 and re.search("read-only file ?system", err, re.IGNORECASE), words, code, err)
            seen.append(err.splitlines()[-1])
        code, _, err = run([*SMALL, "--engines", "rust,freefem,fenicsx"], fixed, {"XDG_CACHE_HOME": str(fixed)})
        must(code == 0, "a run that writes nothing here:", err)
        code, _, err = run([*SMALL, "--engines", "rust,freefem"], at, {"TMPDIR": str(fixed)})
        must(code == 2 and re.search("read-only file ?system", err, re.IGNORECASE), code, err)
    return "exit 2 where something is to be written there, else 0", seen[0], "nothing"


def two_runs_in_one_folder(at):
    seen = []
    for option in ("--keep", "--resume"):
        # It waits to be let go on: the second run comes in between, however long it takes to start.
        go = at / f"go{option}"
        engine = freefem_that(at, f'exec("until test -e {go}; do sleep 0.1; done");')
        words = [*SMALL, "--engines", f"rust,{engine}", option, "jobs" + option]
        first = start(words, at)
        wait_for(lambda: any(line == "sleep 0.1" for _, line in of_run(at)))
        code, _, err = run(words, at)
        go.touch()
        must(code == 2 and "in use by another run" in err, code, err)
        seen.append(err.splitlines()[-1])
        out, err = first.communicate(timeout=PATIENCE)
        must(first.returncode == 0, "the first run:", out, err)
    both = [start([*SMALL, "--engines", "rust,freefem", "--json", "out.json", "--report", "report"], at) for _ in "ab"]
    codes = [process.wait() for process in both]
    must(codes == [0, 0] and is_json(at / "out.json") and (at / "report/index.html").exists(), codes)
    return "the second is refused; the first ends as if alone", seen[0], "the first one's job folder"


def decimal_comma(at):
    subprocess.run(["localedef", "-i", "de_DE", "-f", "UTF-8", at / "de_DE.UTF-8"], check=True)
    env = {"LOCPATH": str(at), "LC_ALL": "de_DE.UTF-8", "LANG": "de_DE.UTF-8", "LC_NUMERIC": "de_DE.UTF-8"}
    said = subprocess.check_output(["/usr/bin/printf", "%.1f", "0,5"], env={**os.environ, **env}, text=True)
    must(said == "0,5", "there is no such locale here:", said)
    code, out, err = run(["verify", "plate", "--engines", "rust,freefem,fenicsx"], at, env)
    must(code == 0, out, err)
    return "exit 0: agree to the same digits", "the verdict, with points", "-"


def blanks_and_letters(at):
    home = at / "Prüfung 1 – 'größer' $HOME"
    home.mkdir()
    shutil.copy(SOURCE / "meshes/plate.msh", home / "Blech Nr 1.msh")
    text = (SOURCE / "crates/fem/src/scene/builtin/plate.toml").read_text()
    (home / "Ein Körper.toml").write_text(text.replace("plate.msh", "Blech Nr 1.msh"))
    engine = companion(home, "fenicsx", "The Signorini problem", "Ein Signorini-Problem", "größe")
    env = {"TMPDIR": str(home), "XDG_CACHE_HOME": str(home / "Ablage ä")}
    words = ["--methods", "cr", "--engines", f"rust,freefem,fenicsx,{engine}", "--keep", "Die Läufe",
             "--report", "Bericht ü", "--json", "Ergebnis ö.json"]
    code, out, err = run(["verify", "Ein Körper.toml", *words], home, env)
    must(code == 0, out, err)
    must(is_json(home / "Ergebnis ö.json") and (home / "Bericht ü/index.html").exists())
    code, out, err = run([*SMALL, "--engines", f"rust,{engine}", "--ranks", "2"], home, env)
    must(code == 0, out, err)
    return "exit 0, with two ranks as well", "the verdict", "what was asked for"


def no_home(at):
    bare = {"PATH": os.environ["PATH"], "FACEOFF_ENDURE": str(at)}
    process = subprocess.run(
        [PROGRAM, *SMALL, "--engines", "rust,freefem,fenicsx"],
        check=False, cwd=at, env=bare, capture_output=True, text=True,
    )
    must(process.returncode == 0, process.stdout, process.stderr)
    return "exit 0; forms are compiled in the job folder", "the verdict", "-"


def broken_cache(at):
    env = {"XDG_CACHE_HOME": str(at / "cache")}
    forms = at / "cache/faceoff/fenics"
    words = [*SMALL, "--engines", "rust,fenicsx"]

    def again(what):
        code, out, err = run(words, at, env)
        must(code == 0, what, out, err)

    again("a new cache")
    libraries = sorted(forms.glob("*.so"))
    must(libraries, "nothing was compiled")
    # A compilation that was killed.
    for path in forms.glob(libraries[0].name.split(".")[0] + "*"):
        if path.suffix != ".c":
            path.unlink()
    again("a form that was never compiled to the end")
    libraries[1].unlink()
    again("a library that is gone")
    for k, path in enumerate(sorted(forms.glob("*.so"))):
        os.truncate(path, path.stat().st_size // 2 if k % 2 else 0)
    again("libraries that are empty or cut off")
    for path in forms.glob("*.so"):
        path.write_bytes(b"no library" * 1000)
    # Another run is at work with it, so that it cannot be cleared.
    with (at / "cache/faceoff/lock").open() as lock:
        fcntl.flock(lock, fcntl.LOCK_SH)
        again("a broken cache that another run uses")
        must(broken(forms), "what another run uses was removed")
    again("and when it is gone")
    must(not broken(forms), "a broken cache was kept")
    return "exit 0; what is broken is compiled again", "the verdict", "a cache that is whole again"


def broken(forms):
    return any(path.read_bytes().startswith(b"no library") for path in forms.glob("*.so"))


def clock_jumps(at):
    env = {"XDG_CACHE_HOME": str(at / "cache")}
    words = [*SMALL, "--engines", "rust,freefem,fenicsx", "--keep", "jobs", "--resume", "kept"]
    for date in (None, 4102444800, 0):  # 2100, 1970
        for path in [*at.rglob("*")] if date is not None else []:
            os.utime(path, (date, date))
        code, out, err = run(words, at, env)
        must(code == 0, date, out, err)
        shutil.rmtree(at / "kept")
    told = "files of 1970 and of 2100: exit 0"
    if preload := next(Path("/usr/lib").glob("*/faketime/libfaketime.so.1"), None):
        for shift in ("-3000d", "+3000d", "+0 x1000"):
            jumping = {**env, "LD_PRELOAD": str(preload), "FAKETIME": shift, "DONT_FAKE_MONOTONIC": "1"}
            code, out, err = run(words, at, jumping)
            must(code == 0, shift, out, err)
            shutil.rmtree(at / "kept")
        told += "; a clock 8 years off, and one a thousand times as fast: exit 0"
    return told, "the verdict", "-"


def many_lines(at):
    lines = 'for (int i = 0; i < 10000; ++i) cout << "a line that says nothing " << i << endl;'
    engine = freefem_that(at, lines, "many")
    long = 'string s = "x"; for (int i = 0; i < 22; ++i) s = s + s; cout << s << s << s << s << endl;'
    other = freefem_that(at, long, "long")
    code, out, err = run([*SMALL, "--engines", f"rust,{engine},{other}", "--keep", "jobs"], at)
    must(code == 0, out[-300:], err[-300:])
    must(len((at / "jobs/many/log.txt").read_text().splitlines()) >= 10000)
    must((at / "jobs/long/log.txt").stat().st_size >= 1 << 24)
    return "exit 0; also with one line of 16 MB", "the verdict", "all of it in log.txt"


def signals(at):
    """SIGINT and SIGTERM at any moment: a run is ended whole, or has ended."""
    words = ["verify", "one-zone", "plate", "--n", "16", "--engines", "rust,freefem,fenicsx", "--json", "out.json",
             "--junit", "out.xml", "--report", "report", "--keep", "jobs"]
    (at / "tmp").mkdir()
    env = {"TMPDIR": str(at / "tmp")}
    begun = time.monotonic()
    code, out, err = run(words, at, env)
    must(code == 0, out, err)
    whole = time.monotonic() - begun
    luck, ended, finished, slowest = random.Random(1), 0, 0, 0.0
    # With `tests/run --all` at more of them.
    moments = 24 if "FACEOFF_SCENES" in os.environ else 6
    for k in range(moments):
        for name in ("out.json", "out.xml"):
            (at / name).unlink(missing_ok=True)
        shutil.rmtree(at / "report", ignore_errors=True)
        which = (signal.SIGINT, signal.SIGTERM)[k % 2]
        begun = time.monotonic()
        process = start(words, at, env)
        wait_for(lambda process=process, which=which: listens(process.pid, which) or process.poll() is not None)
        # The first as early as can be; the others up to the end, as long as a run takes by now.
        moment = luck.uniform(0, whole) if k else 0
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(moment)
            whole = time.monotonic() - begun
        process.send_signal(which)
        clock = time.monotonic()
        out, err = process.communicate(timeout=PATIENCE)
        slowest = max(slowest, time.monotonic() - clock)
        where = f"{which.name} after {moment:.2f} s:"
        if process.returncode == 0:
            finished += 1
            must(is_json(at / "out.json"), where, "no result")
        else:
            ended += 1
            must(process.returncode == 2 and "interrupted" in err, where, process.returncode, err)
            for name in ("out.json", "out.xml"):
                must(not (at / name).exists() or finished_whole(at / name), where, name, "is half-written")
        nothing_left(at)
        must(not any((at / "tmp").iterdir()), where, "left:", *(at / "tmp").iterdir())
    must(ended > 0, "none was ended")
    return (
        f"{ended} of {moments} moments: exit 2, at most {slowest:.1f} s later; {finished} had ended before",
        "interrupted; engines were ended and nothing was left half-written",
        "job folders under --keep; no child, no temporary folder, no half-written file",
    )


def listens(pid, which):
    """Does a process catch this signal?"""
    with contextlib.suppress(OSError):
        caught = re.search(r"SigCgt:\s*(\w+)", Path(f"/proc/{pid}/status").read_text())
        return caught and int(caught[1], 16) >> (which - 1) & 1
    return False


def finished_whole(path):
    text = path.read_text()
    return is_json(path) if path.suffix == ".json" else text.rstrip().endswith("</testsuites>")


# Runs a program, with a bound of its private memory, and writes down the most that it held, in bytes.
LIMITED = """#!/usr/bin/python3
import os, resource, subprocess, sys
limit = int(os.environ["DATA_LIMIT"])
if limit > 0:
    resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))
code = subprocess.call([{program!r}, *sys.argv[1:]])
with open({peaks!r}, "a") as file:
    print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss << 10, file=file)
sys.exit(code if code >= 0 else 128 - code)
"""


def errors(told):
    """What a solve tells of its errors, which no two answers share to all digits."""
    found = re.search(r"relative error +(.*)", told)
    must(found, "no errors in", told)
    return found[1]


def out_of_memory(at):
    # An engine that takes all there is, under a limit of its own.
    (at / "hungry.py").write_text(
        "import resource\nresource.setrlimit(resource.RLIMIT_AS, (1 << 28, 1 << 28))\nx = []\n"
        "while True:\n    x.append(bytearray(1 << 24))\n"
    )
    (at / "hungry.toml").write_text('name = "hungry"\ncommand = ["python3", "hungry.py"]\n')
    code, _, err = run([*SMALL, "--engines", "rust,hungry.toml"], at)
    must(code == 2 and "MemoryError" in err, code, err)
    seen = [err.splitlines()[-1]]
    # FreeFEM and dolfinx, with less than they need: less than a fine mesh takes beyond what the smallest one takes.
    peaks = at / "peaks"
    programs = {"freefem": ("FreeFem++-nw", shutil.which("FreeFem++")), "fenicsx": ("python", "/usr/bin/python3")}
    # FreeFEM's OpenBLAS with a little less than it needs tries again, for seconds at best.
    for engine, n, parts in (("freefem", 64, (0.6, 0.3)), ("fenicsx", 128, (0.9, 0.6, 0.3))):
        name, program = programs[engine]
        wrapper = at / "bin" / name
        wrapper.parent.mkdir(exist_ok=True)
        wrapper.write_text(LIMITED.format(program=program, peaks=str(peaks)))
        wrapper.chmod(0o755)
        env = {"PATH": f"{wrapper.parent}:{os.environ['PATH']}"} if engine == "freefem" else {"FACEOFF_PYTHON": wrapper}

        def solve(n, limit=0, more=(), engine=engine, env=env):
            peaks.unlink(missing_ok=True)
            words = ["solve", "one-zone", "--method", "p2", "--n", n, "--engine", engine, *more]
            code, out, err = run(words, at, {**env, "DATA_LIMIT": str(limit)})
            nothing_left(at)
            # Where the time limit ended the program, the wrapper wrote nothing.
            told = peaks.read_text() if peaks.exists() else ""
            return code, out, err, max(map(int, told.split()), default=0)

        small, large = solve(2), solve(n)
        must(small[0] == large[0] == 0 < small[3] < large[3], engine, small, large)
        refused = 0
        for part in parts:
            # What tries for ever is ended by the time limit.
            code, out, err, _ = solve(n, int(part * (large[3] - small[3])), ("--time-limit", 60))
            if code == 0:
                # Not all that a program holds is private: it may have had enough, and then its answer is the right one.
                must(errors(out) == errors(large[1]), engine, part, out, large[1])
                continue
            must(code in (1, 2) and err, engine, part, code, out, err)
            refused += 1
            seen.append(err.splitlines()[-1])
        must(refused, engine, "had enough each time")
    return "exit 2, or 1 where a code takes it for an answer", "; ".join(seen), "nothing"


FAULTS = [
    killed_engine, killed_faceoff, killed_faceoff_with_ranks, full_disk, read_only_folder, two_runs_in_one_folder,
    decimal_comma, blanks_and_letters, no_home, broken_cache, clock_jumps, many_lines, signals, out_of_memory,
]


def main():
    if os.geteuid() != 0:
        # Mounts need root; in a namespace of one's own everybody is.
        os.execvp("unshare", ["unshare", "--user", "--map-root-user", "--mount", sys.executable, *sys.argv])
    failed = 0
    print("| fault | what happened | what the user saw | what was kept |\n|---|---|---|---|")
    for fault in FAULTS:
        name = fault.__name__.replace("_", " ")
        if sys.argv[2:] and not any(part in name for part in sys.argv[2:]):
            continue
        with tempfile.TemporaryDirectory(prefix="endure-") as folder:
            try:
                row = [re.sub(r"\s+", " ", cell).replace(folder + "/", "") for cell in fault(Path(folder))]
            except (Wrong, subprocess.SubprocessError, OSError) as error:
                failed += 1
                row = [f"**WRONG**: {error}", "", ""]
            finally:
                for pid, _ in of_run(folder):
                    os.kill(pid, signal.SIGKILL)
            print(f"| {name} | {' | '.join(row)} |", flush=True)
    sys.exit(failed > 0)


if __name__ == "__main__":
    main()
