"""Verdicts on the Signorini problem: `verify` with codes that lie, recorded answers and journals that were changed, `judge` and
`certify` of fields and scenes with one thing changed, `matrix`, `stress`, `study` and `orders`."""

import base64
import functools
import json
import math
import random
import re
import struct
import tempfile
import threading

from . import formats, model
from .trial import SOURCE, At, Trial, forever

LOCK = threading.Lock()
METHODS = ["cr", "cr-fc", "p1", "p2"]
SCENES = ["one-zone", "three-zones", "five-zones"]

# A program that answers with what lies beside it.
LIAR = """
import json, os, pathlib, shutil, sys
home = pathlib.Path(__file__).resolve().parent
lie = json.loads((home / "lie.json").read_text())
job = json.loads(pathlib.Path("job.json").read_text())
cases = []
for case in job["cases"]:
    dofs = "out/" + case["id"] + ".dofs.f64"
    name = case["element"].lower() + ("-fc" if case["flux_corrected"] else "")
    data = (home / f"{name}.f64").read_bytes()
    pathlib.Path(dofs).write_bytes(data)
    cases.append({"id": case["id"], "converged": True, "iterations": 1, "increments": [0.0], "rows": len(data) // 8,
                  "dofs": dofs, **lie.get("case", {})})
status = {"protocol": 1, "version": "1", "cases": cases, **lie.get("status", {})}
status["cases"] = status["cases"][lie.get("from", 0):]
if not lie.get("silent"):
    pathlib.Path("out/status.json").write_text(json.dumps(status))
if lie.get("error"):
    print("error it is so")
sys.exit(lie.get("exit", 0))
"""
ENGINE = 'name = "{name}"\ncommand = ["python3", "{name}.py"]\n'


@functools.cache
def answered(program, scene, n):
    """What FreeFEM answers, which agrees: the values by method, and the record of them."""
    with tempfile.TemporaryDirectory() as folder:
        at = At(program, folder)
        at.must("verify", scene, "--n", n, "--methods", ",".join(METHODS), "--engines", "rust,freefem", "--keep", "k",
                "--record", "base")
        found = {}
        for k, method in enumerate(METHODS):
            lines = (at.folder / f"k/freefem/out/case-{k}.dofs.txt").read_text().split("\n")
            found[method] = [float(line.split()[2]) for line in lines if line]
        return found, (at.folder / "base/baseline.json").read_text()


def answer(program, scene, n=4):
    with LOCK:
        return answered(program, scene, n)


def packed(values):
    return struct.pack(f"<{len(values)}d", *values)


def status(count, lie):
    cases = [{"id": "case-0", "converged": True, "iterations": 1, "increments": [0.0], "rows": count, "dofs": "out/case-0.dofs.f64",
              **lie.get("case", {})}]
    return {"protocol": 1, "version": "1", "cases": cases, **lie.get("status", {})}


COPY = 'cp -rT "$(dirname "$0")/answer" out\nexit {}\n'


def copied(values, lie=None):
    """A code for one case: it copies an answer, and starts at once."""
    lie = lie or {}
    files = {
        "liar.toml": 'name = "liar"\ncommand = ["sh", "liar.sh"]\n',
        "liar.sh": COPY.format(lie.get("exit", 0)),
        "answer/case-0.dofs.f64": packed(values),
    }
    if not lie.get("silent"):
        files["answer/status.json"] = json.dumps(status(len(values), lie))
    return files


def liar(values, lie=None, name="liar"):
    """A code for any cases, by method."""
    return {
        f"{name}.py": LIAR,
        f"{name}.toml": ENGINE.format(name=name),
        "lie.json": json.dumps(lie or {}),
        **{f"{method}.f64": packed(v) for method, v in values.items()},
    }


# ---- Faults of a vector of dofs -------------------------------------------------------------------------------------------


def everywhere(values, k, new):
    """A dof changes in all cells that have it."""
    return [new if v == values[k] else v for v in values]


def choice(values, draw):
    k = draw.choice([k for k, v in enumerate(values) if v])
    big = max(map(abs, values))
    # By symmetry some are alike but for rounding.
    return k, draw.choice([j for j, v in enumerate(values) if abs(v - values[k]) > 1e-6 * big]), big


def a_dof_by_little(values, draw):
    k, _, big = choice(values, draw)
    return everywhere(values, k, values[k] + 1e-8 * big)


def a_dof_by_a_factor(values, draw):
    k, _, _ = choice(values, draw)
    return everywhere(values, k, values[k] * draw.choice([2, 1.001, -1, 1e6]))


