"""Prints as JSON what an independent reader sees in each file: readers.py (gmsh|meshio|vtk|dolfinx) FILE…

Of a file: its points, its cells by type, and its groups by dimension and number with name and cells; each
sorted. A point is the 48 hexadecimal digits of its coordinates as binary64 (big-endian, -0 as 0), a cell
its points in the reader's order, so that what is equal here is equal to the last bit.
"""

import json
import struct
import sys

KINDS = {(0, 1): "vertex", (1, 2): "line", (2, 3): "triangle", (3, 4): "tetrahedron"}
DIMS = {kind: dim for (dim, _), kind in KINDS.items()}


def told(points, cells, names):
    """`cells` are type, indices of points, and numbers of the groups that hold the cell."""
    known = [struct.pack(">3d", *(x + 0.0 for x in point)).hex() for point in points]
    kinds, groups = {}, {}
    for kind, nodes, tags in cells:
        cell = " ".join(known[node] for node in nodes)
        kinds.setdefault(kind, []).append(cell)
        for tag in tags:
            groups.setdefault((DIMS[kind], int(tag)), []).append(cell)
    for group in names:
        groups.setdefault(group, [])
    return {
        "points": sorted(known),
        "cells": {kind: sorted(cells) for kind, cells in kinds.items()},
        "groups": {
            f"{dim} {tag}": {"name": names.get((dim, tag), ""), "cells": sorted(cells)}
            for (dim, tag), cells in groups.items()
        },
    }


def with_gmsh(path):
    import gmsh

    if not gmsh.isInitialized():
        gmsh.initialize()
        gmsh.option.setNumber("General.Terminal", 0)
    gmsh.clear()
    gmsh.merge(path)
    mesh = gmsh.model.mesh
    tags, coordinates, _ = mesh.getNodes()
    index = {tag: i for i, tag in enumerate(tags)}
    cells = []
    for dim, entity in gmsh.model.getEntities():
        groups = [abs(tag) for tag in gmsh.model.getPhysicalGroupsForEntity(dim, entity)]
        for kind, _, nodes in zip(*mesh.getElements(dim, entity), strict=True):
            count = mesh.getElementProperties(kind)[3]
            for row in nodes.reshape(-1, count):
                cells.append((KINDS[dim, count], [index[node] for node in row], groups))
    groups = gmsh.model.getPhysicalGroups()
    names = {(dim, tag): gmsh.model.getPhysicalName(dim, tag) for dim, tag in groups}
    return told(coordinates.reshape(-1, 3), cells, names)


def with_meshio(path):
    import meshio

    mesh = meshio.read(path)
    points = [[*point, 0.0][:3] for point in mesh.points.tolist()]
    labels = next((data for name, data in mesh.cell_data.items() if name in ("gmsh:physical", "medit:ref")), None)
    none = mesh.field_data.get("faceoff:no_group", [0])[0]
    cells = []
    for i, block in enumerate(mesh.cells):
        kind = {"tetra": "tetrahedron"}.get(block.type, block.type)
        rows = block.data.tolist()
        tags = [[none]] * len(rows) if labels is None else labels[i].reshape(len(rows), -1).tolist()
        if path.endswith(".msh"):
            tags = [[abs(tag) for tag in each] for each in tags]  # a minus sign marks reversed entities
        cells += [(kind, row, [tag for tag in each if tag != none]) for row, each in zip(rows, tags, strict=True)]
    # Where meshio looks for names of groups: number and dimension under the name.
    pairs = {name: data for name, data in mesh.field_data.items() if data.shape == (2,) and data.dtype != "u1"}
    return told(points, cells, {(int(dim), int(tag)): name for name, (tag, dim) in pairs.items()})


def with_vtk(path):
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

    reader = vtkXMLUnstructuredGridReader()
    reader.AddObserver("ErrorEvent", lambda *_: sys.exit(f"VTK cannot read {path}"))
    reader.SetFileName(path)
    reader.Update()
    grid = reader.GetOutput()
    whole = grid.GetFieldData()
    labels = grid.GetCellData().GetArray("gmsh:physical")
    none = whole.GetArray("faceoff:no_group")
    none = int(none.GetValue(0)) if none else 0
    kinds = {1: "vertex", 3: "line", 5: "triangle", 10: "tetrahedron"}
    cells = []
    for i in range(grid.GetNumberOfCells()):
        ids = grid.GetCell(i).GetPointIds()
        tags = [int(tag) for tag in labels.GetTuple(i) if tag != none] if labels else []
        cells.append((kinds[grid.GetCellType(i)], [ids.GetId(j) for j in range(ids.GetNumberOfIds())], tags))
    names = {}
    groups, texts = whole.GetArray("faceoff:groups"), whole.GetArray("faceoff:group_names")
    if groups:
        texts = vtk_to_numpy(texts).tobytes().decode().split("\0")
    for i in range(groups.GetNumberOfTuples() if groups else 0):
        dim, tag, _ = groups.GetTuple(i)
        names[int(dim), int(tag)] = texts[i]
    seen = told(vtk_to_numpy(grid.GetPoints().GetData()).tolist(), cells, names)
    data = grid.GetCellData()
    arrays = [data.GetArray(i) for i in range(data.GetNumberOfArrays()) if data.GetArray(i)]
    seen["fields"] = {
        array.GetName(): vtk_to_numpy(array).astype(">f8").tobytes().hex()
        for array in arrays
        if array.GetDataTypeAsString() == "double"
    }
    return seen


def with_dolfinx(path):
    import dolfinx
    from mpi4py import MPI

    with dolfinx.io.XDMFFile(MPI.COMM_WORLD, path, "r") as file:
        mesh = file.read_mesh(name="mesh")
    points = mesh.geometry.x.tolist()
    rows = mesh.geometry.dofmap.array.reshape(-1, mesh.topology.dim + 1).tolist()
    kind = KINDS[mesh.topology.dim, mesh.topology.dim + 1]
    return told(points, [(kind, row, []) for row in rows], {})


if __name__ == "__main__":
    see = globals()[f"with_{sys.argv[1]}"]
    json.dump([see(path) for path in sys.argv[2:]], sys.stdout)
