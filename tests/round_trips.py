"""Writes each file of a folder in each format, and holds what other programs and we read from that against the original; run by hand:

    cargo build -p faceoff-mesh --example inspect
    target/python/bin/python3 tests/round_trips.py FOLDER [--kinds msh,vtu] [--only WORD] [--formats vtu,msh] [--jobs 2]
        [--inspect target/debug/examples/inspect] [--seconds 60] [--megabytes 4096]

VTK reads VTU, legacy VTK, VTKHDF and XDMF, Gmsh MSH, MED, Medit and UNV, VTK and Gmsh CGNS, netCDF4 Exodus, meshio Abaqus and
SU2, h5py the fields of MED; what a program has no cells for is compared with our own reading alone. What is compared: points, cells by kind, groups (name or number, size), fields (name,
components, least, largest, sum), with what we read from the original. What differs and is not said to be lost is wrong.
Prints each trip that is wrong, then a table by format: trips, equal, said (to be lost), alone (we read it, the other program fails),
refused, wrong.
"""

import argparse
import collections
import concurrent.futures
import json
import math
import pathlib
import resource
import subprocess
import sys
import tempfile

import corpus
import numpy as np

# Formats that keep the cells of sets, or sides, apart from their cells: cells of less than the highest dimension are none there.
SETS = ("e", "inp", "su2", "unv", "med", "cgns")


# The kinds of cells that UNV and CGNS share with other formats.
KNOWN = ("vertex", "line", "line3", "triangle", "triangle6", "quadrangle", "quadrangle8", "quadrangle9", "tetrahedron", "tetrahedron10",
         "hexahedron", "hexahedron20", "hexahedron27", "prism", "prism15", "prism18", "pyramid", "pyramid13", "pyramid14")


def of_exodus(path):
    """Blocks, sets and fields by netCDF4."""
    import netCDF4

    with netCDF4.Dataset(path) as file:
        file.set_auto_mask(False)

        def names(key):
            rows = netCDF4.chartostring(file[key][:]) if key in file.variables else []
            return [str(row).rstrip("\0 ") for row in rows]

        size = {name: len(dimension) for name, dimension in file.dimensions.items()}
        cells, groups, fields = collections.Counter(), [], {}
        shapes = {"CIR": "vertex", "SPH": "vertex", "BAR": "line", "TRU": "line", "BEA": "line", "TRI": "triangle", "QUA": "quadrangle", "SHE": "quadrangle",
                  "TET": "tetrahedron", "HEX": "hexahedron", "WED": "prism", "PYR": "pyramid"}
        for k in range(1, size.get("num_el_blk", 0) + 1):
            block = file[f"connect{k}"]
            shape = shapes.get(block.elem_type[:3].upper(), block.elem_type)
            cells[corpus.kind(shape, block.shape[1])] += block.shape[0]
        for word, per in (("eb", "num_el_in_blk"), ("ss", "num_side_ss"), ("ns", "num_nod_ns"), ("els", "num_ele_els")):
            ids = file[f"{word}_prop1"][:] if f"{word}_prop1" in file.variables else []
            named = names(f"{word}_names")
            for k, tag in enumerate(ids, start=1):
                groups.append([named[k - 1] if k <= len(named) and named[k - 1] else str(tag), size.get(f"{per}{k}", 0)])
        for k, name in enumerate(names("name_nod_var"), start=1):
            fields[f"points {name}"] = [1, *corpus.spread(file[f"vals_nod_var{k}"][0])]
        for k, name in enumerate(names("name_elem_var"), start=1):
            parts = [file[f"vals_elem_var{k}eb{b}"][0] for b in range(1, size["num_el_blk"] + 1) if f"vals_elem_var{k}eb{b}" in file.variables]
            fields[f"cells {name}"] = [1, *corpus.spread(np.concatenate(parts))]
    return {"points": size["num_nodes"], "cells": dict(cells), "fields": fields, "groups": groups}


