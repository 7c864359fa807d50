"""A result as a code has it: points, cells, fields, times. And what can be wrong with one: each function here takes a good
result and returns a wrong one, or None where the fault has no meaning."""

import copy
import math
from dataclasses import dataclass, field

SIDES = {"triangle": 3, "quad": 4, "tetra": 4}


@dataclass
class Field:
    name: str
    on: str  # points or cells
    values: list  # one tuple per point or cell
    whole: bool = False  # integers


@dataclass
class Model:
    points: list
    cells: list  # (type, numbers)
    steps: list = field(default_factory=list)  # (time, fields)

    @property
    def fields(self):
        return self.steps[-1][1]

    def size(self, on):
        return len(self.points) if on == "points" else len(self.cells)


def value(draw, place, k, t):
    """Smooth, not linear, nowhere 0, and no two alike."""
    x, y, z = place
    return 1.5 + math.sin(2.1 * x + 1.3 * y - 0.7 * z + k + t) + 0.3 * math.cos(3 * x * y + k) + 0.01 * draw.random()


def centre(model, cell):
    places = [model.points[v] for v in cell[1]]
    return tuple(sum(p[i] for p in places) / len(places) for i in range(3))


def grid(kind, n):
    """A square of n × n, of triangles or quadrangles, or a cube of tetrahedra."""
    if kind == "tetra":
        points = [(i / n, j / n, k / n) for k in range(n + 1) for j in range(n + 1) for i in range(n + 1)]
        cells = []
        for k in range(n):
            for j in range(n):
                for i in range(n):
                    for path in ((1, 2, 4), (1, 4, 2), (2, 1, 4), (2, 4, 1), (4, 1, 2), (4, 2, 1)):
                        corners = [0]
                        for step in path:
                            corners.append(corners[-1] | step)
                        cells.append(("tetra", [
                            i + (c & 1) + (n + 1) * (j + (c >> 1 & 1)) + (n + 1) ** 2 * (k + (c >> 2)) for c in corners
                        ]))
        return points, cells
    points = [(i / n, j / n, 0.0) for j in range(n + 1) for i in range(n + 1)]
    cells = []
    for j in range(n):
        for i in range(n):
            a = i + (n + 1) * j
            b, c, d = a + 1, a + n + 2, a + n + 1
            cells += [("quad", [a, b, c, d])] if kind == "quad" else [("triangle", [a, b, c]), ("triangle", [a, c, d])]
    return points, cells


def result(draw, kind="triangle", n=3, times=(None,), scale=1.0, only=None):
    points, cells = grid(kind, n)
    model = Model(points, cells)
    dim = 3 if kind == "tetra" else 2
    for t in times:
        fields = []
        for name, on, width in (("u", "points", 1), ("w", "points", 3), ("p", "cells", 1), ("q", "cells", 3)):
            if only and name not in only:
                continue
            places = model.points if on == "points" else [centre(model, cell) for cell in model.cells]
            values = []
            for place in places:
                parts = [scale * value(draw, place, 2 * k + len(name + on), t or 0.0) for k in range(width)]
                values.append(tuple(parts[:dim] + [0.0] * (width - dim) if width == 3 else parts))
            fields.append(Field(name, on, values))
        model.steps.append((t, fields))
    return model


# ---- The same result, written another way --------------------------------------------------------------------------------


def rounded(model, draw):
    model = copy.deepcopy(model)
    for _, fields in model.steps:
        for f in fields:
            if not f.whole:
                f.values = [tuple(v * (1 + draw.uniform(-1, 1) * 1e-13) for v in row) for row in f.values]
    return model


def renumbered(model, draw):
    """Points and cells in another order."""
    points, cells = (draw.sample(range(k), k) for k in (len(model.points), len(model.cells)))
    place = {old: new for new, old in enumerate(points)}
    moved = Model([model.points[k] for k in points], [(model.cells[k][0], [place[v] for v in model.cells[k][1]]) for k in cells])
    for t, fields in model.steps:
        order = {"points": points, "cells": cells}
        moved.steps.append((t, [Field(f.name, f.on, [f.values[k] for k in order[f.on]], f.whole) for f in fields]))
    return moved


# ---- Faults of values ---------------------------------------------------------------------------------------------------


def pick(model, draw, test=lambda f: True):
    """A field of any time, and one of its rows."""
    some = [f for _, fields in model.steps for f in fields if test(f)]
    if not some:
        return None, None
    f = draw.choice(some)
    return f, draw.randrange(len(f.values))


def put(f, k, values):
    f.values[k] = tuple(values)


def component(f, draw):
    """One that is not 0 everywhere: not the third in the plane, which some formats do not have."""
    return draw.choice([i for i in range(len(f.values[0])) if any(row[i] for row in f.values)])


def largest(f):
    return max(abs(v) for row in f.values for v in row)


def one_value(model, draw):
    f, k = pick(model, draw)
    row = list(f.values[k])
    i, factor = component(f, draw), draw.choice([1 + 1e-6, 1 - 1e-6, 1.001, 2, 10, 1e3, 0, 0.5, -1])
    # A factor changes no 0.
    row[i] = row[i] * factor or (0 if row[i] else 1e-3 * largest(f))
    put(f, k, row)


