"""Carries a mesh between a file that meshio knows and a plain one: a line of JSON, then the arrays, little-endian."""

import json
import sys
from xml.etree import ElementTree

import meshio
import numpy as np
from meshio.gmsh.common import (
    _gmsh_to_meshio_order,
    _gmsh_to_meshio_type,
    _meshio_to_gmsh_order,
    _meshio_to_gmsh_type,
)


def fail(what):
    """Ends with a line that is the whole message."""
    sys.exit("error " + " ".join(str(what).split()))


class Plain:
    """Arrays one after another, and where each stands."""

    def __init__(self):
        self.chunks = []
        self.size = 0

    def add(self, array, dtype):
        data = np.ascontiguousarray(array, dtype=dtype).tobytes()
        self.chunks.append(data)
        self.size += len(data)
        return [self.size - len(data), len(data)]


def values(plain, name, array):
    array = np.asarray(array)
    if array.dtype.kind not in "fiub":
        return None
    dtype = "<i8" if array.dtype.kind in "iub" else "<f8"
    components = int(np.prod(array.shape[1:]))
    return {
        "name": name,
        "integer": dtype == "<i8",
        "single": array.dtype == np.float32,
        "components": components,
        "at": plain.add(array, dtype),
    }


def collections(reader):
    """The grids over time of an XDMF file: a list of grids and one of their times for each function, as dolfinx writes it."""
    for grid in reader.domain:
        if grid.get("GridType") == "Collection":
            steps = [step for step in grid if step.tag == "Grid"]
            yield steps, [float(step.find("Time").get("Value")) for step in steps]


def read_series(source, time):
    """The mesh and the functions of an XDMF file at a time that it has; without one, the only time."""
    with meshio.xdmf.TimeSeriesReader(source) as reader:
        points, cells = reader.read_points_cells()
        point_data, cell_data = {}, {}
        for steps, times in collections(reader):
            if time is None and len(steps) != 1:
                fail(f"it has {len(steps)} times, of which one must be chosen")
            if time is not None and time not in times:
                continue
            reader.collection = steps
            _, on_points, on_cells = reader.read_data(
                0 if time is None else times.index(time)
            )
            for found, known in ((on_points, point_data), (on_cells, cell_data)):
                for name, values in found.items():
                    if name in known:
                        fail(f"the field {name!r} appears twice")
                    known[name] = values
    return meshio.Mesh(points, cells, point_data=point_data, cell_data=cell_data)


def read_step(source, time):
    """An Exodus file at a time that it has, or at the first: meshio reads the first one of a copy that has no other."""
    import os
    import tempfile

    import netCDF4

    with tempfile.TemporaryDirectory() as folder:
        copy = os.path.join(folder, "step.e")
        with netCDF4.Dataset(source) as whole, netCDF4.Dataset(copy, "w") as part:
            times = [float(time) for time in whole.variables["time_whole"][:]]
            step = 0 if time is None else times.index(time)
            part.setncatts(whole.__dict__)
            for name, dim in whole.dimensions.items():
                part.createDimension(name, None if name == "time_step" else len(dim))
            for name, old in whole.variables.items():
                new = part.createVariable(name, old.dtype, old.dimensions)
                new.setncatts(old.__dict__)
                old.set_auto_mask(False)
                if old.dimensions[:1] == ("time_step",):
                    new[0:1] = old[step : step + 1]
                else:
                    new[:] = old[:]
        return meshio.read(copy, file_format="exodus")


def times_of(source, kind):
    """All times of a file, ascending; none where it is of no time."""
    if is_series(source, kind):
        with meshio.xdmf.TimeSeriesReader(source) as reader:
            return sorted({time for _, times in collections(reader) for time in times})
    if kind == "exodus":
        import netCDF4

        with netCDF4.Dataset(source) as whole:
            times = whole.variables.get("time_whole")
            return [] if times is None else sorted(float(time) for time in times[:])
    return []


def is_series(source, kind):
    if kind != "xdmf":
        return False
    grids = ElementTree.parse(source).getroot().iterfind("./Domain/Grid")
    return any(grid.get("GridType") == "Collection" for grid in grids)


