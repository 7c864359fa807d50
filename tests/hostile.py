"""Damaged files of every kind through the whole program: it ends with 0, 1 or 2, in time, within its memory, its JSON and
JUnit can be read, and it never says `agree`, as each case holds two results that differ whatever the damage.

    tests/hostile.py PROGRAM [--seed N] [--runs N | --minutes M] [--keep DIR]

Equal seeds give equal files. What is found is kept, with the command that shows it.
"""

import argparse
import json
import os
import random
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from xml.etree import ElementTree

SOURCE = Path(__file__).resolve().parent.parent

# A run may take as long, and as much memory; far more than any needs.
SECONDS = 120
MEMORY = 6 << 30
FILE = 1 << 30

# What readers stumble over.
WORDS = [
    b"", b"\0", b"-1", b"0", b"1", b"nan", b"inf", b"-inf", b"1e999", b"1e-320", b"4294967295", b"4294967296",
    b"9223372036854775807", b"-9223372036854775808", b"99999999999999999999", b"\n", b"\r\n", b"\t", b'"', b"'", b"<", b">",
    b"&", b"&#0;", b"]]>", b"<!--", b"\xff\xfe", b"\xef\xbb\xbf", b"\xc3\x28", b"::error::x", b"\x1b[2J", b"../", b"/dev/zero",
    b"/proc/self/environ", b"(((((((((((((((((", b"if(", b"1/0", b"[", b"]", b"{", b"}", b"null", b"true",
]


def lists():
    """Nested and long."""
    yield b"(" * 20_000
    yield b"-" * 20_000
    yield b"[" * 20_000
    yield b"9" * 5_000
    yield b"a" * 100_000
    yield b"\n" * 10_000


LONG = list(lists())


def damage(data, random):
    """`data` with a few changes of one kind each."""
    data = bytearray(data)
    for _ in range(random.choice([1, 1, 1, 2, 5])):
        at = random.randrange(len(data) + 1)
        to = min(len(data), at + random.choice([1, 2, 4, 8, 40, 400]))
        kind = random.randrange(9)
        if kind == 0 and at < len(data):
            data[at] = random.randrange(256)
        elif kind == 1 and at < len(data):
            data[at] ^= 1 << random.randrange(8)
        elif kind == 2:
            del data[at:to]
        elif kind == 3:
            data[at:at] = data[at:to]
        elif kind == 4:
            data[at:to] = random.choice(WORDS)
        elif kind == 5:
            del data[at:]
        elif kind == 6:
            data[at:at] = random.choice(WORDS)
        elif kind == 7:
            # A word of digits becomes another one.
            digits = [k for k in range(len(data)) if 48 <= data[k] < 58]
            if digits:
                at = random.choice(digits)
                to = at
                while to < len(data) and 48 <= data[to] < 58:
                    to += 1
                data[at:to] = random.choice(WORDS)
        elif random.randrange(20) == 0:
            data[at:at] = random.choice(LONG)
    return bytes(data)


# Answers a constant that solves nothing, of the right number, and claims to have converged.
CONSTANT = """
import json, os, pathlib, struct
job = json.loads(pathlib.Path("job.json").read_text())
cases = []
for case in job["cases"]:
    dimension = case["dimension"]
    cells = os.path.getsize(case["mesh"]["cells"]) // (8 * (dimension + 1))
    rows = cells * {"CR": dimension + 1, "P1": dimension + 1, "P2": (dimension + 1) * (dimension + 2) // 2}[case["element"]]
    dofs = "out/" + case["id"] + ".dofs.f64"
    pathlib.Path(dofs).write_bytes(struct.pack("<d", 0.12345) * rows)
    cases.append({"id": case["id"], "converged": True, "iterations": 1, "increments": [0.0], "rows": rows, "dofs": dofs})
pathlib.Path("out/status.json").write_text(json.dumps({"protocol": 1, "version": "1", "cases": cases}))
"""

# The same, and then what stands beside it, damaged, takes the place of its answer.
DAMAGED = CONSTANT + """
import shutil
home = pathlib.Path(HOME)
for name in ("status.json", "case-0.dofs.f64"):
    if (home / name).exists():
        shutil.copy(home / name, pathlib.Path("out") / name)
"""

CSV = "vertex,u,v\n" + "".join(f"{k},{k * 0.5},{k - 3}\n" for k in range(20))
PLACES = "x,y,u\n" + "".join(f"{k},{k % 3},{k * 0.25}\n" for k in range(20))
FACES = "v0,v1,u\n" + "".join(f"{k},{k + 1},{k * 0.25}\n" for k in range(20))