def one_value_by_little(model, draw):
    f, k = pick(model, draw)
    row = list(f.values[k])
    row[component(f, draw)] += 2e-8 * largest(f) * draw.choice([1, -1])
    put(f, k, row)


def sign_of_all(model, draw):
    f, _ = pick(model, draw)
    f.values = [tuple(-v for v in row) for row in f.values]


def sign_of_one(model, draw):
    f, k = pick(model, draw)
    put(f, k, [-v for v in f.values[k]])


def factor(model, draw):
    f, _ = pick(model, draw)
    by = draw.choice([1000, 0.001, 0.3048, 180 / math.pi, 2, 0.5, 1 + 1e-7, math.sqrt(2)])
    f.values = [tuple(by * v for v in row) for row in f.values]


def constant_added(model, draw):
    f, _ = pick(model, draw)
    more = largest(f) * draw.choice([1, 1e-3, 1e-7])
    f.values = [tuple(v + more for v in row) for row in f.values]


def two_exchanged(model, draw):
    f, k = pick(model, draw)
    j = draw.choice([j for j in range(len(f.values)) if f.values[j] != f.values[k]])
    f.values[k], f.values[j] = f.values[j], f.values[k]


def shifted_by_one(model, draw):
    f, _ = pick(model, draw)
    f.values = f.values[1:] + f.values[:1]


def reversed_order(model, draw):
    f, _ = pick(model, draw)
    f.values = f.values[::-1]


def of_the_last(model, draw):
    f, k = pick(model, draw)
    # One that is not equal to it already, as 0 and 0.
    k = next((i for i in [*range(k, len(f.values)), *range(k)] if f.values[i] != f.values[i - 1]), k)
    put(f, k, f.values[k - 1])


def all_the_mean(model, draw):
    f, _ = pick(model, draw)
    mean = [sum(row[i] for row in f.values) / len(f.values) for i in range(len(f.values[0]))]
    f.values = [tuple(mean) for _ in f.values]


def all_zero(model, draw):
    f, _ = pick(model, draw)
    f.values = [tuple(0.0 for _ in row) for row in f.values]


def nan(model, draw):
    f, k = pick(model, draw)
    row = list(f.values[k])
    row[component(f, draw)] = draw.choice([math.nan, math.inf, -math.inf])
    put(f, k, row)


def components_swapped(model, draw):
    f, _ = pick(model, draw, lambda f: len(f.values[0]) > 1)
    if f is None:
        return False
    f.values = [(row[1], row[0], *row[2:]) for row in f.values]


def turned(model, draw):
    """The magnitude is what it was."""
    f, _ = pick(model, draw, lambda f: len(f.values[0]) > 1)
    if f is None:
        return False
    f.values = [(-row[1], row[0], *row[2:]) for row in f.values]


def third_component(model, draw):
    f, _ = pick(model, draw, lambda f: len(f.values[0]) == 3)
    if f is None:
        return False
    more = largest(f)
    f.values = [(row[0], row[1], row[2] + more) for row in f.values]


# ---- Faults of names, places and times -------------------------------------------------------------------------------------


def each_step(model, change):
    for step in range(len(model.steps)):
        t, fields = model.steps[step]
        model.steps[step] = (t, change(fields))


def field_missing(model, draw):
    if len(model.fields) < 2:
        return False
    gone = draw.choice(model.fields).name
    each_step(model, lambda fields: [f for f in fields if f.name != gone])


def field_extra(model, draw):
    each_step(model, lambda fields: [*fields, Field("extra", fields[0].on, copy.deepcopy(fields[0].values))])


def field_renamed(model, draw):
    old = draw.choice(model.fields).name
    new = draw.choice([old.upper(), old + "_", "x" + old, old + "h"])
    for _, fields in model.steps:
        for f in fields:
            f.name = new if f.name == old else f.name


def names_exchanged(model, draw):
    pairs = [(a, b) for a in model.fields for b in model.fields
             if a.name < b.name and a.on == b.on and len(a.values[0]) == len(b.values[0])]
    if not pairs:
        return False
    a, b = (f.name for f in draw.choice(pairs))
    for _, fields in model.steps:
        for f in fields:
            f.name = {a: b, b: a}.get(f.name, f.name)


def point_moved(model, draw):
    k = draw.randrange(len(model.points))
    x, y, z = model.points[k]
    model.points[k] = (x + draw.choice([1e-3, -1e-3, 1e-5]), y + 1e-3, z)


def points_exchanged(model, draw):
    k, j = draw.sample(range(len(model.points)), 2)
    model.points[k], model.points[j] = model.points[j], model.points[k]


def scaled_mesh(model, draw):
    by = draw.choice([1000, 0.001, 0.0254, 1.0001])
    model.points = [tuple(by * x for x in p) for p in model.points]


def moved_mesh(model, draw):
    by = draw.choice([1, 1e-3, -0.5])
    model.points = [(p[0] + by, *p[1:]) for p in model.points]


def mirrored_mesh(model, draw):
    model.points = [(1 - x, y, z) for x, y, z in model.points]