def a_dof_0(values, draw):
    return everywhere(values, choice(values, draw)[0], 0.0)


def no_number(values, draw):
    return everywhere(values, choice(values, draw)[0], draw.choice([math.nan, math.inf, -math.inf]))


def a_dof_in_one_cell(values, draw):
    k, _, big = choice(values, draw)
    return [v + 1e-6 * big if i == k else v for i, v in enumerate(values)]


def the_other_sign(values, draw):
    return [-v for v in values]


def all_by_a_factor(values, draw):
    by = draw.choice([1 + 1e-8, 1000, 0.5])
    return [by * v for v in values]


def two_dofs_exchanged(values, draw):
    k, j, _ = choice(values, draw)
    other = {values[k]: values[j], values[j]: values[k]}
    return [other.get(v, v) for v in values]


def the_dofs_of_cells_in_another_order(values, draw):
    return [v for i in range(0, len(values), 3) for v in values[i:i + 3][::-1]]


def cells_in_another_order(values, draw):
    return values[3:] + values[:3]


def a_value_missing(values, draw):
    return values[:-1]


def a_value_more(values, draw):
    return [*values, 0.0]


def no_values(values, draw):
    return []


def all_0(values, draw):
    return [0.0] * len(values)


def a_constant_added(values, draw):
    big = max(map(abs, values))
    return [v + 1e-7 * big for v in values]


def single_precision(values, draw):
    return list(struct.unpack(f"<{len(values)}f", struct.pack(f"<{len(values)}f", *values)))


SPOILED = [
    a_dof_by_little, a_dof_by_a_factor, a_dof_0, no_number, a_dof_in_one_cell, the_other_sign, all_by_a_factor, two_dofs_exchanged,
    the_dofs_of_cells_in_another_order, cells_in_another_order, a_value_missing, a_value_more, no_values, all_0, a_constant_added,
    single_precision,
]


def spoiled(values, draw):
    return draw.choice(SPOILED)(values, draw)


LIES = [
    {"case": {"converged": False}}, {"case": {"rows": 5}}, {"case": {"id": "case-7"}}, {"case": {"dofs": "out/none.f64"}},
    {"case": {"iterations": -1}}, {"status": {"protocol": 2}}, {"status": {"cases": []}}, {"silent": True}, {"exit": 3},
    {"exit": 1}, {"case": {"dofs": "../liar.toml"}}, {"case": {"converged": None}}, {"case": {"increments": "none"}}, {"status": {"version": None}},
    {"status": {"protocol": "1"}}, {"case": {"dofs": "out/status.json"}},
]


@forever
def engines(draw, turn):
    """A code whose answers are changed."""
    scene, method = SCENES[turn % 3], METHODS[turn % 4]
    n = 4 if scene == "one-zone" else 6
    words = ["verify", scene, "--n", n, "--methods", method, "--engines", "rust,liar.toml"]
    what = f"verify, {method}"

    def script(change=None, lie=None, scene=scene, n=n, method=method, words=words):
        def run(at):
            values = answer(at.program, scene, n)[0][method]
            at.put_all(copied(change(values) if change else values, lie))
            return at.run(*words)

        return run

    yield Trial(what, "agrees", script(), True)
    for fault in draw.sample(SPOILED, 9):
        pick = random.Random(draw.random())
        yield Trial(what, fault.__name__.replace("_", " "), script(functools.partial(fault, draw=pick)))
    for lie in draw.sample(LIES, 4):
        name = ", ".join(f"{k} {v}" for k, v in {**lie.get("case", {}), **lie.get("status", {}), **lie}.items() if k not in ("case", "status"))
        yield Trial(what, "the status has " + name, script(lie=lie))