def of_med(path):
    """The fields by h5py, the rest by Gmsh."""
    import h5py

    told = corpus.with_gmsh(path)
    with h5py.File(path) as file:
        for name, field in file.get("CHA", {}).items():
            parts = collections.defaultdict(list)
            for support, profiles in field[min(field)].items():
                on = "points" if support == "NOE" else "cell points" if support.startswith("NOE.") else "cells"
                parts[on] += [profile["CO"][:] for profile in profiles.values() if hasattr(profile, "keys")]
            for on, values in parts.items():
                told["fields"][f"{on} {name}"] = [int(field.attrs["NCO"]), *corpus.spread(np.concatenate(values))]
    return told


def of_vtk(path):
    """Groups are an array on cells, as meshio and we write it."""
    told = corpus.with_vtk(path)
    # What another format has as numbers of groups is a field here.
    told["fields"] |= {f"cells {name}": corpus.totals(of) for name, of in told["labels"].items()}
    told["fields"] = {name: values for name, values in told["fields"].items() if not name.startswith(("cells gmsh:", "cells faceoff:"))}
    return told


def of_cgns(path):
    """By VTK, which makes empty cells of pyramids of 13 nodes and leaves out vertices."""
    told = of_vtk(path)
    told["knows"] = [kind for kind in KNOWN if kind not in ("vertex", "pyramid13")]
    return told


def of_gmsh(path):
    told = corpus.with_gmsh(path)
    if not path.endswith(".msh"):
        told["fields"] = {}
    return told


def of_unv(path):
    """By Gmsh, which neither reads nor writes pyramids and vertices, and has a group for each property."""
    import gmsh

    told = corpus.with_gmsh(path)
    told["fields"], told["groups"] = {}, []
    told["knows"] = [kind for kind in KNOWN if kind not in ("vertex", "pyramid", "pyramid13")]
    # Of several orders in an entity its interface shows one.
    out = path + ".msh"
    gmsh.option.setNumber("Mesh.SaveAll", 1)
    gmsh.option.setNumber("Mesh.MshFileVersion", 2.2)
    gmsh.write(out)
    told["cells"] = collections.Counter()
    for row in pathlib.Path(out).read_text().split("$Elements\n")[1].split("$EndElements")[0].splitlines()[1:]:
        name, _, _, nodes = gmsh.model.mesh.getElementProperties(int(row.split()[1]))[:4]
        shape = name.split()[0].lower()
        told["cells"][corpus.kind(corpus.GMSH.get(shape, shape), nodes)] += 1
    return told


def of_medit(path):
    """By Gmsh, which knows no other cells of Medit's."""
    told = of_gmsh(path)
    told["knows"] = ("vertex", "line", "line3", "triangle", "triangle6", "quadrangle", "tetrahedron", "tetrahedron10", "hexahedron")
    return told


def of_meshio(path):
    told = corpus.with_meshio(path)
    told["fields"] = {}  # of formats of meshes alone
    told["groups"] = [] if path.endswith(".inp") else told["groups"]  # it has no surfaces
    return told


FORMATS = {"vtu": [of_vtk], "vtk": [of_vtk], "vtkhdf": [of_vtk], "xdmf": [of_vtk], "msh": [of_gmsh], "e": [of_exodus], "med": [of_med],
           "cgns": [of_cgns, of_gmsh], "mesh": [of_medit], "meshb": [], "unv": [of_unv], "inp": [of_meshio], "su2": [of_meshio], "vtp": [of_vtk]}


def first_times(fields):
    """Each field at the first of its times."""
    kept = {}
    for field in fields:
        key = f"{field['on']} {field['name']}"
        if key not in kept or (field["time"] or 0) < (kept[key]["time"] or 0):
            kept[key] = field
    return kept


def joined(fields, name):
    """The components of a vector in formats of scalars, as one."""
    parts = [fields[f"{name}_{axis}"] for axis in "xyz" if f"{name}_{axis}" in fields]
    return parts and [len(parts), min(part[1] for part in parts), max(part[2] for part in parts), sum(part[3] for part in parts)]


def dimension(kind):
    shape = kind.rstrip("0123456789").rsplit("-", 1)[-1]
    return 0 if shape == "vertex" else 1 if shape == "line" else 2 if shape in ("triangle", "quadrangle", "polygon") else 3


