"""Face-offs: files of two codes, of which the second answers something else; their records and kept runs."""

import functools
import math
import subprocess

from . import formats, model
from .trial import Trial, forever


@functools.cache
def verify(program):
    """A file that starts programs may have to be said to."""
    said = subprocess.run([program, "verify", "--help"], capture_output=True, text=True, check=False).stdout
    return ("verify", "--run") if "--run" in said else ("verify",)


def codes(second, result, first=None, more_a="", more_b=""):
    first = first or ["cp", "-r", "a/.", "{out}"]
    return (
        f'name = "x"\n[codes.a]\ncommand = {quoted(first)}\n{result}{more_a}'
        f"[codes.b]\ncommand = {quoted(second)}\n{result}{more_b}"
    )


def quoted(words):
    return "[" + ", ".join('"' + w.replace('"', '\\"') + '"' for w in words) + "]"


COPY_B = ["cp", "-r", "--", "b/.", "{out}"]


def under(folder, files):
    return {f"{folder}/{name}": data for name, data in files.items()}


def run(text, files, words=(), change=None, before=None):
    """The file and what its codes copy; where there is a `change`, after a first run with `before`."""

    def script(at):
        at.put_all(files)
        at.put("x.toml", text)
        if before is not None:
            at.must(*verify(at.program), "x.toml", *before)
            change(at)
        return at.run(*verify(at.program), "x.toml", *words)

    return script


def fields_of(names, rtol="1e-10", same="discretisation"):
    return "".join(f'[fields.{n}]\nsame = "{same}"\nrtol = {rtol}\n' for n in names)