def turned_mesh(model, draw):
    model.points = [(y, x, z) for x, y, z in model.points]


def cell_missing(model, draw):
    k = draw.randrange(len(model.cells))
    del model.cells[k]
    for _, fields in model.steps:
        for f in fields:
            if f.on == "cells":
                del f.values[k]


def cell_twice(model, draw):
    k = draw.randrange(len(model.cells))
    model.cells.append(model.cells[k])
    for _, fields in model.steps:
        for f in fields:
            if f.on == "cells":
                f.values.append(tuple(2 * v for v in f.values[k]))


def cells_exchanged(model, draw):
    if all(f.on == "points" for f in model.fields):
        return False
    k, j = draw.sample(range(len(model.cells)), 2)
    model.cells[k], model.cells[j] = model.cells[j], model.cells[k]


def edge_turned(model, draw):
    """The other diagonal of a quadrangle: the same values, another function."""
    if model.cells[0][0] != "triangle":
        return False
    shared = []
    for i, (_, a) in enumerate(model.cells):
        for j, (_, b) in enumerate(model.cells[:i]):
            both = sorted(set(a) & set(b))
            if len(both) == 2:
                p, q = (set(a) - set(both)).pop(), (set(b) - set(both)).pop()
                xs = [model.points[v] for v in (p, both[0], q, both[1])]
                # The diagonal of the square alone: where the two make a quadrangle that is convex.
                if abs(xs[0][0] - xs[2][0]) == abs(xs[0][1] - xs[2][1]) and abs(xs[1][0] - xs[3][0]) == abs(xs[1][1] - xs[3][1]):
                    shared.append((i, j, p, q, both))
    if not shared:
        return False
    i, j, p, q, (r, s) = draw.choice(shared)
    model.cells[i], model.cells[j] = ("triangle", [p, q, r]), ("triangle", [p, q, s])


def quads_cut(model, draw):
    if model.cells[0][0] != "quad":
        return False
    order, cells = [], []
    for k, (_, (a, b, c, d)) in enumerate(model.cells):
        cells += [("triangle", [a, b, c]), ("triangle", [a, c, d])]
        order += [k, k]
    model.cells = cells
    if all(f.on == "cells" for f in model.fields):
        return False
    for _, fields in model.steps:
        for f in fields:
            if f.on == "cells":
                f.values = [f.values[k] for k in order]


def corner_of_another(model, draw):
    k = draw.randrange(len(model.cells))
    kind, numbers = model.cells[k]
    others = [v for v in range(len(model.points)) if v not in numbers]
    numbers = list(numbers)
    numbers[draw.randrange(len(numbers))] = draw.choice(others)
    model.cells[k] = (kind, numbers)


def time_changed(model, draw):
    k = draw.randrange(len(model.steps))
    t, fields = model.steps[k]
    if t is None:
        return False
    model.steps[k] = (t + 0.013, fields)


def times_scaled(model, draw):
    if model.steps[0][0] is None:
        return False
    model.steps = [(t * 1000 + 1, fields) for t, fields in model.steps]


def step_missing(model, draw):
    if len(model.steps) < 2:
        return False
    del model.steps[draw.randrange(len(model.steps))]


def step_extra(model, draw):
    if len(model.steps) < 2:
        return False
    model.steps.append((model.steps[-1][0] + 1, copy.deepcopy(model.steps[-1][1])))


def steps_exchanged(model, draw):
    if len(model.steps) < 2:
        return False
    k, j = draw.sample(range(len(model.steps)), 2)
    (t, a), (s, b) = model.steps[k], model.steps[j]
    model.steps[k], model.steps[j] = (t, b), (s, a)


def step_of_the_last(model, draw):
    if len(model.steps) < 2:
        return False
    k = draw.randrange(1, len(model.steps))
    model.steps[k] = (model.steps[k][0], copy.deepcopy(model.steps[k - 1][1]))


def field_missing_at_a_time(model, draw):
    if len(model.steps) < 2 or len(model.fields) < 2:
        return False
    k = draw.randrange(len(model.steps))
    t, fields = model.steps[k]
    gone = draw.randrange(len(fields))
    model.steps[k] = (t, fields[:gone] + fields[gone + 1:])


VALUES = [
    one_value, one_value_by_little, sign_of_all, sign_of_one, factor, constant_added, two_exchanged, shifted_by_one,
    reversed_order, of_the_last, all_the_mean, all_zero, nan, components_swapped, turned, third_component,
]
NAMES = [field_missing, field_extra, field_renamed, names_exchanged]
PLACES = [
    point_moved, points_exchanged, scaled_mesh, moved_mesh, mirrored_mesh, turned_mesh, cell_missing, cell_twice,
    cells_exchanged, edge_turned, quads_cut, corner_of_another,
]
TIMES = [
    time_changed, times_scaled, step_missing, step_extra, steps_exchanged, step_of_the_last, field_missing_at_a_time,
]


def wrong(model, fault, draw):
    """A copy with the fault, or None where it has no meaning for this model."""
    model = copy.deepcopy(model)
    return None if fault(model, draw) is False else model
