"""`compare`: what one thinks of after the usual faults: other cells, other files, tables, parts that are far apart in scale."""

import copy
import math
import os
import re

from . import formats, model
from .compare import of
from .trial import forever


def digit(text, draw):
    """One number of the data with another first digit."""
    body = re.finditer(r"(?<![\w.\"])-?\d+(\.\d+)?(e-?\d+)?(?![\w\"])", text)
    # Kinds of cells have twins: a polygon of three corners is a triangle.
    kinds = range(text.find('Name="types"'), text.find("</Cells>"))
    m = draw.choice([m for m in body if m.start() not in kinds])
    found = m.group()
    at = 1 if found[0] == "-" else 0
    new = str((int(found[at]) + draw.randrange(1, 10)) % 10)
    return text[: m.start() + at] + new + text[m.start() + at + 1:], found


@forever
def digits(draw, turn):
    """A digit of any number of a VTU file, XDMF or table."""
    writer = (formats.vtu, formats.xdmf, formats.csv_places, formats.pvtu)[turn % 4]
    good = model.result(draw, ("triangle", "quad", "tetra")[turn % 3], 2, only=("u", "w") if writer is formats.csv_places else None)
    left, name = writer(good, "a")
    right, against = writer(model.rounded(good, draw), "b")
    what = f"compare, {writer.__name__}"
    yield of(what, "agrees", {**left, **right}, ["compare", name, against], True)
    for _ in range(10):
        bad = dict(right)
        file = draw.choice([n for n in bad if not n.endswith(".pvtu")])
        head, tail = "", bad[file]
        if file.endswith((".vtu", ".xdmf")):
            head, tail = tail[: tail.index("Number")], tail[tail.index("Number"):]
        tail, _ = digit(tail, draw)
        bad[file] = head + tail
        yield of(what, "a digit of any number", {**left, **bad}, ["compare", name, against])


def written(m, name="b"):
    return formats.vtu(m, name)[0]