class Cases:
    """Everything that a stranger's file can be, and the command that reads it."""

    def __init__(self, program, home):
        self.home = home
        seeds = [p for p in (SOURCE / "fuzz/seeds").rglob("*") if p.is_file()]
        meshes = sorted(seeds) + sorted((SOURCE / "meshes").glob("*.msh"))
        scenes = sorted((SOURCE / "crates/fem/src/scene/builtin").glob("*.toml"))
        (home / "constant.py").write_text(CONSTANT)
        (home / "constant.toml").write_text('name = "constant"\ncommand = ["python3", "constant.py"]\n')

        def ran(*words):
            done = subprocess.run([program, *words], cwd=home, capture_output=True, check=False)
            assert done.returncode in (0, 1), (words, done.stderr.decode())

        constant = ("--engines", "rust,constant.toml", "--methods", "cr", "--n", "4")
        ran("verify", "one-zone", *constant, "--resume", "journal")
        ran("verify", "one-zone", *constant, "--keep", "kept")
        ran("solve", "one-zone", "--n", "3", "--out", "solved.vtu")
        recorded = (SOURCE / "tests/baseline/baseline.json").read_bytes()
        journal = (home / "journal/journal.jsonl").read_bytes()
        status = (home / "kept/constant/out/status.json").read_bytes()
        dofs = (home / "kept/constant/out/case-0.dofs.f64").read_bytes()
        solved = [(home / name).read_bytes() for name in ("solved.vtu", "solved-faces.vtu")]

        def other(text):
            """The same with other values."""
            head, *rows = text.splitlines()
            return "\n".join([head, *(row.rsplit(",", 1)[0] + ",77" for row in rows)]) + "\n"

        self.kinds = []
        for path in meshes:
            data, name = path.read_bytes(), "mesh" + path.suffix
            for words in (
                ["mesh", "info", name],
                ["mesh", "convert", name, "out.vtu", "--lossy"],
                ["mesh", "convert", name, "out.msh", "--lossy"],
                ["mesh", "refine", name, "out.msh"],
                ["solve", "plate", "--mesh", name, "--max-iterations", "3"],
            ):
                self.add({name: data}, words)
        for path in scenes:
            self.add({"s.toml": path.read_bytes()}, ["solve", "s.toml", "--n", "4", "--max-iterations", "5"])
            words = ["verify", "s.toml", "--engines", "rust,constant.toml", "--methods", "cr", "--n", "3"]
            self.add({"s.toml": path.read_bytes()}, words)
        for text in (CSV, PLACES, FACES):
            fixed = {"b.csv": other(text).encode()}
            self.add({"a.csv": text.encode()}, ["compare", "a.csv", "b.csv"], fixed)
            self.add({"a.csv": text.encode()}, ["certify", "a.csv", "--scene", "one-zone", "--n", "3"])
            self.add({"a.csv": text.encode()}, ["judge", "a.csv", "--scene", "one-zone", "--n", "3"])
        for vtu in solved:
            fixed = {"b.vtu": solved[0] if vtu is solved[1] else solved[1]}
            self.add({"a.vtu": vtu}, ["compare", "a.vtu", "b.vtu"], fixed)
            self.add({"a.vtu": vtu}, ["certify", "a.vtu", "--scene", "one-zone", "--n", "3"])
            # With another gamma, so that nothing agrees.
            self.add({"a.vtu": vtu}, ["judge", "a.vtu", "--scene", "one-zone", "--n", "3", "--gamma0", "7"])
        pvd = b'<VTKFile type="Collection"><Collection><DataSet timestep="0" file="p.vtu"/></Collection></VTKFile>'
        self.add({"a.pvd": pvd}, ["compare", "a.pvd", "b.vtu"], {"p.vtu": solved[0], "b.vtu": solved[1]})
        sol = b"MeshVersionFormatted 2\nDimension 2\nSolAtVertices\n3\n1 1\n\n1.0\n2.0\n3.0\nEnd\n"
        medit = b"MeshVersionFormatted 2\nDimension 2\nVertices 3\n0 0 0\n1 0 0\n0 1 0\nTriangles 1\n1 2 3 7\nEnd\n"
        self.add({"a.sol": sol}, ["compare", "a.sol", "b.csv"], {"a.mesh": medit, "b.csv": b"vertex,u\n0,9\n1,9\n2,9\n"})
        against = ["verify", "one-zone", "--against", "base", "--n", "5", "--methods", "cr"]
        self.add({"base/baseline.json": recorded}, against)
        resume = ["verify", "one-zone", *constant, "--resume", "j"]
        self.add({"j/journal.jsonl": journal}, resume)
        engine = (home / "constant.toml").read_bytes()
        self.add({"e.toml": engine}, ["verify", "one-zone", "--engines", "rust,e.toml", "--methods", "cr", "--n", "3"])
        answer = {
            "damaged.py": DAMAGED.replace("HOME", repr(str(home / "work/answer"))).encode(),
            "d.toml": b'name = "damaged"\ncommand = ["python3", "damaged.py"]\n',
        }
        words = ["verify", "one-zone", "--engines", "rust,d.toml", "--methods", "cr", "--n", "4"]
        for name, data in (("status.json", status), ("case-0.dofs.f64", dofs)):
            self.add({"answer/" + name: data}, words, answer)

    def add(self, damaged, words, fixed=None):
        self.kinds.append((damaged, words, fixed or {}))