def differences(before, after, lost, suffix, ours):
    """What a reader of a written file sees otherwise than we do in the original, but for what is said to be lost."""
    said = " ".join(lost)
    cells = {name: count for name, count in before["cells"].items() if count}
    seen = {name: count for name, count in after["cells"].items() if count}
    if suffix in SETS and not ours:
        top = max(map(dimension, cells), default=0)
        cells, seen = ({name: count for name, count in some.items() if dimension(name) == top} for some in (cells, seen))
    known = after.get("knows", cells)
    if not cells.keys() <= set(known):
        return  # it sees a part alone
    without_cells = any("does not hold" in what and " cells" in what and "several groups" not in what for what in lost)
    # Gmsh leaves out the points of no cell but vertices.
    least = before["points"] if ours else 0 if without_cells else before["used"] - before["cells"].get("vertex", 0)
    if after["points"] is not None and not least <= after["points"] <= before["points"]:
        yield f"points {before['points']}, then {after['points']}"
    if cells != seen and not without_cells and not any(words in said for words in OF_CELLS):
        yield f"cells {cells}, then {seen}"
    if ours:
        fields, found = first_times(before["fields"]), first_times(after["fields"])
        fields = {name: [f["components"], f["min"], f["max"], f["sum"]] for name, f in fields.items()}
        found = {name: [f["components"], f["min"], f["max"], f["sum"]] for name, f in found.items()}
    else:
        fields = {name: [f["components"], f["min"], f["max"], f["sum"]] for name, f in first_times(before["fields"]).items()}
        found = {name: values and values[:4] for name, values in after["fields"].items()}
    for name, values in fields.items():
        if json.dumps(name.split(" ", 1)[1], ensure_ascii=False) in said or name.startswith("cell points "):
            continue
        if without_cells and name.startswith("cells "):
            continue
        other = found.get(name) or (None if ours else joined(found, name))
        if not other:
            if ours or found or suffix in ("vtu", "vtk", "vtkhdf", "xdmf", "e", "med", "msh"):
                yield f"no field on {name}"
        elif other[0] != values[0]:
            yield f"{values[0]} components of {name}, then {other[0]}"
        else:
            a, b = ([x if isinstance(x, int | float) and math.isfinite(x) else None for x in row[1:]] for row in (values, other))
            scale = max((abs(x) for x in a if x is not None), default=0)
            if any((x is None) != (y is None) or (x is not None and abs(x - y) > 1e-5 * scale) for x, y in zip(a, b, strict=True)):
                yield f"{name} has {values[1:]}, then {other[1:]}"
    if ours:
        for name in found.keys() - fields.keys():
            if any(name.startswith(f"{other}_") and json.dumps(other.split(" ", 1)[1], ensure_ascii=False) in said for other in fields):
                continue
            if json.dumps(name.split(" ", 1)[1], ensure_ascii=False) in said or name == "points label" and "become labels of their points" in said:
                continue
            yield f"a field on {name} that was not there"
    if not without_cells:
        yield from groups_apart(before["groups"], after["groups"], said, ours)


# What is said of cells that come back in fewer.
OF_CELLS = ("become one with them", "become labels of their points")
# What is said of groups without a name of one.
OF_GROUPS = ("in several groups", "groups that are not sides", "groups whose number is 0", "groups that are negative", "groups together with such cells", "whose number is not")


def groups_apart(before, after, said, ours):
    """Groups that have a name keep it and their size, others the size, and none comes from nowhere."""
    if any(words in said for words in OF_GROUPS) or not (ours or after):
        return
    before = [g for g in before if (g["dim"] or "become labels" not in said) and (g["cells"] or (ours and "without cells" not in said and "no cells" not in said))]
    after = [(str(g["name"] or g["tag"]), g["cells"]) if ours else tuple(g) for g in after]
    is_named = [g["name"] and g["name"] not in said for g in before]
    named = collections.Counter((g["name"], g["cells"]) for g, kept in zip(before, is_named, strict=True) if kept)
    others = collections.Counter(g["cells"] for g, kept in zip(before, is_named, strict=True) if not kept)
    now = collections.Counter(after)
    for name, size in named - now:
        yield f"no group {name!r} of {size}, but {[row for row in after if name in row[0]][:3]}"
    rest = collections.Counter()
    for (_, size), count in (now - named).items():
        rest[size] += count
    lost = [g for g, kept in zip(before, is_named, strict=True) if not kept and not g["name"] and rest[g["cells"]] < 1]
    for group in lost:
        yield f"no group {group['tag']} of {group['cells']}"
    if ours and "are groups when they are read again" not in said:
        for size in rest - others:
            yield f"a group of {size} that was not there"


