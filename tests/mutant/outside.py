"""What others run: the step of the GitHub action, `stress` and `study` of a code that lies, folders that `new` makes, and the plugin
of pytest, where the Python package is installed (`tests/run` has it in target/python)."""

import functools
import os
import re
import subprocess
from pathlib import Path
from xml.etree import ElementTree

from . import formats, model
from .face_off import verify
from .trial import SOURCE, Trial, forever


@functools.cache
def judge_step():
    """The script of the action's step, as the server hands it to bash."""
    lines = (SOURCE / ".ci/action.yml").read_text().split("\n")
    start = next(k for k, line in enumerate(lines) if line.strip() == "- name: Judge")
    start = next(k for k in range(start, len(lines)) if lines[k].strip() == "run: |") + 1
    indent = len(lines[start]) - len(lines[start].lstrip())
    script = []
    for line in lines[start:]:
        if line.strip() and len(line) - len(line.lstrip()) < indent:
            break
        script.append(line[indent:])
    return "\n".join(script)


@forever
def action(draw, turn):
    good = model.result(draw, "triangle", 2)
    left, right = formats.vtu(good, "a")[0], formats.vtu(model.rounded(good, draw), "b")[0]
    what = "the GitHub action"

    def trial(fault, command, files, agrees=False):
        def script(at):
            at.put_all(files)
            path = f"{Path(at.program).parent}:{os.environ['PATH']}"
            env = {"PATH": path, "COMMAND": command, "REPORT": "page", "SANDBOX": "true"}
            code = at.shell("bash", "-eo", "pipefail", "-c", judge_step(), env=env)
            if code == 0 and not agrees:
                return 0
            return code if code in (0, 1) else 2

        return Trial(what, fault, script, agrees)

    yield trial("agrees", "compare a.vtu b.vtu", {**left, **right}, True)
    for fault in draw.sample([*model.VALUES, *model.NAMES, *model.PLACES], 4):
        bad = model.wrong(good, fault, draw)
        if bad is not None:
            yield trial(fault.__name__, "compare a.vtu b.vtu", {**left, **formats.vtu(bad, "b")[0]})
    yield trial("a file missing", "compare a.vtu b.vtu", left)
    yield trial("no command", "", {})
    yield trial("a command that is not there", "compair a.vtu b.vtu", {**left, **right})
    yield trial("a quote without its end", 'compare a.vtu "b.vtu', {**left, **right})
    yield trial("a line of shell", "compare a.vtu b.vtu || true", {**left, **right})
    yield trial("two lines", "compare a.vtu b.vtu\n; true", {**left, **right})


# Claims to have converged: with a constant, with 0, or with dofs that are not finite.
CLAIMS = """
import json, os, pathlib, struct, sys
job = json.loads(pathlib.Path("job.json").read_text())
cases = []
for case in job["cases"]:
    cells = os.path.getsize(case["mesh"]["cells"]) // 24
    rows = cells * {"CR": 3, "P1": 3, "P2": 6}[case["element"]]
    dofs = "out/" + case["id"] + ".dofs.f64"
    pathlib.Path(dofs).write_bytes(struct.pack("<d", VALUE) * rows)
    cases.append({"id": case["id"], "converged": CONVERGED, "iterations": 1, "increments": [0.0], "rows": rows, "dofs": dofs})
pathlib.Path("out/status.json").write_text(json.dumps({"protocol": 1, "version": "1", "cases": cases}))
"""


@forever
def campaigns(draw, turn):
    """A code that claims what it has not."""
    for command in (["stress", "transition-1.5", "--families", "gamma0"], ["study", "one-zone", "--budget", "1s", "--finest", "8"]):
        what = command[0]

        def trial(fault, value, converged="True", agrees=False, command=command, what=what):
            def script(at):
                at.put("claims.py", CLAIMS.replace("VALUE", value).replace("CONVERGED", converged))
                at.put("claims.toml", 'name = "claims"\ncommand = ["/usr/bin/python3", "-SE", "claims.py"]\n')
                return at.run(*command, "--methods", "cr", "--engines", "rust" if agrees else "claims.toml")

            return Trial(what, fault, script, agrees)

        yield trial("agrees", "0", agrees=True)
        yield trial("a constant", str(draw.uniform(0.1, 2)))
        yield trial("all 0", "0.0")
        yield trial("NaN", "float('nan')")
        yield trial("not converged", "0.0", "False")


