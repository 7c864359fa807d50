"""Carries a mesh between a file that meshio knows and a plain one: a line of JSON, then the arrays, little-endian."""

import json
import sys

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


def read(source, target, kind):
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
        "unread": [],
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
            {"name": str(name), "what": f"the point data {name!r}, which are not numbers"}
        )
    for name, arrays in mesh.cell_data.items():
        found = (
            values(plain, name, np.concatenate([np.asarray(a) for a in arrays]))
            if arrays
            else None
        )
        head["cell_data"].append(found) if found else head["unread"].append(
            {"name": str(name), "what": f"the cell data {name!r}, which are not numbers"}
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
    head["unread"] += [
        {"name": str(name), "what": f"the point set {name!r}"} for name in mesh.point_sets
    ]
    with open(target, "wb") as file:
        file.write(json.dumps(head).encode() + b"\n")
        file.writelines(plain.chunks)


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
    {"read": read, "write": write}[sys.argv[1]](*sys.argv[2:])
except Exception as error:
    fail(f"{type(error).__name__}: {error}")
