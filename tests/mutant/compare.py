"""`compare`: of files in all formats, series, folders and tables."""


from . import formats, model
from .trial import Trial, forever


def of(verdict, fault, files, words, agrees=False, links=()):
    def script(at):
        for name, data in files.items():
            at.put(name, data)
        for make, old, new in links:
            make(at.folder / old, at.folder / new)
        return at.run(*words)

    return Trial(verdict, fault, script, agrees)


def pairs(draw):
    """The writers of the two sides, with what both hold."""
    for writer in formats.WRITERS:
        only = ("u", "w") if writer in (formats.medit, formats.csv_numbers, formats.csv_places) else None
        yield writer, writer, only
    yield formats.vtu, formats.vtk, None
    yield formats.xdmf, formats.vtu, None
    yield formats.msh, formats.pvtu, None


def meaning(fault, writer):
    """Can this format hold the fault?"""
    tables = (formats.csv_numbers, formats.csv_places)
    if writer in tables and fault in model.PLACES:
        return writer is formats.csv_places and fault in (
            model.point_moved, model.points_exchanged, model.scaled_mesh, model.moved_mesh, model.mirrored_mesh, model.turned_mesh)
    return writer is not formats.medit or fault not in (model.third_component, model.field_renamed, model.names_exchanged)


@forever
def files(draw, turn):
    """One file against another, of each format, for each fault and kind of cell."""
    kind = ("triangle", "quad", "tetra")[turn % 3]
    scale = (1.0, 1e-9, 1e200, 1e-200, 1e12)[turn % 5]
    for a, b, only in pairs(draw):
        good = model.result(draw, kind, 2 if kind == "tetra" else 3, scale=scale, only=only)
        left, name = a(good, "a")
        # Tables by number and Medit know points by their numbers alone.
        other = model.rounded(good, draw)
        if a not in (formats.csv_numbers,) and turn % 2:
            other = model.renumbered(other, draw)
        right, against = b(other, "b")
        words = ["compare", name, against]
        if turn % 4 == 3:
            words += ["--rtol", "1e-8"]
        what = f"compare, {a.__name__}" + (f" and {b.__name__}" if a is not b else "")
        yield of(what, "agrees", {**left, **right}, words, True)
        for fault in [*model.VALUES, *model.NAMES, *model.PLACES]:
            if not meaning(fault, b):
                continue
            bad = model.wrong(other, fault, draw)
            if bad is None:
                continue
            right, against = b(bad, "b")
            yield of(what, fault.__name__, {**left, **right}, ["compare", name, against, *words[3:]])


@forever
def series(draw, turn):
    writer = formats.OF_TIMES[turn % 3]
    other = formats.OF_TIMES[(turn // 3) % 3] if turn > 2 else writer
    times = [(0.1, 0.2, 0.3, 0.4), (0.0, 1e-9, 2e-9), (1.0, 2.0, 3.0, 5.0, 8.0)][(turn // 2) % 3]
    good = model.result(draw, ("triangle", "quad")[turn % 2], 3, times)
    left, name = writer(good, "a")
    twin = model.rounded(good, draw)
    if turn % 2:
        twin = model.renumbered(twin, draw)
    right, against = other(twin, "b")
    what = f"compare, series of {writer.__name__}" + (f" and {other.__name__}" if other is not writer else "")
    yield of(what, "agrees", {**left, **right}, ["compare", name, against], True)
    for fault in [*model.TIMES, *model.VALUES, *model.NAMES]:
        bad = model.wrong(twin, fault, draw)
        if bad is None:
            continue
        right, against = other(bad, "b")
        yield of(what, fault.__name__, {**left, **right}, ["compare", name, against])


@forever
def converted(draw, turn):
    """Binary formats, which the program writes itself."""
    suffix = formats.CONVERTED[turn % len(formats.CONVERTED)]
    kind = ("triangle", "tetra", "quad")[turn // 2 % 3]
    good = model.result(draw, kind, 2 if kind == "tetra" else 3)
    first, _ = formats.vtu(good, "a")
    twin = model.rounded(good, draw)

    def script(result, first=first, suffix=suffix):
        second, _ = formats.vtu(result, "c")

        def run(at):
            at.put_all({**first, **second})
            at.must("mesh", "convert", "a.vtu", "a" + suffix if suffix != ".vtu" else "b.vtu", "--lossy")
            at.must("mesh", "convert", "c.vtu", "d" + suffix, "--lossy")
            return at.run("compare", "a" + suffix if suffix != ".vtu" else "b.vtu", "d" + suffix)

        return run

    what = f"compare, {suffix[1:]} as the program writes it"
    yield Trial(what, "agrees", script(twin), True)
    for fault in draw.sample([*model.VALUES, *model.NAMES, *model.PLACES], 10):
        if suffix in (".exo", ".cgns", ".med") and fault in (model.cell_twice, model.corner_of_another):
            continue
        bad = model.wrong(twin, fault, draw)
        if bad is not None:
            yield Trial(what, fault.__name__, script(bad))