CHANGED = [
    ("f", 'f = "-2*pi*sin(2*pi*x)"', 'f = "-2.001*pi*sin(2*pi*x)"'),
    ("f", 'f = "-2*pi*sin(2*pi*x)"', 'f = "2*pi*sin(2*pi*x)"'),
    ("f", 'f = "-2*pi*sin(2*pi*x)"', 'f = "-2*pi*sin(2*pi*y)"'),
    ("f", 'f = "-2*pi*sin(2*pi*x)"', 'f = "-2*pi*sin(2*pi*x) + 1e-5"'),
    ("psi", "[data]", '[data]\npsi = "-0.01"'),
    ("psi", "[data]", '[data]\npsi = "1e-6*x"'),
    ("g", "[data]", '[data]\ng = "0.001"'),
    ("t", "[data]", '[data]\nt = "1e-5"'),
    ("a part of the boundary", 'neumann = ["left", "right"]', 'neumann = ["left"]'),
    ("the parts of the boundary", 'dirichlet = ["top"]\nneumann = ["left", "right"]', 'dirichlet = ["top", "left"]\nneumann = ["right"]'),
    ("the contact side", 'dirichlet = ["top"]\nneumann = ["left", "right"]\ncontact = ["bottom"]',
     'dirichlet = ["bottom"]\nneumann = ["left", "right"]\ncontact = ["top"]'),
    ("gamma0", "[exact]", "[method]\ngamma0 = 101\n[exact]"),
    ("h", "[exact]", '[method]\nh = "global"\ngamma0 = 50\n[exact]'),
    ("the rule", "[exact]", '[method]\nload_quadrature = "centroid"\n[exact]'),
    ("n", "n = 16", "n = 17"),
    ("the size", 'generator = "union-jack"', 'generator = "union-jack"\nsize = [1.0, 1.001]'),
]


def scene_text(change=None):
    text = (SOURCE / "crates/fem/src/scene/builtin/one-zone.toml").read_text()
    text = text[: text.index("[exact]")] + "[exact]\n"
    if change:
        _, old, new = change
        assert old in text, old
        text = text.replace(old, new)
    return text.replace("[exact]\n", "")


@forever
def against(draw, turn):
    """Recorded answers: they, or the scene, are changed."""
    scene, n = SCENES[turn % 3], (4, 6, 6)[turn % 3]
    words = ["verify", scene, "--n", n, "--methods", ",".join(METHODS), "--against", "base"]
    what = "verify --against a record"

    def script(change, words=words, scene=scene, n=n):
        def run(at):
            record = json.loads(answer(at.program, scene, n)[1])
            change(record)
            at.put("base/baseline.json", json.dumps(record))
            return at.run(*words)

        return run

    yield Trial(what, "agrees", script(lambda r: None), True)

    def dofs(record, seed):
        pick = random.Random(seed)
        of = pick.choice(record["entries"])["found"]
        data = base64.b64decode(of["dofs"])
        values = list(struct.unpack(f"<{len(data) // 8}d", data))
        of["dofs"] = base64.b64encode(packed(spoiled(values, pick))).decode()

    for _ in range(3):
        seed = draw.random()
        yield Trial(what, "a changed answer", script(lambda r, seed=seed: dofs(r, seed)))

    def problem(key, value, k):
        return lambda r: r["entries"][k]["asked"].__setitem__(key, value)

    for key, value in (("mesh digest", "0" * 16), ("gamma0", 101.0), ("f", "0.0"), ("psi", "1.0"), ("n", 9), ("method", "p3"), ("h", "global"),
                       ("parts of the boundary, digest", "0" * 16), ("t", "1.0"), ("g", "x"), ("dofs", 1), ("quadrature", ["centroid", "gauss-5"])):
        if draw.random() < 0.3:
            yield Trial(what, f"{key} of a record", script(problem(key, value, draw.randrange(4))))
    yield Trial(what, "a case missing", script(lambda r: r["entries"].pop()))
    yield Trial(what, "no answers", script(lambda r: r["entries"].clear()))
    yield Trial(what, "the answer of another code", script(lambda r: r["entries"][0].__setitem__("by", "other")))
    yield Trial(what, "the answer to another problem", script(lambda r: r["entries"][0].__setitem__("at", r["entries"][1]["at"])))
    yield Trial(what, "converged", script(lambda r: r["entries"][1]["found"].__setitem__("converged", False)))
    yield Trial(what, "the answer of another method", script(lambda r: r["entries"][2].__setitem__("found", r["entries"][3]["found"])))
    yield Trial(what, "settings", script(lambda r: r["of"].__setitem__("increment", 1e-3)))
    yield Trial(what, "schema", script(lambda r: r.__setitem__("schema", "faceoff/baseline/1")))
    if scene == "one-zone":
        for change in draw.sample(CHANGED, 3):
            if change[0] == "n":
                continue

            def changed(at, change=change):
                at.put("base/baseline.json", answer(at.program, "one-zone", 4)[1])
                at.put("one-zone.toml", scene_text(change))
                return at.run("verify", "one-zone.toml", "--n", 4, "--methods", ",".join(METHODS), "--against", "base")

            yield Trial(what, "the scene: " + change[0], changed)


