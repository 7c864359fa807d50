"""Holds our reader against VTK, meshio and Gmsh on a folder of files; run by hand:

    cargo build -p faceoff-mesh --example inspect
    target/python/bin/python3 tests/corpus.py FOLDER [--manifest FILES.csv] [--kinds vtk,vtu] [--only WORD]
        [--inspect target/debug/examples/inspect] [--readers vtk,meshio,gmsh] [--seconds 60] [--megabytes 4096]

Each reader has a process, a time and a memory of its own for each file. What is compared: the number of points, the
cells by kind (strips as what they consist of; sides and nodes of sets, which are cells with us alone, if they are in
groups), the fields (name, components, least, largest, sum), the groups (name or number, size), and the numbers that
another reader has for its groups as an array on cells. A foreign reader's field or group that we lack is a difference
unless we say in words that it is unread. Prints each file that differs with what, and why where the reason is known to
be the other reader's (REASONS), then a table by kind: of the files that another reads ("any"), those that we read, those
that are equal for all who read them, those where all differences have such a reason, and the rest. A manifest has the
files' paths in its first column, below FOLDER.
"""

import argparse
import collections
import json
import math
import os
import pathlib
import re
import resource
import signal
import subprocess
import sys
import urllib.parse

SHAPES = ["vertex", "line", "triangle", "quadrangle", "tetrahedron", "hexahedron", "prism", "pyramid", "polygon", "polyhedron"]
CORNERS = dict(zip(SHAPES, (1, 2, 3, 4, 4, 8, 6, 5, 0, 0), strict=True))
# VTK's types by number: those that others have as well, and those that only VTK has.
VTK = {1: "vertex", 3: "line", 5: "triangle", 8: "quadrangle", 9: "quadrangle", 10: "tetrahedron", 11: "hexahedron",
       12: "hexahedron", 13: "prism", 14: "pyramid", 21: "line", 22: "triangle", 23: "quadrangle", 24: "tetrahedron",
       25: "hexahedron", 26: "prism", 27: "pyramid", 28: "quadrangle", 29: "hexahedron", 32: "prism", 35: "line", 42: "polyhedron"}
ONLY_VTK = {15: "pentagonal-prism", 16: "hexagonal-prism", 30: "quadratic-linear-quadrangle", 31: "quadratic-linear-prism",
            33: "biquadratic-quadratic-hexahedron", 34: "biquadratic-triangle", 36: "quadratic-polygon",
            37: "triquadratic-pyramid", 41: "convex-point-set"}