def trips(path, args):
    """Of one file: a row for each format, of how it went and what is wrong."""
    def limit():
        resource.setrlimit(resource.RLIMIT_AS, (args.megabytes << 20,) * 2)

    told = []
    with tempfile.TemporaryDirectory() as folder:
        outs = {suffix: f"{folder}/{suffix}/out.{suffix}" for suffix in args.formats}
        for out in outs.values():
            pathlib.Path(out).parent.mkdir()
        try:
            command = [args.inspect, path, "--as", *outs.values()]
            run = subprocess.run(command, check=False, capture_output=True, timeout=args.seconds, preexec_fn=limit)
            before = json.loads(run.stdout)
        except subprocess.TimeoutExpired:
            return [("all", "wrong", ["out of time"])]
        except ValueError:
            return [("all", "wrong", [f"PANIC OR ABORT ({run.returncode}): {run.stderr.decode(errors='replace')[-300:]}"])]
        if "error" in before:
            return []
        for suffix, out in outs.items():
            made = before["written"][out]
            if "error" in made:
                told.append((suffix, "refused", [made["error"].replace(folder, "")]))
                continue
            if "error" in made["again"]:
                told.append((suffix, "wrong", [f"ours: {made['again']['error'].replace(folder, '')}"]))
                continue
            alone = None
            wrong = [f"ours: {what}" for what in differences(before, made["again"], made["lost"], suffix, True)]
            for read in FORMATS[suffix]:
                seen = corpus.apart(read, out, args)
                name = read.__name__[3:]
                if isinstance(seen, str):
                    alone = f"{name} fails: {seen}".replace(folder, "")
                else:
                    wrong += [f"{name}: {what}" for what in differences(before, seen, made["lost"], suffix, False)]
            lost = [what for what in made["lost"] if "does not hold" in what]
            how = "wrong" if wrong else "alone" if alone else "said" if lost else "equal"
            told.append((suffix, how, wrong + made["lost"] if wrong else [alone]))
    return told


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--kinds", default="")
    parser.add_argument("--only", default="")
    parser.add_argument("--formats", type=lambda text: text.split(","), default=list(FORMATS))
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--inspect", default="target/debug/examples/inspect")
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--megabytes", type=int, default=4096)
    parser.add_argument("--refused", action="store_true", help="print what is refused, or alone, too")
    args = parser.parse_args()
    import gmsh  # noqa: F401  imported once, before the processes divide
    import h5py  # noqa: F401
    import meshio  # noqa: F401
    import netCDF4  # noqa: F401
    import vtk  # noqa: F401
    from vtk.util import numpy_support  # noqa: F401

    kinds = set(filter(None, args.kinds.split(",")))
    files = sorted(p for p in args.folder.rglob("*") if p.is_file())
    files = [p for p in files if args.only in str(p) and (not kinds or p.suffix.lower().lstrip(".") in kinds)]
    rows = collections.defaultdict(collections.Counter)
    with concurrent.futures.ProcessPoolExecutor(args.jobs) as pool:
        for path, told in zip(files, pool.map(trips, map(str, files), [args] * len(files)), strict=True):
            for suffix, how, what in told:
                rows[suffix]["trips"] += 1
                rows[suffix][how] += 1
                if how == "wrong" or (how in ("refused", "alone") and args.refused):
                    print(f"{path.relative_to(args.folder)} as {suffix}: {how}\n    " + "\n    ".join(what[:8]), flush=True)
    columns = ["trips", "equal", "said", "alone", "refused", "wrong"]
    print(f"\n{'format':8}" + "".join(f"{column:>9}" for column in columns))
    for suffix, row in rows.items():
        print(f"{suffix:8}" + "".join(f"{row[column]:9}" for column in columns))
    return 1 if any(row["wrong"] for row in rows.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