@forever
def journal(draw, turn):
    """A journal of a run: its answers, or what they depend on, are changed."""
    words = ["verify", "one-zone.toml", "--n", 4, "--methods", "cr,p1", "--engines", "rust,liar.toml", "--resume", "kept"]
    what = "verify --resume"

    def script(change):
        def run(at):
            values = {m: answer(at.program, "one-zone")[0][m] for m in ("cr", "p1")}
            at.put_all(liar(values))
            at.put("one-zone.toml", scene_text())
            at.must(*words)
            return at.run(*(change(at, values) or words))

        return run

    def lines(at, pick):
        path = at.folder / "kept/journal.jsonl"
        text = path.read_text()
        found = [m for m in re.finditer(r'"dofs": ?"([^"]+)"', text)]
        if not found:
            numbers = [m for m in re.finditer(r"\d\.\d{6,}", text)]
            m = pick.choice(numbers)
            path.write_text(text[: m.start()] + "7" + text[m.start() + 1:])
            return
        m = pick.choice(found)
        data = base64.b64decode(m.group(1))
        values = list(struct.unpack(f"<{len(data) // 8}d", data))
        path.write_text(text[: m.start(1)] + base64.b64encode(packed(spoiled(values, pick))).decode() + text[m.end(1):])

    yield Trial(what, "agrees", script(lambda at, v: None), True)
    yield Trial(what, "the code's script is changed", script(lambda at, v: at.put("liar.py", LIAR.replace("write_bytes(data)", "write_bytes(bytes(len(data)))"))))
    yield Trial(what, "the code's data are changed", script(lambda at, v: at.put("cr.f64", packed([0.5 * w for w in v["cr"]]))))
    yield Trial(what, "the code's data are gone", script(lambda at, v: (at.folder / "p1.f64").unlink()))
    yield Trial(what, "the code's other file is changed", script(lambda at, v: at.put("lie.json", json.dumps({"exit": 3}))))
    for change in draw.sample(CHANGED, 4):
        if change[0] == "n":
            continue
        yield Trial(what, "the scene: " + change[0], script(lambda at, v, c=change: at.put("one-zone.toml", scene_text(c))))
    yield Trial(what, "other methods", script(lambda at, v: [w if w != "cr,p1" else "p2,p1" for w in words]))
    yield Trial(what, "another n", script(lambda at, v: [w if w != 4 else 5 for w in words]))
    for _ in range(3):
        seed = draw.random()
        def gone(at, v, s=seed):
            lines(at, random.Random(s))
            at.put("liar.py", "raise SystemExit(1)")

        yield Trial(what, "a kept answer is changed and the code gone", script(gone))


@functools.cache
def _solved(program, method, n):
    with tempfile.TemporaryDirectory() as folder:
        at = At(program, folder)
        at.must("solve", "one-zone", "--n", n, "--method", method, "--out", "u.vtu")
        at.must("mesh", "convert", "u.vtu", "a.vtu", "--encoding", "ascii")
        at.must("mesh", "convert", "u-faces.vtu", "f.vtu", "--encoding", "ascii")

        def arrays(name):
            text = (at.folder / name).read_text()
            found = re.findall(r'<DataArray type="[^"]*" Name="([^"]*)"[^>]*format="ascii">(.*?)</DataArray>', text, re.DOTALL)
            return {key: body.split() for key, body in found}

        cells, faces = arrays("a.vtu"), arrays("f.vtu")
        places = [tuple(map(float, cells["Points"][i:i + 3])) for i in range(0, len(cells["Points"]), 3)]
        u = next(v for k, v in cells.items() if k == "u" or k.startswith("u "))
        corners = [tuple(map(int, faces["connectivity"][i:i + 2])) for i in range(0, len(faces["connectivity"]), 2)]
        dofs = [float(v) for k, v in faces.items() if k.startswith("mean") for v in v]
        return places, [float(v) for v in u], corners, dofs


def solved(program, method, n):
    with LOCK:
        return _solved(program, method, n)


def points_of(program, n):
    """The P1 solution as a model: points of a grid, each once."""
    places, u, _, _ = solved(program, "p1", n)
    value = dict(zip(places, u))
    return list(value), [(v,) for v in value.values()]


def csv_points(places, values):
    return "x,y,u\n" + "".join(f"{p[0]!r},{p[1]!r},{v[0]!r}\n" for p, v in zip(places, values))


def csv_faces(corners, values):
    return "v0,v1,u\n" + "".join(f"{a},{b},{v[0]!r}\n" for (a, b), v in zip(corners, values))