@forever
def pieces(draw, turn):
    """Two bodies, one a millionth of the other in scale: each is judged on its own."""
    good = model.result(draw, "triangle", 2)
    small = model.result(draw, "triangle", 2, scale=1e-6)
    n = len(good.points)
    both = model.Model(
        good.points + [(x + 3, y, z) for x, y, z in small.points],
        good.cells + [(kind, [v + n for v in numbers]) for kind, numbers in small.cells],
        [(None, [model.Field(f.name, f.on, f.values + g.values) for f, g in zip(good.fields, small.fields)])],
    )
    what = "compare, a small body beside a large one"
    left = written(both, "a")
    yield of(what, "agrees", {**left, **written(model.rounded(both, draw))}, ["compare", "a.vtu", "b.vtu"], True)
    for by in (1 + 1e-5, 1.001, 2, -1, 0):
        bad = model.rounded(both, draw)
        f = draw.choice(bad.fields)
        k = draw.randrange(len(f.values) // 2, len(f.values))
        if by in (2, -1):
            half = len(f.values) // 2
            f.values = f.values[:half] + [tuple(by * v for v in row) for row in f.values[half:]]
        else:
            f.values[k] = tuple(by * v for v in f.values[k])
        yield of(what, f"a value of the small one by {by}", {**left, **written(bad)}, ["compare", "a.vtu", "b.vtu"])


@forever
def functions(draw, turn):
    """One function on two meshes: linear, so that both have it exactly."""
    kind = ("triangle", "quad", "tetra")[turn % 2]
    sides = []
    coefficients = [draw.uniform(0.5, 2) for _ in range(3)]
    for n in (2, 3):
        points, cells = model.grid(kind, n)
        values = [(coefficients[0] + coefficients[1] * x + coefficients[2] * y,) for x, y, _ in points]
        sides.append(model.Model(points, cells, [(None, [model.Field("u", "points", values)])]))
    what = f"compare, functions on two meshes of {kind}s"
    left = written(sides[0], "a")
    words = ["compare", "a.vtu", "b.vtu"]
    yield of(what, "agrees", {**left, **written(sides[1])}, words, True)
    usable = [f for f in model.VALUES if f not in (model.components_swapped, model.turned, model.third_component)]
    for fault in [*usable, model.field_extra, model.field_renamed, model.scaled_mesh, model.moved_mesh,
                  model.mirrored_mesh, model.cell_missing, model.cell_twice, model.point_moved, model.corner_of_another]:
        if fault in (model.point_moved, model.scaled_mesh, model.moved_mesh) and draw.random() < 0:
            continue
        bad = model.wrong(sides[1], fault, draw)
        if bad is not None:
            yield of(what, fault.__name__, {**left, **written(bad)}, words)


@forever
def turned(draw, turn):
    """The same corners of a cell in an order that is no way to number it: a hexahedron, prism or quadrangle that is folded."""
    n, what, words = 2, "compare, the order of a cell's corners", ["compare", "a.vtu", "b.vtu"]
    kind, right, folded = (
        ("hexahedron", [1, 2, 3, 0, 5, 6, 7, 4], ([0, 1, 3, 2, 4, 5, 7, 6], [0, 1, 2, 3, 5, 6, 7, 4], [4, 1, 2, 3, 0, 5, 6, 7])),
        ("quad", [2, 3, 0, 1], ([0, 2, 1, 3], [0, 1, 3, 2], [1, 0, 2, 3])),
    )[turn % 2]
    formats.VTK["hexahedron"] = 12
    if kind == "quad":
        points, cells = model.grid("quad", n)
    else:
        points, _ = model.grid("tetra", n)
        at = {(i, j, k): i + (n + 1) * (j + (n + 1) * k) for i in range(n + 1) for j in range(n + 1) for k in range(n + 1)}
        ring = ((0, 0), (1, 0), (1, 1), (0, 1))
        cells = [(kind, [at[i + a, j + b, k + c] for c in (0, 1) for a, b in ring]) for i in range(n) for j in range(n) for k in range(n)]
    values = [(model.value(draw, p, 0, 0),) for p in points]
    good = model.Model(points, cells, [(None, [model.Field("u", "points", values)])])
    left = written(good, "a")

    def other(order, which):
        m = model.rounded(good, draw)
        m.cells = [(c[0], [c[1][k] for k in order]) if i in which else c for i, c in enumerate(m.cells)]
        return {**left, **written(m)}

    yield of(what, "agrees", other(right, range(len(cells))), words, True)
    for order in folded:
        yield of(what, f"one {kind}", other(order, [draw.randrange(len(cells))]), words)
        yield of(what, f"each {kind}", other(order, range(len(cells))), words)


@forever
def quadratic(draw, turn):
    """Quadratic triangles: nodes on edges that change places, or stand where those of the vertices should."""
    n = 2
    points = [(i / (2 * n), j / (2 * n), 0.0) for j in range(2 * n + 1) for i in range(2 * n + 1)]
    at = {(i, j): i + (2 * n + 1) * j for i in range(2 * n + 1) for j in range(2 * n + 1)}
    cells = []
    for j in range(0, 2 * n, 2):
        for i in range(0, 2 * n, 2):
            for a, b, c in (((i, j), (i + 2, j), (i + 2, j + 2)), ((i, j), (i + 2, j + 2), (i, j + 2))):
                half = [((p[0] + q[0]) // 2, (p[1] + q[1]) // 2) for p, q in ((a, b), (b, c), (c, a))]
                cells.append(("quadratic", [at[p] for p in (a, b, c, *half)]))
    formats.VTK["quadratic"] = 22
    values = [(model.value(draw, p, 0, 0),) for p in points]
    good = model.Model(points, cells, [(None, [model.Field("u", "points", values)])])
    left = written(good, "a")
    what, words = "compare, quadratic cells", ["compare", "a.vtu", "b.vtu"]
    twin = model.rounded(good, draw)
    yield of(what, "agrees", {**left, **written(twin)}, words, True)
    bad = copy.deepcopy(twin)
    kind, numbers = bad.cells[2]
    bad.cells[2] = (kind, numbers[:3] + numbers[4:] + numbers[3:4])
    yield of(what, "nodes of the edges in another order", {**left, **written(bad)}, words)
    bad = copy.deepcopy(twin)
    bad.cells = [("triangle", numbers[:3]) for _, numbers in bad.cells]
    yield of(what, "as linear triangles", {**left, **written(bad)}, words)
    for fault in (model.one_value, model.one_value_by_little, model.two_exchanged, model.point_moved, model.nan):
        yield of(what, fault.__name__, {**left, **written(model.wrong(twin, fault, draw))}, words)


def identity(draw):
    """A file against itself, under whatever name; nothing against nothing."""
    m = model.result(draw)
    text = formats.vtu(m, "a")[0]
    what = "compare, a file against itself or nothing"
    yield of(what, "agrees", {**text, **written(m)}, ["compare", "a.vtu", "b.vtu"], True)
    yield of(what, "the same file", text, ["compare", "a.vtu", "a.vtu"])
    yield of(what, "the same file", text, ["compare", "a.vtu", "./a.vtu"])
    yield of(what, "a symbolic link", text, ["compare", "a.vtu", "b.vtu"], links=[(os.symlink, "a.vtu", "b.vtu")])
    yield of(what, "a hard link", text, ["compare", "a.vtu", "b.vtu"], links=[(os.link, "a.vtu", "b.vtu")])
    yield of(what, "a folder by a link", {"x/a.vtu": text["a.vtu"]}, ["compare", "x", "y"], links=[(os.symlink, "x", "y")])
    yield of(what, "files by links", {"x/a.vtu": text["a.vtu"], "y/b": ""}, ["compare", "x", "y"], links=[(os.link, "x/a.vtu", "y/a.vtu")])
    yield of(what, "a series of the same files", {
        "a.vtu": text["a.vtu"], **{n: '<VTKFile type="Collection"><Collection><DataSet timestep="0" file="a.vtu"/></Collection></VTKFile>'
                                   for n in ("a.pvd", "b.pvd")}}, ["compare", "a.pvd", "b.pvd"])
    none = model.Model(m.points, m.cells, [(None, [])])
    yield of(what, "no field in either", {**formats.vtu(none, "a")[0], **written(none)}, ["compare", "a.vtu", "b.vtu"])
    empty = model.Model([], [], [(None, [])])
    yield of(what, "no cell in either", {**formats.vtu(empty, "a")[0], **written(empty)}, ["compare", "a.vtu", "b.vtu"])
    yield of(what, "two empty folders", {"x/n": "", "y/n": ""}, ["compare", "x", "y"])
    yield of(what, "two empty tables", {"a.csv": "vertex,u\n", "b.csv": "vertex,u\n"}, ["compare", "a.csv", "b.csv"])
    yield of(what, "two empty files", {"a.csv": "", "b.csv": ""}, ["compare", "a.csv", "b.csv"])
    yield of(what, "--only of no field", {**text, **written(m)}, ["compare", "a.vtu", "b.vtu", "--only", "z"])
    yield of(what, "--only of a pattern of none", {**text, **written(m)}, ["compare", "a.vtu", "b.vtu", "--only", "z*"])
    yield of(what, "--except of all", {**text, **written(m)}, ["compare", "a.vtu", "b.vtu", "--except", "*"])
    yield of(what, "--dim of no cell", {**text, **written(m)}, ["compare", "a.vtu", "b.vtu", "--dim", "3"])
    yield of(what, "--include of none", {"x/a.vtu": text["a.vtu"], "y/a.vtu": text["a.vtu"]}, ["compare", "x", "y", "--include", "*.med"])
    yield of(what, "a time that none has", {**text, **written(m)}, ["compare", "a.vtu", "b.vtu", "--time", "7"])
    for zero in (0.0, -0.0):
        z = model.wrong(m, model.all_zero, draw)
        bad = copy.deepcopy(z)
        f = next(f for f in bad.fields if all(v == 0 for row in f.values for v in row))
        f.values[1] = tuple(5e-324 if i == 0 else zero for i, _ in enumerate(f.values[1]))
        yield of(what, "the least number in place of 0", {**formats.vtu(z, "a")[0], **written(bad)}, ["compare", "a.vtu", "b.vtu"])
    both = model.wrong(m, model.nan, draw)
    yield of(what, "NaN or infinity at one place of both", {**formats.vtu(both, "a")[0], **written(both)}, ["compare", "a.vtu", "b.vtu"])
    for words in (["--rtol", "nan"], ["--rtol", "inf"], ["--rtol", "-1"], ["--atol", "nan"], ["--atol", "inf"], ["--uncovered", "nan"],
                  ["--place-tolerance", "nan"], ["--place-tolerance", "inf"], ["--field", "u:rtol=nan"], ["--field", "u:atol=inf"],
                  ["--time-tolerance", "nan"], ["--field", "zz:rtol=1"], ["--rtol", "1e400"]):
        bad = model.wrong(m, model.sign_of_all, draw)
        yield of(what, " ".join(words[:1]) + " of no number or no field", {**text, **written(bad)}, ["compare", "a.vtu", "b.vtu", *words])


@forever
def ghosts(draw, turn):
    """What a flag leaves out must be somewhere else."""
    m = model.result(draw)
    what, words = "compare, ghosts and hidden cells", ["compare", "a.vtu", "b.vtu"]
    left = formats.vtu(m, "a")[0]
    yield of(what, "agrees", {**left, **written(m)}, words, True)
    for flag in (1, 2, 32, 33):
        for on in ("cells", "points"):
            bad = model.rounded(m, draw)
            k = draw.randrange(bad.size(on))
            for f in bad.fields:
                if f.on == on:
                    f.values[k] = tuple(2 * v for v in f.values[k])
            bad.fields.append(model.Field("vtkGhostType", on, [(flag if i == k else 0,) for i in range(bad.size(on))]))
            text = written(bad)["b.vtu"].replace('type="Float64" Name="vtkGhostType"', 'type="UInt8" Name="vtkGhostType"')
            text = re.sub(r'(Name="vtkGhostType".*?</DataArray>)', lambda t: t.group().replace(".0", ""), text, flags=re.DOTALL)
            yield of(what, f"wrong {on} flagged {flag}", {**left, "b.vtu": text}, words)


@forever
def folders(draw, turn):
    base = {f"{n}.vtu": formats.vtu(model.result(draw, n=2), "a")[0]["a.vtu"] for n in ("one", "two", "sub/three")}
    base["table.csv"] = formats.csv_numbers(model.result(draw, n=2, only=("u",)), "a")[0]["a.csv"]
    left = {"x/" + n: t for n, t in base.items()}
    right = {"y/" + n: t for n, t in base.items()}
    what, words = "compare, folders", ["compare", "x", "y"]
    yield of(what, "agrees", {**left, **right}, words, True)
    for name, text_of in base.items():
        gone = {n: t for n, t in right.items() if n != "y/" + name}
        yield of(what, "a file missing", {**left, **gone}, words)
        yield of(what, "a file extra", {**{n: t for n, t in left.items() if n != "x/" + name}, **right}, words)
        yield of(what, "a file renamed", {**left, **gone, "y/new-" + name.replace("/", "-"): text_of}, words)
        yield of(what, "an empty file", {**left, **right, "y/" + name: ""}, words)
        text, _ = digit(text_of[text_of.index("<Poi" if name[-3:] == "vtu" else "\n"):], draw)
        head = text_of[: text_of.index("<Poi" if name[-3:] == "vtu" else "\n")]
        yield of(what, "a digit of one file", {**left, **right, "y/" + name: head + text}, words)
    yield of(what, "two files exchanged", {**left, **right, "y/one.vtu": base["two.vtu"], "y/two.vtu": base["one.vtu"]}, words)
    yield of(what, "a file for a folder", {**left, "y": base["one.vtu"]}, words)


@forever
def tables(draw, turn):
    """Keys of every kind."""
    kinds = {
        "vertex": (["vertex"], lambda k: [k]),
        "x,y": (["x", "y"], lambda k: [0.25 * k, (k % 3) * 0.5]),
        "v0,v1": (["v0", "v1"], lambda k: [k, k + 1]),
        "v0,v1,v2": (["v0", "v1", "v2"], lambda k: [k, k + 1, k + 2]),
        "time": (["time"], lambda k: [0.1 * k]),
        "none": ([], lambda k: []),
    }
    key = list(kinds)[turn % len(kinds)]
    head, keys = kinds[key]
    rows = [[*keys(k), 1.5 + math.sin(k), 2.0 + math.cos(k), k] for k in range(9)]

    def text(head, rows):
        return ",".join([*head, "u", "v", "count"]) + "\n" + "".join(",".join(map(str, r)) + "\n" for r in rows)

    what, words = f"compare, tables by {key}", ["compare", "a.csv", "b.csv"]
    left = {"a.csv": text(head, rows)}
    yield of(what, "agrees", {**left, "b.csv": text(head, rows).replace("\n", " \n")}, words, True)
    n = len(head)

    def bad(fault, change, head=head, rows=rows, left=left, what=what, words=words):
        other = copy.deepcopy(rows)
        new = change(other)
        return of(what, fault, {**left, "b.csv": text(head, other) if new is None else new}, words)

    k, j = draw.sample(range(9), 2)
    yield bad("a row missing", lambda r: r.pop(k) and None)
    yield bad("a row twice, otherwise", lambda r: r.append([*r[k][:n], 7.0, 7.0, 7]))
    yield bad("the last row missing", lambda r: r.pop() and None)
    yield bad("a value", lambda r: r[k].__setitem__(n, r[k][n] * 1.01))
    yield bad("an integer off by one", lambda r: r[k].__setitem__(n + 2, r[k][n + 2] + 1))
    yield bad("two values exchanged", lambda r: (r[k].__setitem__(n, rows[j][n]), r[j].__setitem__(n, rows[k][n]))[0])
    yield bad("an empty value", lambda r: r[k].__setitem__(n, ""))
    yield bad("a value as a word", lambda r: r[k].__setitem__(n, "x"))
    yield bad("nan", lambda r: r[k].__setitem__(n, "nan"))
    yield bad("a decimal comma", lambda r: r[k].__setitem__(n, '"1,5"'))
    yield bad("hexadecimal", lambda r: r[k].__setitem__(n, "0x10"))
    yield bad("two columns exchanged", lambda r: [row.__setitem__(slice(n, n + 2), [row[n + 1], row[n]]) for row in r] and None)
    yield bad("a column missing", lambda r: "\n".join(",".join(x for i, x in enumerate(t.split(",")) if i != n) for t in text(head, r).split("\n")))
    yield bad("a column renamed", lambda r: text(head, r).replace(",v,", ",V,") if head else text(head, r).replace("u,v", "u,V"))
    yield bad("no head", lambda r: text(head, r).split("\n", 1)[1])
    yield bad("rows of another order of columns", lambda r: "\n".join(",".join(t.split(",")[::-1]) if i else t for i, t in enumerate(text(head, r).split("\n"))))
    yield bad("cut off", lambda r: text(head, r)[:-6])
    yield bad("two tables", lambda r: text(head, r) + text(head, [[*x[:n], 9, 9, 9] for x in r]))
    yield bad("another line commented out", lambda r: "\n".join("#" + t if i == k + 1 else t for i, t in enumerate(text(head, r).split("\n"))))
    if head:
        yield bad("a key changed", lambda r: r[k].__setitem__(0, r[k][0] + 100))
        yield bad("two keys exchanged", lambda r: (r[k].__setitem__(slice(0, n), rows[j][:n]), r[j].__setitem__(slice(0, n), rows[k][:n]))[0])
        yield bad("a key twice", lambda r: r[k].__setitem__(slice(0, n), rows[j][:n]))
        yield bad("keys without", lambda r: "\n".join(t.split(",", n)[-1] for t in text(head, r).split("\n")))
    else:
        yield bad("rows reversed", lambda r: r.reverse())
