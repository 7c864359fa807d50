"""Meshes and files."""

from __future__ import annotations

import importlib.util
import sys
import warnings
from pathlib import Path
from typing import NamedTuple, Optional

import numpy as np

from . import _core
from ._adapters import side
from ._program import words
from .errors import usage


class Field(NamedTuple):
    """Values on a mesh."""

    name: str
    #: "points", "cells", or "cell points": each node of each cell.
    on: str
    #: One row for each that carries it; one number where it is a scalar.
    values: np.ndarray
    #: The numbers of the points or cells that carry it; None if all do.
    at: Optional[np.ndarray]
    time: Optional[float]


class Group(NamedTuple):
    """A set of cells."""

    name: Optional[str]
    dim: int
    tag: int
    cells: np.ndarray


class Mesh:
    """A mesh with its fields, as a file holds it. Its arrays are read-only and show the memory of the mesh, without a copy.

    >>> import faceoff_fem as fo
    >>> m = fo.Mesh({"points": [[0, 0], [1, 0], [0, 1]], "cells": {"triangle": [[0, 1, 2]]}, "u": [1.0, 2, 3]})
    >>> m.points.shape, m.cells[0][0], m["u"]
    ((3, 3), 'triangle', array([1., 2., 3.]))
    """

    def __init__(self, of):
        made = side(of)
        if isinstance(made, Path):
            made = _core.read(made)
        self._core = made if isinstance(made, _core.Mesh) else _core.Mesh(made)

    @property
    def source(self):
        """What it comes from."""
        return self._core.source

    @property
    def points(self):
        """Coordinates, of shape (n, 3); in the plane z is 0."""
        return self._core.points

    @property
    def cells(self):
        """The cells block by block: the name of their type, and the numbers of their points in Gmsh's order, of shape (m, k)."""
        return [(kind, nodes) for kind, _, nodes in self._core.cells]

    @property
    def fields(self):
        """All fields, a list of :class:`Field`."""

        def flat(values):
            return values[:, 0] if values.shape[1] == 1 else values

        return [Field(name, on, flat(values), None if at is None else at[:, 0], time) for name, on, values, at, time in self._core.fields]

    @property
    def groups(self):
        """All groups, a list of :class:`Group`."""
        return [Group(name, dim, tag, cells[:, 0]) for name, dim, tag, cells in self._core.groups]

    @property
    def whole(self):
        """Data about the mesh as a whole, by name."""
        return dict(self._core.whole)

    def __getitem__(self, name):
        """The values of the field of this name."""
        found = [field for field in self.fields if field.name == name]
        if len(found) != 1:
            known = ", ".join(field.name for field in self.fields) or "none"
            raise KeyError(f"{len(found)} fields are called {name!r}; the fields are: {known}")
        return found[0].values

    def __repr__(self):
        cells = ", ".join(f"{len(nodes)} {kind}" for kind, nodes in self.cells)
        fields = ", ".join(f"{field.name} on {field.on}" for field in self.fields)
        return f"<faceoff_fem.Mesh {self.source}: {len(self.points)} points; {cells}; fields: {fields or 'none'}>"

    def to_meshio(self):
        """The same as a ``meshio.Mesh``, whose arrays are copies. What meshio cannot hold is an error."""
        import meshio
        from meshio.gmsh.common import _gmsh_to_meshio_order, _gmsh_to_meshio_type

        blocks = []
        for kind, number, nodes in self._core.cells:
            if number not in _gmsh_to_meshio_type:
                raise usage(f"meshio has no cells of type {kind}", "write a VTU", self.source)
            cell = _gmsh_to_meshio_type[number]
            blocks.append((cell, _gmsh_to_meshio_order(cell, nodes.astype(np.int64))))
        starts = np.cumsum([0] + [len(nodes) for _, nodes in blocks])

        def split(values):
            return [values[i:j].copy() for i, j in zip(starts, starts[1:])]

        points, cells, sets = {}, {}, {}
        for field in self.fields:
            if field.on == "cell points" or field.at is not None:
                raise usage(
                    f"meshio cannot hold the field {field.name!r} on {'some ' if field.at is not None else ''}{field.on}",
                    "write a VTU",
                    self.source,
                )
            if field.on == "points":
                points[field.name] = field.values.copy()
            else:
                cells[field.name] = split(field.values)
        for group in self.groups:
            chosen = np.zeros(starts[-1], dtype=bool)
            chosen[group.cells] = True
            sets[group.name or str(group.tag)] = [np.flatnonzero(part) for part in split(chosen)]
        return meshio.Mesh(self.points.copy(), blocks, point_data=points, cell_data=cells, cell_sets=sets)


def _python():
    """This interpreter, if it has meshio, through which other formats are read and written."""
    return sys.executable if importlib.util.find_spec("meshio") else None


def _warn(remarks):
    for remark in remarks:
        warnings.warn(remark, stacklevel=3)


def read(path):
    """Reads a file of any format that ``faceoff`` knows, and warns of what it holds and the mesh does not.

    >>> import faceoff_fem as fo
    >>> fo.write("triangle.vtu", {"points": [[0, 0], [1, 0], [0, 1]], "cells": {"triangle": [[0, 1, 2]]}, "u": [1.0, 2, 3]})
    >>> fo.read("triangle.vtu")
    <faceoff_fem.Mesh triangle.vtu: 3 points; 1 triangle; fields: u on points>
    """
    core = _core.read(path, _python())
    _warn(core.remarks)
    return Mesh(core)


def write(path, mesh, **options):
    """Writes a mesh, beside its target and then renamed, in the format that the suffix names.

    Args:
        path: the file.
        mesh: what :func:`compare` takes.
        options: those of ``faceoff mesh convert``: ``format="msh"``, ``msh_version="2.2"``, ``encoding="binary"``, and
            ``lossy=True``, which makes what the format cannot hold a warning instead of an error.

    >>> import faceoff_fem as fo
    >>> fo.write("line.msh", {"points": [[0, 0], [1, 0]], "cells": {"line": [[0, 1]]}}, msh_version="2.2")
    """
    made = mesh if isinstance(mesh, Mesh) else Mesh(mesh)
    _warn(_core.write(path, made._core, [*words(options)], _python()))