FAULTS = [
    model.one_value, model.one_value_by_little, model.sign_of_all, model.factor, model.constant_added, model.two_exchanged,
    model.shifted_by_one, model.reversed_order, model.of_the_last, model.all_the_mean, model.all_zero, model.nan,
]


@forever
def judge(draw, turn):
    """A field with a fault, or a scene, method or mesh that is another."""
    method = ("p1", "cr", "cr-fc")[turn % 3]
    n = 3 + turn % 4
    what = f"judge, {method}"
    seed = draw.random()
    words = ["judge", "u.csv", "--scene", "one-zone.toml", "--n", n, "--method", method]

    def script(fault=None, change=None, words=words, method=method, n=n, seed=seed, rows=None):
        def run(at):
            if method == "p1":
                keys, values = points_of(at.program, n)
            else:
                _, _, keys, dofs = solved(at.program, method, n)
                values = [(v,) for v in dofs]
            field = model.Model(keys, [], [(None, [model.Field("u", "points", values)])])
            if fault:
                field = model.wrong(field, fault, random.Random(seed))
            text = (csv_points if method == "p1" else csv_faces)(keys, field.fields[0].values)
            at.put("u.csv", rows(text) if rows else text)
            at.put("one-zone.toml", scene_text(change))
            return at.run(*words)

        return run

    yield Trial(what, "agrees", script(), True)
    for fault in draw.sample(FAULTS, 7):
        yield Trial(what, fault.__name__, script(fault))
    # One contact condition a face holds with any γ.
    changes = [c for c in CHANGED if c[0] != "n" and not (method == "cr-fc" and c[0] in ("gamma0", "h"))]
    for change in draw.sample(changes, 5):
        yield Trial(what, "the scene: " + change[0], script(change=change))
    if method != "cr-fc":
        yield Trial(what, "another gamma0", script(words=[*words, "--gamma0", 99]))
    yield Trial(what, "another n", script(words=[w if w != n else n + 1 for w in words]))
    yield Trial(what, "another method", script(words=[w if w != method else {"p1": "p2", "cr": "cr-fc", "cr-fc": "cr"}[method] for w in words]))
    yield Trial(what, "a row missing", script(rows=lambda t: t[: t[:-1].rindex("\n") + 1]))
    yield Trial(what, "a row twice", script(rows=lambda t: t + t[t[:-1].rindex("\n") + 1: -2] + "7\n"))


@forever
def certify(draw, turn):
    """A certified bound has to hold: of a field that was moved by more than the bound before allows, it says so."""
    n, what, seed = 3 + turn % 4, "certify: the bound holds", draw.random()

    def script(by, n=n, seed=seed):
        def run(at):
            pick = random.Random(seed)
            keys, values = points_of(at.program, n)
            inside = [k for k, (x, y, _) in enumerate(keys) if y < 1]
            k = pick.choice(inside)
            # ‖∇φ‖ of a hat function is at least 1 on these meshes: half a cell at a corner.
            delta = by * (1 if values[k][0] >= 0 else -1)
            values = list(values)
            values[k] = (values[k][0] + delta,)
            at.put("u.csv", csv_points(keys, values))
            code = at.run("certify", "u.csv", "--scene", "one-zone", "--n", n, "--element", "p1", "--json", "o.json")
            if code:
                return code
            told = json.loads((at.folder / "o.json").read_text())
            bound = told["certificate"]["upper"] if "certificate" in told else told["upper"]
            # The unmoved field is within 0.5 of the solution: the moved one farther than this.
            at.said += f"\nbound {bound}, moved by {by}"
            return 0 if by == 0 or bound < 0.7 * abs(by) - 0.5 else 1

        return run

    yield Trial(what, "agrees", script(0), True)
    for by in (2.0, -3.0, 10.0, -100.0, 1e6):
        yield Trial(what, "a value moved: no bound below the distance", script(by))


@forever
def matrix(draw, turn):
    def file(names):
        return 'scenes = ["one-zone"]\nmethods = ["cr", "p1"]\nn = [4]\n' + "".join(
            f'[[releases]]\nname = "{n}"\ncommand = ["python3", "{n}.py"]\n' for n in names)

    what = "matrix"

    def script(change, lie=None, names=("liar",), gone=None):
        def run(at):
            values = {m: answer(at.program, "one-zone")[0][m] for m in ("cr", "p1")}
            at.put_all(liar(change(values), lie))
            at.put("m.toml", file(names))
            return at.run("matrix", "--run", "m.toml")

        return run

    yield Trial(what, "agrees", script(lambda v: v), True)
    yield Trial(what, "a release that is not there", script(lambda v: v, names=("liar", "gone")))
    for _ in range(4):
        seed = draw.random()

        def change(values, seed=seed):
            pick = random.Random(seed)
            k = pick.choice(list(values))
            return {**values, k: spoiled(values[k], pick)}

        yield Trial(what, "a changed answer", script(change))
    for lie in draw.sample(LIES, 2):
        yield Trial(what, "a lie about its answers", script(lambda v: v, lie))