LAGRANGE = ("line", "triangle", "quadrangle", "tetrahedron", "hexahedron", "prism", "pyramid")
COMPLETE = {"line": {n + 1 for n in range(1, 11)}, "triangle": {(n + 1) * (n + 2) // 2 for n in range(1, 11)},
            "quadrangle": {(n + 1) ** 2 for n in range(1, 11)}, "tetrahedron": {(n + 1) * (n + 2) * (n + 3) // 6 for n in range(1, 11)},
            "hexahedron": {(n + 1) ** 3 for n in range(1, 10)}, "prism": {6, 18}, "pyramid": {5, 14}}
# What other readers call the numbers of groups on cells, and what is theirs alone.
LABELS = {"medit:ref", "su2:tag", "nastran:ref", "gmsh:physical", "Material Id", "ObjectId"}
THEIRS = {"gmsh:dim_tags", "gmsh:geometrical", "cell_tags", "point_tags"}
# Where another reader is known to differ from the file: which one, in which files, in what, and why.
REASONS = [
    ("gmsh", r"\.unv$", "no group '\\d+'", "Gmsh has no group of UNV (2467), and makes one of all cells of a property"),
    ("gmsh", r"MSub\w+_input\.msh$", "cells|no group", "these are parts of cells to Gmsh, of an element's type without nodes"),
    ("gmsh", r"(mesh[23]d_p\d_v2|unitsquare_quads_2x2|input\.2|first_timestep_adapted_mesh)\.msh$", "no group", "Gmsh has groups of entities in MSH 2: all cells of one are in all groups that a cell of it has"),
    ("gmsh", r"(centerlinesAORTA|vtk-data/Data/vtk)\.vtk$", "points|cells|no group", "Gmsh takes lines for centrelines, and leaves some out"),
    ("vtk", r"(EDGE4|PRISM20|TET14)\.e$", "cells", "VTK takes the corners alone"),
    ("gmsh", r"sqnz_s\.adf\.cgns$", "points|no field", "Gmsh merges the points of zones, and numbers solutions"),
    ("meshio", r"(mesh_cht_3cyl|single_stage/mesh)\.su2$", "points|cells", "meshio reads one zone of several"),
]
MESHIO = {"quad": "quadrangle", "tetra": "tetrahedron", "wedge": "prism"}
GMSH = {"point": "vertex", "quadrilateral": "quadrangle"}


def kind(shape, points):
    return shape if points == CORNERS.get(shape) else f"{shape}{points}"


def vtk_kind(code, points):
    if code in VTK:
        return kind(VTK[code], points)
    if 68 <= code <= 81:
        family, shape = divmod(code - 68, 7)
        shape = LAGRANGE[shape]
        if (family == 0 and points in COMPLETE[shape]) or points == CORNERS[shape]:
            return kind(shape, points)
        return f"{('lagrange', 'bezier')[family]}-{shape}{points}"
    return f"{ONLY_VTK.get(code, f'vtk type {code}, ')}{points}"


def spread(values):
    """Least, largest, sum of the finite values and of their magnitudes, and how many."""
    import numpy as np

    values = np.asarray(values, dtype=float).ravel()
    values = values[np.isfinite(values)]
    if not values.size:
        return [math.inf, -math.inf, 0.0, 0.0]
    return [values.min(), values.max(), values.sum(), abs(values).sum()]


def count(labels, name, values):
    """Adds how often each number of an array of labels is there."""
    import numpy as np

    of = labels.setdefault(name, {})
    for number, times in zip(*np.unique(np.asarray(values).ravel().astype(int), return_counts=True), strict=True):
        of[str(number)] = of.get(str(number), 0) + int(times)


def vtk_reader(path):
    import vtk

    with open(path, "rb") as file:
        head = file.read(4096)
    suffix = pathlib.Path(path).suffix.lower()
    xml = re.search(rb"<VTKFile[^>]*?\stype\s*=\s*[\"'](\w+)", head)
    if xml:
        return getattr(vtk, f"vtkXML{xml[1].decode()}Reader")()
    if head.startswith(b"# vtk DataFile"):
        reader = vtk.vtkGenericDataObjectReader()
        for what in ("Scalars", "Vectors", "Normals", "Tensors", "TCoords", "Fields", "ColorScalars"):
            getattr(reader, f"ReadAll{what}On")()
        return reader
    if suffix in (".e", ".exo", ".ex2", ".g", ".gen"):
        reader = vtk.vtkExodusIIReader()
        reader.SetFileName(path)
        reader.UpdateInformation()
        for which in range(25):
            for k in range(reader.GetNumberOfObjectArrays(which)):
                reader.SetObjectArrayStatus(which, reader.GetObjectArrayName(which, k), 1)
        return reader
    by = {".xdmf": "Xdmf", ".cgns": "CGNS", ".vtkhdf": "HDF", ".hdf": "HDF", ".inp": "AVSucd", ".stl": "STL", ".ply": "PLY", ".obj": "OBJ"}
    return getattr(vtk, f"vtk{by[suffix]}Reader")()


def with_vtk(path):
    import numpy as np
    from vtk.util.numpy_support import vtk_to_numpy

    reader = vtk_reader(path)
    errors = []
    reader.AddObserver("ErrorEvent", lambda *_: errors.append("VTK reports an error"))
    reader.SetFileName(path)
    reader.Update()
    if errors or reader.GetErrorCode():
        raise ValueError(errors or "an error code")
    top = reader.GetOutputDataObject(0)
    leaves, composite = [top], top.IsA("vtkCompositeDataSet")
    if composite:
        walk = top.NewIterator()
        leaves = []
        while not walk.IsDoneWithTraversal():
            leaves.append(walk.GetCurrentDataObject())
            walk.GoToNextItem()
        composite = len(leaves) != 1
    cells, fields, labels, points, box = collections.Counter(), {}, {}, 0, None
    for grid in leaves:
        box = None if composite else [list(grid.GetBounds()[start::2]) for start in (0, 1)]
        points += grid.GetNumberOfPoints()
        repeat = []
        for i in range(grid.GetNumberOfCells()):
            code = grid.GetCellType(i)
            n = grid.GetCellSize(i) if grid.IsA("vtkPointSet") or grid.IsA("vtkUniformGrid") else grid.GetCell(i).GetNumberOfPoints()
            shape, parts = {2: ("vertex", n), 4: ("line", n - 1), 6: ("triangle", n - 2)}.get(code, (None, 1))
            if shape:
                cells[shape] += parts
            elif code == 7:
                cells[{3: "triangle", 4: "quadrangle"}.get(n, f"polygon{n}")] += 1
            else:
                cells[vtk_kind(code, n)] += 1
            repeat.append(parts)
        for on, data in (("points", grid.GetPointData()), ("cells", grid.GetCellData())):
            for k in range(data.GetNumberOfArrays()):
                array = data.GetArray(k)
                if array is None:  # texts
                    fields[f"{on} {data.GetAbstractArray(k).GetName()}"] = None
                    continue
                values = vtk_to_numpy(array).reshape(array.GetNumberOfTuples(), -1).astype(float)
                if on == "cells" and max(repeat, default=1) != 1:
                    values = np.repeat(values, repeat, axis=0)
                if on == "cells" and array.GetName() in LABELS:
                    count(labels, array.GetName(), values)
                elif not composite:
                    fields[f"{on} {array.GetName()}"] = [array.GetNumberOfComponents(), *spread(values)]
    return {"points": None if composite else points, "box": box, "cells": dict(cells), "fields": fields, "groups": [], "labels": labels}


def with_meshio(path):
    import meshio
    import numpy as np

    mesh = meshio.read(path)
    cells = collections.Counter()
    for block in mesh.cells:
        shape = re.sub(r"\d+$", "", block.type)
        nodes = len(block.data[0]) if len(block.data) else 0
        name = kind(MESHIO.get(shape, shape), nodes)
        cells[{"polygon3": "triangle", "polygon4": "quadrangle"}.get(name, name)] += len(block.data)
    fields, labels = {}, {}
    for name, values in mesh.point_data.items():
        if name == "medit:ref" and not values.any():
            continue
        name = "label" if name == "medit:ref" else name
        fields[f"points {name}"] = [int(values[0].size) if len(values) else 1, *spread(values)]
    for name, values in mesh.cell_data.items():
        if name in LABELS:
            count(labels, name, np.concatenate([np.asarray(v).ravel() for v in values]))
        else:
            whole = np.concatenate([np.asarray(v).ravel() for v in values]) if values else []
            fields[f"cells {name}"] = [int(len(whole) / max(1, sum(map(len, values)))), *spread(whole)]
    groups = [[name, sum(len(part) for part in parts if part is not None)] for name, parts in mesh.cell_sets.items()]
    groups += [[name, len(nodes)] for name, nodes in mesh.point_sets.items()]
    groups = [group for group in groups if not group[0].startswith("gmsh:")]
    return {"points": len(mesh.points), "cells": dict(cells), "fields": fields, "groups": groups, "labels": labels}


def with_gmsh(path):
    import gmsh

    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    # Otherwise it adds the cells between partitions.
    gmsh.option.setNumber("Mesh.PartitionCreateTopology", 0)
    gmsh.merge(path)
    mesh = gmsh.model.mesh
    cells, sizes, groups = collections.Counter(), {}, []
    for dim, entity in gmsh.model.getEntities():
        for code, tags, _ in zip(*mesh.getElements(dim, entity), strict=True):
            name, _, _, nodes = mesh.getElementProperties(code)[:4]
            shape = name.split()[0].lower()
            cells[kind(GMSH.get(shape, shape), nodes)] += len(tags)
            sizes[dim, entity] = sizes.get((dim, entity), 0) + len(tags)
    for dim, tag in gmsh.model.getPhysicalGroups():
        entities = gmsh.model.getEntitiesForPhysicalGroup(dim, tag)
        size = sum(sizes.get((dim, entity), 0) for entity in entities)
        groups.append([gmsh.model.getPhysicalName(dim, tag) or str(tag), size])
    fields = {}
    for view in gmsh.view.getTags():
        # Steps that a file does not have are there and empty.
        steps = range(int(gmsh.view.option.getNumber(view, "NbTimeStep")))
        where, _, values, _, components = next(
            (data for data in (gmsh.view.getModelData(view, step) for step in steps) if len(data[2])), gmsh.view.getModelData(view, 0)
        )
        on = {"NodeData": "points", "ElementData": "cells", "ElementNodeData": "cell points"}[where]
        name = gmsh.option.getString(f"View[{gmsh.view.getIndex(view)}].Name")
        fields.setdefault(f"{on} {name}", [components, *spread([number for row in values for number in row])])
    return {"points": len(mesh.getNodes()[0]), "cells": dict(cells), "fields": fields, "groups": groups, "labels": {}}


READERS = {"vtk": with_vtk, "meshio": with_meshio, "gmsh": with_gmsh}


def apart(read, path, args):
    """What a reader makes of a file, in a process of its own; a text where it fails."""
    ours, theirs = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.close(ours)
            resource.setrlimit(resource.RLIMIT_AS, (args.megabytes << 20,) * 2)
            signal.alarm(args.seconds)
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, 1)
            os.dup2(nowhere, 2)
            try:
                told = json.dumps(read(path), default=float)
            except BaseException as error:  # noqa: BLE001 - another reader's failure is what is asked for
                told = json.dumps(f"{type(error).__name__}: {error}"[:200])
            with os.fdopen(theirs, "w") as pipe:
                pipe.write(told)
        finally:
            os._exit(0)
    os.close(theirs)
    with os.fdopen(ours) as pipe:
        told = pipe.read()
    status = os.waitpid(child, 0)[1]
    return json.loads(told) if told else f"ended by signal {status & 127}"


def our_own(path, args):
    def limit():
        resource.setrlimit(resource.RLIMIT_AS, (args.megabytes << 20,) * 2)

    try:
        run = subprocess.run([args.inspect, path], check=False, capture_output=True, timeout=args.seconds, preexec_fn=limit)
        return json.loads(run.stdout)
    except subprocess.TimeoutExpired:
        return {"error": "out of time"}
    except ValueError:
        return {"error": f"PANIC OR ABORT ({run.returncode}): {run.stderr.decode(errors='replace')[-300:]}"}


def close(a, b, scale):
    return a == b or abs(a - b) <= 1e-6 * scale


def differences(ours, theirs):
    """What of a foreign reader's answer is not in ours."""
    told = " ".join(ours["unread"] + ours["warnings"])
    if theirs["points"] not in (None, ours["points"]):
        yield f"points {ours['points']}, not {theirs['points']}"
    box = theirs.get("box")
    if box and theirs["points"]:
        scale = max(abs(x) for corner in box for x in corner) or 1
        if not all(close(a, b, scale) for mine, corner in zip(ours["box"], box, strict=True) for a, b in zip(mine, corner, strict=True)):
            yield f"box {ours['box']}, not {box}"
    counts = {name: count for name, count in theirs["cells"].items() if count}
    if not only_sets_are_more(ours, counts):
        yield f"cells {ours['cells']}, not {counts}"
    fields = collections.defaultdict(list)
    for field in ours["fields"]:
        fields[f"{field['on']} {field['name']}"].append(field)
    for name, values in theirs["fields"].items():
        on, bare = name.split(" ", 1)
        own = fields[name] or fields[f"{on} {urllib.parse.unquote(bare)}"]
        if bare in THEIRS or (bare in told and bare):
            continue
        if not own or values is None:
            yield f"no field on {name}"
        elif not any(same_values(field, values) for field in own):
            yield f"{name} has {[own[0][key] for key in ('components', 'min', 'max', 'sum')]}, not {values[:4]}"
    sizes = {(name, g["cells"]) for g in ours["groups"] for name in (g["name"], str(g["tag"]))}
    by_tag = collections.Counter()
    for group in ours["groups"]:
        by_tag[str(group["tag"])] += group["cells"]
    known = {size for _, size in sizes} | {0}
    for name, size in theirs["groups"]:
        name = name.strip()
        if not ((name, size) in sizes or (not name and size in known)) and (name not in told or not name):
            yield f"no group {name!r} of {size}"
    for name, of in theirs["labels"].items():
        if any(same_values(field, totals(of)) for field in fields[f"cells {name}"]):
            continue
        for number, size in of.items():
            if number != "0" and by_tag[number] != size and size not in known:
                yield f"no group of {size}, which have the number {number} ({name})"


def only_sets_are_more(ours, counts):
    """Whether the cells are as many, but for those of lower dimension that are in groups."""
    def dim(name):
        shape = re.sub(r"\d+$", "", name)
        return {"vertex": 0, "line": 1, "triangle": 2, "quadrangle": 2, "polygon": 2}.get(shape, 3)

    more = collections.Counter(ours["cells"])
    more.subtract(counts)
    extra = collections.Counter()
    for name, count in more.items():
        extra[dim(name)] += count
    grouped = collections.Counter()
    for group in ours["groups"]:
        grouped[group["dim"]] += group["cells"]
    top = max(map(dim, ours["cells"]), default=0)
    return all(count >= 0 for count in more.values()) and all(
        count == 0 or (of < top and count <= grouped[of]) for of, count in extra.items()
    )


def totals(of):
    numbers = [(int(number), size) for number, size in of.items()]
    low, high = min(numbers)[0], max(numbers)[0]
    return [1, low, high, sum(n * size for n, size in numbers), sum(abs(n) * size for n, size in numbers)]


def same_values(field, values):
    own = [math.nan if field[key] is None else field[key] for key in ("min", "max", "sum")]
    near = values[1] == math.inf or all(close(a, b, values[4]) for a, b in zip(own, values[1:4], strict=True))
    return field["components"] == values[0] and near


def reason(reader, name, what):
    """Why the other reader is the one that differs; none if that is not known."""
    return next((why for who, file, of, why in REASONS if who == reader and re.search(file, name) and re.match(of, what)), None)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--manifest", type=pathlib.Path)
    parser.add_argument("--kinds", default="")
    parser.add_argument("--only", default="")
    parser.add_argument("--inspect", default="target/debug/examples/inspect")
    parser.add_argument("--readers", default="vtk,meshio,gmsh")
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--megabytes", type=int, default=4096)
    args = parser.parse_args()
    import gmsh  # noqa: F401  imported once, before the processes divide
    import meshio  # noqa: F401
    import vtk  # noqa: F401
    from vtk.util import numpy_support  # noqa: F401

    if args.manifest:
        files = [line.split(",")[0] for line in args.manifest.read_text().splitlines()[1:]]
    else:
        files = sorted(str(p.relative_to(args.folder)) for p in args.folder.rglob("*") if p.is_file())
    kinds = set(filter(None, args.kinds.split(",")))
    rows = collections.defaultdict(collections.Counter)
    for name in sorted(files, key=lambda name: pathlib.Path(name).suffix.lower()):
        suffix = pathlib.Path(name).suffix.lower().lstrip(".")
        path = str(args.folder / name)
        if (kinds and suffix not in kinds) or args.only not in name or not os.path.exists(path):
            continue
        row = rows[suffix]
        ours = our_own(path, args)
        row["files"] += 1
        row["ours"] += "error" not in ours
        said = [f"ours: {ours['error']}"] if "error" in ours else []
        others, unexplained, explained = 0, False, False
        for reader in args.readers.split(","):
            theirs = apart(READERS[reader], path, args)
            if isinstance(theirs, str) or not any(theirs["cells"].values()):
                if "error" in ours:
                    said.append(f"{reader} neither: {theirs if isinstance(theirs, str) else 'no cells'}")
                continue
            row[f"{reader} reads"] += 1
            others += 1
            if "error" in ours:
                said.append(f"{reader} reads {theirs['cells']}")
                unexplained = True
                continue
            apart_by = list(differences(ours, theirs))
            row[f"{reader} agrees"] += not apart_by
            for what in apart_by:
                why = reason(reader, name, what)
                explained, unexplained = explained or why, unexplained or not why
                said.append(f"{reader}: {what}" + (f": {why}" if why else ""))
        if others:
            row["any"] += 1
            row["any, ours"] += "error" not in ours
            row["rest" if unexplained else "theirs" if explained else "equal"] += 1
        if said:
            print(f"{name}\n    " + "\n    ".join(said), flush=True)
    of_readers = [f"{r} {what}" for r in args.readers.split(",") for what in ("reads", "agrees")]
    columns = ["files", "ours", *of_readers, "any", "any, ours", "equal", "theirs", "rest"]
    print(f"\n{'kind':8}" + "".join(f"{column:>15}" for column in columns))
    rows["all"] = sum(rows.values(), collections.Counter())
    for suffix, row in rows.items():
        print(f"{suffix:8}" + "".join(f"{row[column]:15}" for column in columns))


if __name__ == "__main__":
    sys.exit(main())