@forever
def fields(draw, turn):
    """Files of any format, one or several times."""
    times = (None,) if turn % 2 else ((0.1, 0.2, 0.3), (1.0, 2.0, 4.0, 8.0))[turn // 2 % 2]
    series = len(times) > 1
    writer = (formats.pvd, formats.xdmf)[turn // 2 % 2] if series else (formats.vtu, formats.msh, formats.vtk, formats.pvtu)[turn // 2 % 4]
    good = model.result(draw, ("triangle", "quad")[turn % 3 == 2], 3, times)
    left, name = writer(good, "u")
    twin = model.rounded(good, draw)
    if turn % 3:
        twin = model.renumbered(twin, draw)
    right, _ = writer(twin, "u")
    what = "verify, a face-off: " + ("fields of several times" if series else "fields")
    text = codes(COPY_B, f'result = "{name}"\n') + fields_of(["u", "w", "p", "q"])
    yield Trial(what, "agrees", run(text, {**under("a", left), **under("b", right)}), True)
    # A field that the file does not name is not asked for, and groups of fields may be in any order.
    faults = [*model.VALUES, *model.PLACES, model.field_missing, model.field_renamed, model.names_exchanged, *(model.TIMES if series else [])]
    for fault in draw.sample(faults, 14) + ([f for f in model.TIMES] if series else []):
        bad = model.wrong(twin, fault, draw)
        if bad is None:
            continue
        right, _ = writer(bad, "u")
        yield Trial(what, fault.__name__, run(text, {**under("a", left), **under("b", right)}))


@forever
def numbers(draw, turn):
    """Tables name,value and what a file says of them."""
    values = {"force": draw.uniform(1, 2), "area": draw.uniform(1e-6, 2e-6), "energy": -draw.uniform(1, 2)}
    what = "verify, a face-off: numbers"

    def table(values):
        return "name,value\n" + "".join(f"{k},{v!r}\n" for k, v in values.items())

    def file(more="", names=values):
        return codes(COPY_B, 'numbers = "n.csv"\n') + "".join(
            f'[numbers.{n}]\nsame = "discretisation"\nrtol = 1e-9\n' + (more if n == "force" else "") for n in names)

    left = {"a/n.csv": table(values)}

    def trial(fault, text, agrees=False, file_text=None, left=left, what=what):
        return Trial(what, fault, run(file_text or file(), {**left, "b/n.csv": text}), agrees)

    yield trial("agrees", table(dict(reversed(values.items()))), True)
    exact = f"exact = {values['force']!r}\nexact_rtol = 1e-6\n"
    yield trial("agrees", table(values), True, file(exact))
    for key, v in values.items():
        for by in (1 + 1e-8, 2, -1, 0, 1e3, math.nan, math.inf):
            yield trial(f"a number by {by}", table({**values, key: v * by}))
        yield trial("a number missing", table({k: w for k, w in values.items() if k != key}))
        yield trial("a number renamed", table({(k + "s" if k == key else k): w for k, w in values.items()}))
        yield trial("a number twice", table(values) + f"{key},{2 * v!r}\n")
        yield trial("a number empty", table(values).replace(repr(v), ""))
        yield trial("a number as a word", table(values).replace(repr(v), "x"))
        yield trial("a decimal comma", table(values).replace(repr(v), f'"{repr(v).replace(".", ",")}"'))
    yield trial("two exchanged", table({**values, "force": values["area"], "area": values["force"]}))
    yield trial("cut off", table(values)[:-14])
    yield trial("empty", "")
    wrong = table({k: 1.01 * v for k, v in values.items()})
    yield Trial(what, "both against the exact one", run(file(exact), {"a/n.csv": wrong, "b/n.csv": wrong + "\n"}))
    yield Trial(what, "exact is another", run(file(f"exact = {values['force'] * 1.1!r}\nexact_rtol = 1e-3\n"), {**left, "b/n.csv": table(values)}))
    yield Trial(what, "NaN in both", run(file(), {k: table({**values, "force": math.nan}) for k in ("a/n.csv", "b/n.csv")}))
    yield Trial(what, "a number that none has", run(file(names=[*values, "other"]), {**left, "b/n.csv": table(values)}))


@forever
def programs(draw, turn):
    """Codes that do not do what they should."""
    good = model.result(draw, "triangle", 2, only=("u",))
    files = {**under("a", formats.vtu(good, "u")[0]), **under("b", formats.vtu(model.rounded(good, draw), "u")[0])}
    what = "verify, a face-off: programs"

    def trial(fault, second, more="", agrees=False, extra=None, first=None, files=files, what=what):
        text = codes(second, 'result = "u.vtu"\n', first) + fields_of(["u"]) + more
        return Trial(what, fault, run(text, {**files, **(extra or {})}), agrees)

    def sh(line):
        return ["sh", "-c", line]

    copy = "cp b/u.vtu {out}/u.vtu"
    yield trial("agrees", sh(copy), agrees=True)
    yield trial("a script that is wrong", sh("sed 's/[1-9]\\\\./8./' b/u.vtu > {out}/u.vtu"))
    yield trial("exit code 1 after a right answer", sh(copy + "; exit 1"))
    yield trial("exit code 77 after a right answer", sh(copy + "; exit 77"))
    yield trial("killed after a right answer", sh(copy + "; kill -9 $$"))
    yield trial("a segmentation fault", sh(copy + "; kill -SEGV $$"))
    yield trial("no file", ["true"])
    yield trial("another file", sh("cp b/u.vtu {out}/v.vtu"))
    yield trial("an empty file", sh(": > {out}/u.vtu"))
    yield trial("half a file", sh("head -c 900 b/u.vtu > {out}/u.vtu"))
    yield trial("a link to the other's file", sh("ln -s $PWD/a/u.vtu {out}/u.vtu"))
    yield trial("a folder in its place", sh("mkdir {out}/u.vtu"))
    yield trial("a program that is not there", ["none-of-this-name"])
    yield trial("a file that was there before, beside the file", sh("true"), extra={"u.vtu": files["b/u.vtu"]})
    yield trial("a field that none has", sh(copy), more=fields_of(["z"]))
    yield trial("an old file, moved", sh("cp -p b/u.vtu old.vtu; touch -d 2001-01-01 old.vtu; mv old.vtu {out}/u.vtu"))
    yield trial("the result of the first code", sh("true"), first=sh("cp a/u.vtu {out}/u.vtu; cp a/u.vtu {out}/../u.vtu"))


@forever
def orders(draw, turn):
    """Functions on meshes that are refined, against a formula."""
    formula = "sin(3*x)*cos(2*y)"
    levels = (4, 8, 16)
    what = "verify, a face-off: orders and exact answers"

    def results(change=None, levels=levels):
        files = {}
        for n in levels:
            points, cells = model.grid("triangle", n)
            values = [(math.sin(3 * x) * math.cos(2 * y),) for x, y, _ in points]
            m = model.Model(points, cells, [(None, [model.Field("u", "points", values)])])
            if change:
                change(m.fields[0], n, points)
            files[f"u-{n}.vtu"] = formats.vtu(m, "u")[0]["u.vtu"]
        return files

    def trial(fault, change=None, agrees=False, exact=formula, both=False, same="problem", least="{ l2 = 2, h1 = 1 }", what=what):
        text = (
            f'name = "x"\n[mesh]\ngenerator = "union-jack"\nn = {list(levels)}\n'
            '[codes.a]\ncommand = ["cp", "--", "a/u-{n}.vtu", "{out}/u.vtu"]\nmesh = "none"\nresult = "u.vtu"\n'
            '[codes.b]\ncommand = ["cp", "b/u-{n}.vtu", "{out}/u.vtu"]\nmesh = "none"\nresult = "u.vtu"\n'
            f'[fields.u]\nsame = "{same}"\n' + ("rtol = 1e-9\n" if same == "discretisation" else "")
            + (f'exact = "{exact}"\norders = {least}\n' if exact else "")
        )

        def script(at):
            at.put_all(under("b", results(change)))
            at.put_all(under("a", results(change if both else None)))
            at.put("x.toml", text)
            return at.run(*verify(at.program), "x.toml")

        return Trial(what, fault, script, agrees)

    def by(factor, only=None):
        def change(f, n, points):
            if only in (None, n):
                f.values = [(factor * v[0],) for v in f.values]

        return change

    def added(function):
        def change(f, n, points):
            f.values = [(v[0] + function(n, *p),) for v, p in zip(f.values, points)]

        return change

    yield trial("agrees", agrees=True)
    yield trial("all by a factor", by(draw.choice([1.05, 1.2, 2, -1])))
    yield trial("the finest by a factor", by(1.05, 16))
    yield trial("the middle one by a factor", by(1.2, 8))
    yield trial("an error of order 1", added(lambda n, x, y, z: 0.5 * x / n))
    yield trial("an error of order 0", added(lambda n, x, y, z: 0.05 * x))
    yield trial("a rough error", added(lambda n, x, y, z: 0.2 / n * math.sin(n * 50 * x + 3 * y)))
    yield trial("both by a factor", by(1.05), both=True)
    yield trial("both with an error of order 1", added(lambda n, x, y, z: 0.5 * x / n), both=True)
    yield trial("another exact answer", exact="sin(3*x)*cos(2.1*y)")
    yield trial("higher orders asked for", least="{ l2 = 3, h1 = 2 }")
    yield trial("by a factor, without a formula or a tolerance", by(1.05), exact=None)
    yield trial("an error of order 1/2, without a formula or a tolerance", added(lambda n, x, y, z: 0.3 * x / math.sqrt(n)), exact=None)
    yield trial("the finest alone", by(1 + 1e-6, 16), same="discretisation")
    yield trial("the coarsest alone", by(1 + 1e-6, 4), same="discretisation")


@forever
def records(draw, turn):
    """A record or a kept run, after something that it depends on was changed."""
    mesh = '[mesh]\ngenerator = "union-jack"\nn = [1, 2]\n[parameters]\nE = 1.5\n'
    good = model.result(draw, "triangle", 2, only=("u", "w"))
    first, second = (formats.vtu(m, "u")[0] for m in (good, model.rounded(good, draw)))
    bad = formats.vtu(model.wrong(good, draw.choice([model.one_value, model.sign_of_all, model.factor]), draw), "u")[0]
    files = {**under("a", first), **under("b", second), "b.sh": "cp b/u.vtu $1/u.vtu\n", "lib/c.sh": "true\n"}
    text = mesh_text = codes(["sh", "b.sh", "{out}", "{E}", "{n}"], 'result = "u.vtu"\n').replace("[codes.a]", mesh + "[codes.a]") + fields_of(["u", "w"])
    assert mesh_text.count("[mesh]") == 1

    def put(name, data):
        return lambda at: at.put(name, data)

    def replaced(name, old, new):
        def change(at):
            path = at.folder / name
            was = path.read_text()
            if old not in was:
                raise RuntimeError(f"{name} has no {old}")
            path.write_text(was.replace(old, new))

        return change

    def kept(at, pattern):
        found = sorted((at.folder / "record").rglob(pattern))
        if not found:
            raise RuntimeError(f"the record has no {pattern}")
        return found

    def spoil(which, data):
        def change(at):
            found = [p for p in kept(at, "*.vtu")]
            found[which % len(found)].write_text(data)

        return change

    what = "verify --against a record of a face-off"
    record, words = ["--record", "record"], ["--against", "record", "--engines", "b"]
    yield Trial(what, "agrees", run(text, files, words, lambda at: None, record), True)
    seed = draw.randrange(100)
    for fault, change in (
        ("the code's answer", put("b/u.vtu", bad["u.vtu"])),
        ("a recorded file", spoil(seed, bad["u.vtu"])),
        ("a recorded file is cut off", spoil(seed, bad["u.vtu"][:300])),
        ("a recorded file is gone", lambda at: kept(at, "*.vtu")[seed % 2].unlink()),
        ("a parameter", replaced("x.toml", "E = 1.5", "E = 1.6")),
        ("the mesh", replaced("x.toml", '"union-jack"', '"union-jack"\nsize = [2.0, 1.0]')),
        ("n", replaced("x.toml", "n = [1, 2]", "n = [1, 3]")),
        ("a field more", replaced("x.toml", "[fields.u]", '[fields.z]\nsame = "discretisation"\n[fields.u]')),
        ("the record's parameters", replaced("record/baseline.json", "1.5", "1.7")),
        ("the record is empty", put("record/baseline.json", "{}")),
        ("the record is gone", lambda at: (at.folder / "record/baseline.json").unlink()),
    ):
        yield Trial(what, fault, run(text, files, words, change, record))
    what = "verify --resume of a face-off"
    words = ["--resume", "record"]
    yield Trial(what, "agrees", run(text, files, words, lambda at: None, words), True)
    wrong_script = "sed 's/[1-9]\\./7./' b/u.vtu > $1/u.vtu\n"
    program = text.replace('"sh", "b.sh"', '"./solver"')
    sub = text.replace('"sh", "b.sh"', '"sh", "lib/b.sh"')

    def executable(at, name, data):
        at.put(name, "#!/bin/sh\n" + data)
        (at.folder / name).chmod(0o755)

    def with_solver(second):
        def script(at):
            at.put_all(files)
            executable(at, "solver", files["b.sh"])
            at.put("x.toml", program)
            at.must(*verify(at.program), "x.toml", *words)
            second(at)
            return at.run(*verify(at.program), "x.toml", *words)

        return script

    for fault, script in (
        ("the script", run(text, files, words, put("b.sh", wrong_script), words)),
        ("a parameter and the script", run(text, files, words, lambda at: (replaced("x.toml", "E = 1.5", "E = 1.6")(at), put("b.sh", wrong_script)(at)), words)),
        ("the mesh and the script", run(text, files, words, lambda at: (replaced("x.toml", "n = [1, 2]", "n = [1, 3]")(at), put("b.sh", wrong_script)(at)), words)),
        ("a kept file, and the code is gone", run(text, files, words, lambda at: (spoil(1, bad["u.vtu"])(at), put("b.sh", "exit 1")(at)), words)),
        ("a program without suffix", with_solver(lambda at: executable(at, "solver", wrong_script))),
        ("a script in a subfolder", run(sub, {**files, "lib/b.sh": files["b.sh"]}, words, put("lib/b.sh", wrong_script), words)),
        ("a file that the script reads", run(text, files, words, put("b/u.vtu", bad["u.vtu"]), words)),
    ):
        yield Trial(what, fault, script)