def limits():
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_FSIZE, (FILE, FILE))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def wrong(program, work, words):
    """What is wrong with a run, in words."""
    judges = words[0] in ("verify", "compare", "judge")
    outputs = ["--json", "out.json", "--report", "page"] + (["--junit", "out.xml"] if judges else [])
    try:
        done = subprocess.run(
            [program, *words, *outputs],
            cwd=work,
            capture_output=True,
            stdin=subprocess.DEVNULL,
            timeout=SECONDS,
            preexec_fn=limits,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"it did not end within {SECONDS} s"
    said = done.stderr.decode(errors="replace")
    if done.returncode not in (0, 1, 2):
        return f"exit code {done.returncode}: {said[-400:]}"
    if "panicked" in said:
        return f"a panic: {said[-400:]}"
    if done.returncode == 2 and not said and b"undetermined" not in done.stdout:
        return "it fails and does not say why"
    if any(byte in done.stdout + done.stderr for byte in (0x1B, 0x07, 0x00)):
        return "what it prints speaks to the terminal"
    try:
        told = json.loads((work / "out.json").read_text())
    except (OSError, ValueError) as error:
        return f"its JSON: {error}"
    if judges:
        if done.returncode == 0 or told.get("verdict") == "agree":
            return "it agrees"
        try:
            root = ElementTree.parse(work / "out.xml").getroot()
        except (OSError, ElementTree.ParseError) as error:
            return f"its JUnit: {error}"
        if int(root.get("failures")) + int(root.get("errors")) == 0:
            return "its JUnit has no failure"
    if not (work / "page/index.html").is_file():
        return "it wrote no page"
    return None


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("--seed", type=int, default=2017)
    parser.add_argument("--runs", type=int, default=400)
    parser.add_argument("--minutes", type=float)
    parser.add_argument("--keep", type=Path, default=Path("hostile"))
    arguments = parser.parse_args()
    program = str(Path(arguments.program).resolve())
    end = None if arguments.minutes is None else time.monotonic() + 60 * arguments.minutes
    found = 0
    with tempfile.TemporaryDirectory() as place:
        home = Path(place)
        cases = Cases(program, home)
        order = random.Random(arguments.seed).sample(range(len(cases.kinds)), len(cases.kinds))
        number = 0
        while number < arguments.runs if end is None else time.monotonic() < end:
            draw = random.Random(f"{arguments.seed} {number}")
            damaged, words, fixed = cases.kinds[order[number % len(order)]]
            work = home / "work"
            shutil.rmtree(work, ignore_errors=True)
            work.mkdir()
            for name in ("constant.py", "constant.toml"):
                shutil.copy(home / name, work)
            for name, data in fixed.items():
                (work / name).write_bytes(data)
            for name, data in damaged.items():
                (work / name).parent.mkdir(exist_ok=True)
                (work / name).write_bytes(damage(data, draw))
            what = wrong(program, work, words)
            if what:
                found += 1
                keep = arguments.keep / str(number)
                shutil.copytree(work, keep, dirs_exist_ok=True)
                print(f"run {number}, kept in {keep}: faceoff {' '.join(words)}: {what}", flush=True)
            number += 1
    print(f"{number} runs of {len(cases.kinds)} kinds, {found} findings")
    return 1 if found else 0


if __name__ == "__main__":
    os.environ.pop("GITHUB_ACTIONS", None)
    sys.exit(main())