def read(source, target, kind, time=None):
    time = None if time is None else float(time)
    unread = []
    if is_series(source, kind):
        mesh = read_series(source, time)
    elif kind == "exodus" and times_of(source, kind):
        mesh = read_step(source, time)
        others = len(times_of(source, kind)) - 1
        if time is None and others:
            unread = [f"{others} of {others + 1} times: those after the first"]
    else:
        mesh = meshio.read(source, file_format=kind)
    plain = Plain()
    points = np.zeros((len(mesh.points), 3))
    points[:, : mesh.points.shape[1]] = mesh.points
    head = {
        "points": plain.add(points, "<f8"),
        "cells": [],
        "point_data": [],
        "cell_data": [],
        "sets": [],
        "unread": unread,
    }
    for block in mesh.cells:
        if block.type not in _meshio_to_gmsh_type:
            fail(f"cells of type {block.type} are not known here")
        nodes = _meshio_to_gmsh_order(block.type, np.asarray(block.data))
        head["cells"].append(
            {"kind": _meshio_to_gmsh_type[block.type], "nodes": plain.add(nodes, "<i8")}
        )
    for name, array in mesh.point_data.items():
        found = values(plain, name, array)
        head["point_data"].append(found) if found else head["unread"].append(
            f"the point data {name!r}"
        )
    for name, arrays in mesh.cell_data.items():
        found = (
            values(plain, name, np.concatenate([np.asarray(a) for a in arrays]))
            if arrays
            else None
        )
        head["cell_data"].append(found) if found else head["unread"].append(
            f"the cell data {name!r}"
        )
    starts = np.cumsum([0] + [len(block.data) for block in mesh.cells])
    for name, parts in mesh.cell_sets.items():
        indices = [
            np.asarray(part, dtype="i8") + start
            for part, start in zip(parts, starts)
            if part is not None
        ]
        cells = np.unique(np.concatenate(indices)) if indices else []
        head["sets"].append({"name": str(name), "cells": plain.add(cells, "<i8")})
    head["names"] = [
        {
            "name": str(name),
            "tag": int(np.ravel(pair)[0]),
            "dim": int(np.ravel(pair)[1]),
        }
        for name, pair in mesh.field_data.items()
        if np.size(pair) == 2
    ]
    head["unread"] += [f"the point set {name!r}" for name in mesh.point_sets]
    with open(target, "wb") as file:
        file.write(json.dumps(head).encode() + b"\n")
        file.writelines(plain.chunks)


def times(source, target, kind):
    with open(target, "w") as file:
        json.dump(times_of(source, kind), file)


def write(source, target, kind):
    with open(source, "rb") as file:
        head = json.loads(file.readline())
        data = file.read()

    def array(at, dtype):
        return np.frombuffer(data[at[0] : at[0] + at[1]], dtype=dtype)

    def field(entry):
        found = array(entry["at"], "<i8" if entry["integer"] else "<f8")
        return (
            found
            if entry["components"] == 1
            else found.reshape(-1, entry["components"])
        )

    cells = []
    for block in head["cells"]:
        cell = _gmsh_to_meshio_type.get(block["kind"])
        if cell is None:
            fail(f"cells of Gmsh's type {block['kind']} are not known to it")
        nodes = array(block["nodes"], "<i8").reshape(
            -1, meshio._mesh.num_nodes_per_cell[cell]
        )
        cells.append((cell, _gmsh_to_meshio_order(cell, nodes)))
    starts = np.cumsum([0] + [len(nodes) for _, nodes in cells])
    split = [(starts[i], starts[i + 1]) for i in range(len(cells))]
    sets = {}
    for entry in head["sets"]:
        chosen = array(entry["cells"], "<i8")
        sets[entry["name"]] = [
            chosen[(chosen >= a) & (chosen < b)] - a for a, b in split
        ]
    mesh = meshio.Mesh(
        array(head["points"], "<f8").reshape(-1, 3),
        cells,
        point_data={entry["name"]: field(entry) for entry in head["point_data"]},
        cell_data={
            entry["name"]: [field(entry)[a:b] for a, b in split]
            for entry in head["cell_data"]
        },
        field_data={
            entry["name"]: np.array([entry["tag"], entry["dim"]])
            for entry in head["names"]
        },
        cell_sets=sets,
    )
    meshio.write(target, mesh, file_format=kind)


try:
    {"read": read, "times": times, "write": write}[sys.argv[1]](*sys.argv[2:])
except Exception as error:
    fail(f"{type(error).__name__}: {error}")