def is_measured(at, norm, order):
    """`orders` measures: that it finds the order of theory counts as a verdict; 0 or 1."""
    told = (at.folder / "o.json").read_text()
    fits = [float(v) for v in re.findall(r'"(?:exponent|fit)": ?([-0-9.e+]+)', told)]
    at.said += told[:2000] + f"\norders {fits}"
    return 0 if fits and abs(min(fits, key=lambda f: abs(f - order)) - order) < 0.1 else 1


@forever
def campaigns(draw, turn):
    """`orders` of scenes whose exact solution is another; `orders` of results with one spoiled."""
    exact = (
        'name = "s"\n[mesh]\ngenerator = "union-jack"\nn = 4\n[boundary]\ndirichlet = ["top", "left", "right", "bottom"]\n'
        '[data]\nf = "2*pi^2*sin(pi*x)*sin(pi*y)"\n[exact]\nu = "sin(pi*x)*sin(pi*y)"\n'
    ).replace('dirichlet = ["top", "left", "right", "bottom"]', 'dirichlet = ["top", "left", "right"]\ncontact = ["bottom"]\n').replace(
        '"2*pi^2*sin(pi*x)*sin(pi*y)"', '"2*pi^2*sin(pi*x)*sin(pi*y)"')
    # On the bottom u = 0 = ψ and ∂ₙu = -π sin(πx) < 0: contact everywhere.
    what = "orders of a scene"

    method, least = draw.choice([("p1", 2), ("cr", 2)])

    def script(old="", new="", method=method, least=least):
        def run(at):
            at.put("s.toml", exact.replace(old, new) if old else exact)
            code = at.run("orders", "s.toml", "--methods", method, "--n", "8,16,32", "--json", "o.json")
            return code or is_measured(at, "l2", least)

        return run

    yield Trial(what, "agrees", script(), True)
    yield Trial(what, "another exact solution", script('u = "sin(pi*x)*sin(pi*y)"', 'u = "1.05*sin(pi*x)*sin(pi*y)"'))
    yield Trial(what, "another load", script('f = "2*pi^2', 'f = "2.1*pi^2'))
    yield Trial(what, "another value on the boundary", script("[data]", '[data]\ng = "0.05"'))
    yield Trial(what, "another obstacle", script("[data]", '[data]\npsi = "-0.05"'))

    what = "orders --results"

    def levels(change=None, words=("--exact", "sin(3*x)*cos(2*y)"), only=None):
        def run(at):
            for k, n in enumerate((4, 8, 16, 32)):
                points, cells = model.grid("triangle", n)
                values = [(math.sin(3 * x) * math.cos(2 * y),) for x, y, _ in points]
                m = model.Model(points, cells, [(None, [model.Field("u", "points", values)])])
                if change and (only is None or only == k):
                    change(m.fields[0], n)
                at.put_all(formats.vtu(m, f"u{k}")[0])
            code = at.run("orders", "--results", "u0.vtu,u1.vtu,u2.vtu,u3.vtu", *words, "--json", "o.json")
            if code:
                return code
            return is_measured(at, "l2", 2)

        return run

    yield Trial(what, "agrees", levels(), True)
    scale = lambda by: lambda f, n: f.values.__setitem__(slice(None), [(by * v[0],) for v in f.values])
    yield Trial(what, "all by a factor", levels(scale(1.05)))
    yield Trial(what, "the finest by a factor", levels(scale(1.01), only=3))
    yield Trial(what, "a middle one by a factor", levels(scale(1.05), only=2))
    yield Trial(what, "an error of order 1", levels(lambda f, n: f.values.__setitem__(slice(None), [(v[0] + 1 / n,) for v in f.values])))
    yield Trial(what, "another exact solution", levels(words=("--exact", "sin(3*x)*cos(2.05*y)")))
    yield Trial(what, "the finest negative", levels(scale(-1), words=(), only=3))
    yield Trial(what, "one value", levels(lambda f, n: f.values.__setitem__(3, (9.0,)), words=()))
