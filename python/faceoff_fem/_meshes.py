"""What has a mesh and named fields already: meshio, VTK and PyVista, dictionaries of arrays."""

import numpy as np

from . import _core
from ._arrays import Arrays
from .errors import usage

#: Names of cells in dictionaries, and Gmsh's numbers of them; meshio's names as well.
CELLS = {
    "vertex": 15, "line": 1, "line3": 8, "triangle": 2, "triangle6": 9, "quadrangle": 3, "quad": 3, "quadrangle8": 16,
    "quad8": 16, "quadrangle9": 10, "quad9": 10, "tetrahedron": 4, "tetra": 4, "tetrahedron10": 11, "tetra10": 11,
    "hexahedron": 5, "hexahedron20": 17, "hexahedron27": 12, "prism": 6, "wedge": 6, "pyramid": 7,
}  # fmt: skip

ON = {"point_data": "points", "cell_data": "cells", "corner_data": "corners"}


def of_meshio(mesh):
    from meshio.gmsh.common import _meshio_to_gmsh_order, _meshio_to_gmsh_type

    arrays = Arrays("meshio Mesh", mesh.points)
    for block in mesh.cells:
        if block.type not in _meshio_to_gmsh_type:
            raise usage(f"cells of type {block.type} are not known", "write a VTU, and compare that", arrays.source)
        arrays.add_cells(_meshio_to_gmsh_type[block.type], _meshio_to_gmsh_order(block.type, np.asarray(block.data)))
    for name, values in mesh.point_data.items():
        arrays.add_field(name, "points", values)
    for name, blocks in mesh.cell_data.items():
        arrays.add_field(name, "cells", np.concatenate([np.asarray(values) for values in blocks]) if len(blocks) > 1 else blocks[0])
    starts = np.cumsum([0] + [len(block.data) for block in mesh.cells])
    for tag, (name, parts) in enumerate(mesh.cell_sets.items(), 1):
        cells = [np.asarray(part, dtype=np.int64) + start for part, start in zip(parts, starts) if part is not None]
        dims = {mesh.cells[k].dim for k, part in enumerate(parts) if part is not None and len(part)}
        if len(dims) == 1:
            arrays.add_group(str(name), dims.pop(), tag, np.concatenate(cells))
    return arrays


def of_vtk(grid):
    """Through VTK's own writer, in memory: types of cells, orders of nodes and pieces are those of the format."""
    from vtkmodules import vtkIOXML

    if not grid.IsA("vtkDataSet"):
        raise usage(f"a {grid.GetClassName()} is no grid", "give one of its blocks")
    kinds = ("ImageData", "RectilinearGrid", "StructuredGrid", "PolyData", "UnstructuredGrid")
    kind = next((kind for kind in kinds if grid.IsA(f"vtk{kind}")), None)
    if kind is None:
        raise usage(f"VTK cannot write a {grid.GetClassName()}", "give a vtkUnstructuredGrid")
    writer = getattr(vtkIOXML, f"vtkXML{kind}Writer")()
    writer.SetInputDataObject(grid)
    writer.WriteToOutputStringOn()
    writer.SetDataModeToAppended()
    writer.EncodeAppendedDataOn()
    writer.SetCompressorTypeToNone()
    if not writer.Write():
        raise usage(f"VTK cannot write this {grid.GetClassName()}", "write it to a file, and compare that")
    text = writer.GetOutputString()
    return _core.parse(grid.GetClassName(), text.encode() if isinstance(text, str) else bytes(text))


def of_dict(given, source="dict"):
    given = dict(given)
    points, cells = given.pop("points", None), given.pop("cells", None)
    arrays = Arrays(source, points)
    if cells is not None and points is None:
        raise usage("there are cells, and no points", "give their coordinates as `points`", source)
    for kind, nodes in cells.items() if hasattr(cells, "items") else cells or ():
        if kind not in CELLS:
            raise usage(f"there are no cells {kind!r}", f"name them {', '.join(sorted(CELLS))}", source)
        arrays.add_cells(CELLS[kind], nodes)
    for key, on in ON.items():
        for name, values in given.pop(key, {}).items():
            arrays.add_field(name, on, values)
    counts = {"points": arrays.point_count, "cells": arrays.cell_count}
    for name, values in given.items():
        rows = len(values)
        on = [carrier for carrier, count in counts.items() if count == rows]
        if points is not None and len(on) != 1:
            counted = " and ".join(f"{count} {carrier}" for carrier, count in counts.items())
            raise usage(
                f"{name!r} has {rows} rows, and there are {counted}",
                f"put it into {' or '.join(ON)}",
                source,
            )
        arrays.add_field(name, on[0] if points is not None else "points", values)
    if points is None and len({len(values) for *_, values in arrays.fields}) > 1:
        raise usage("its arrays have rows of different numbers", "give one value a row", source)
    return arrays