@forever
def templates(draw, turn):
    """A folder that `new` made, with one thing changed in one of its scripts."""
    what = "a template of `new`"
    for option, name, changes in (
        ("--from", "blank", (
            ("blank.edp", "- int2d(Th, qforder=5)(v)", "- 1.001*int2d(Th, qforder=5)(v)"),
            ("blank.edp", "on(1, u=0)", "on(2, u=0)"),
            ("blank.edp", "fespace Vh(Th, P2)", "fespace Vh(Th, P1)"),
            ("blank.py", "k * inner", "2 * k * inner"),
            ("blank.py", "total / area", "2 * total / area"),
            ("blank.edp", '"mean,"', '"means,"'),
        )),
        # What is wrong in a form is wrong in all codes: only the exact solution shows it.
        ("--form", "poisson", (
            ("poisson.toml", "t*v*ds(right)", "t*v*ds(left)"),
            ("poisson.toml", 'top = "g"\n', ""),
            ("poisson.toml", 'exact = "g"', 'exact = "1.1*g"'),
        )),
    ):
        def trial(fault, change=None, option=option, name=name):
            def script(at):
                at.must("new", name, option, name)
                if change:
                    file, old, new = change
                    path = at.folder / name / file
                    text = path.read_text()
                    if old not in text:
                        raise RuntimeError(f"{file} has no {old}")
                    path.write_text(text.replace(old, new))
                codes = ("--engines", "rust,freefem") if option == "--form" else ()
                return at.run(*verify(at.program), f"{name}/{name}.toml", "--n", "4,8", *codes)

            return Trial(what, fault, script, change is None)

        yield trial("agrees")
        for change in changes:
            yield trial(f"{change[0]}: {change[1]}", change)


# One run of pytest for all: what is right has to pass, and each mutant to fail.
TESTS = """
import copy, json, pathlib, random, pytest, sys
sys.path.insert(0, {tests!r})
from mutant import model
import faceoff_fem as fo

def arrays(m):
    told = {{"points": [list(p) for p in m.points], "cells": {{}}}}
    for kind, numbers in m.cells:
        told["cells"].setdefault(kind, []).append(numbers)
    for f in m.fields:
        told[f.name] = [list(v) if len(v) > 1 else v[0] for v in f.values]
    return told

def good():
    return model.result(random.Random(1), "triangle", 3)

FAULTS = [f for f in model.VALUES + model.NAMES + model.PLACES if f is not model.quads_cut]
CASES = [(f, k) for k in range({rounds}) for f in FAULTS]

def bad(fault, k):
    return arrays(model.wrong(model.rounded(good(), random.Random(k)), fault, random.Random(f"{seed} {{k}} {{fault.__name__}}")))

def test_right(assert_agree):
    assert_agree(arrays(good()), arrays(model.renumbered(good(), random.Random(2))))

@pytest.mark.parametrize("fault, k", CASES, ids=lambda v: getattr(v, "__name__", str(v)))
def test_mutant(assert_agree, fault, k):
    assert_agree(arrays(good()), bad(fault, k))

@pytest.mark.parametrize("fault, k", CASES, ids=lambda v: getattr(v, "__name__", str(v)))
def test_recorded(faceoff_regression, request, fault, k):
    recording = request.config.getoption("--faceoff-record")
    faceoff_regression(arrays(good()) if recording else bad(fault, k))

def test_recorded_right(faceoff_regression):
    faceoff_regression(arrays(good()))
"""


def python():
    """An interpreter that has the package."""
    for path in (os.environ.get("FACEOFF_FEM_PYTHON"), SOURCE / "target/python/bin/python3"):
        command = [path, "-c", "import faceoff_fem, pytest"]
        if path and Path(path).exists() and subprocess.run(command, capture_output=True, check=False).returncode == 0:
            return path
    return None


@functools.cache
def of_pytest(seed, rounds, folder):
    """Which tests passed, of one run with what was recorded before."""
    interpreter, at = python(), Path(folder)
    text = TESTS.format(tests=str(SOURCE / "tests"), rounds=rounds, seed=seed)
    (at / "test_mutants.py").write_text(text)
    words = [interpreter, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", "--tb=no", "test_mutants.py"]
    subprocess.run([*words, "-k", "recorded", "--faceoff-record"], cwd=at, capture_output=True, check=False)
    subprocess.run([*words, "--junitxml", "o.xml"], cwd=at, capture_output=True, check=False)
    cases = ElementTree.parse(at / "o.xml").getroot().iter("testcase")
    return {case.get("name"): not any(child.tag in ("failure", "error", "skipped") for child in case) for case in cases}


def plugin(draw, folder, wanted):
    """`assert_agree` and `faceoff_regression`: nothing where the package is not."""
    if python() is None:
        return
    rounds = max(1, wanted // 60)
    for name, passed in of_pytest(draw.randrange(1000), rounds, folder).items():
        kind = "assert_agree" if name.startswith(("test_mutant", "test_right")) else "faceoff_regression"
        fault = re.sub(r"\[|-?\d+\]", " ", name).split()[-1]
        agrees = "right" in name

        def script(at, name=name, passed=passed):
            at.said = f"{name} {'passed' if passed else 'failed'}"
            return 0 if passed else 1

        yield Trial(f"pytest, {kind}", "agrees" if agrees else fault, script, agrees)
