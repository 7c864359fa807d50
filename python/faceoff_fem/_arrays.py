"""What all adapters make of a solution: arrays of a mesh and of values on it."""

import numpy as np

from . import _core
from .errors import Error, usage

#: Names of meshio and of codes for the shapes that have complete elements of any order.
SHAPES = {
    "interval": "line",
    "segment": "line",
    "quadrilateral": "quadrangle",
    "quad": "quadrangle",
    "tetra": "tetrahedron",
    "wedge": "prism",
}


class Arrays:
    """Points, cells by Gmsh's numbers and orders of nodes, and fields: what the extension takes over."""

    def __init__(self, source, points=None):
        self.source = source
        self.cells, self.fields, self.groups = [], [], []
        #: The name of a function, whose parts may be several fields.
        self.called = None
        #: By name the array that a field was given as: what two results may not share.
        self.given = {}
        self.points = None
        if points is not None:
            points = numbers(points, "points", source)
            if points.ndim != 2 or not 1 <= points.shape[1] <= 3:
                raise usage(f"points of shape {points.shape}", "give one row of 2 or 3 coordinates a point", source)
            if points.shape[1] == 3:
                self.points = np.require(points, np.float64, "CA")
            else:
                self.points = np.zeros((len(points), 3))
                self.points[:, : points.shape[1]] = points

    @property
    def point_count(self):
        return 0 if self.points is None else len(self.points)

    @property
    def cell_count(self):
        return sum(len(nodes) for _, nodes in self.cells)

    def add_cells(self, kind, nodes):
        """Cells of one type, by Gmsh's number of it, in Gmsh's order of nodes."""
        nodes = np.asarray(nodes)
        if nodes.ndim != 2 or nodes.dtype.kind not in "iu":
            raise usage(f"cells of shape {nodes.shape} and type {nodes.dtype}", "give one row of point numbers a cell", self.source)
        if nodes.size and not 0 <= nodes.min() <= nodes.max() < self.point_count:
            raise usage(
                f"cells have points {nodes.min()} to {nodes.max()}, and there are {self.point_count}",
                "count points from 0",
                self.source,
            )
        self.cells.append((int(kind), np.require(nodes, np.uint32, "CA")))

    def add_field(self, name, on, values):
        """A field on "points", "cells" or "corners": one row of components for each."""
        self.given.setdefault(str(name), np.asarray(values))
        values = numbers(values, f"field {name!r}", self.source)
        if values.dtype.kind == "c":
            self.given[f"{name} (real)"] = self.given[f"{name} (imaginary)"] = values
            self.add_field(f"{name} (real)", on, values.real)
            self.add_field(f"{name} (imaginary)", on, values.imag)
            return
        components = int(np.prod(values.shape[1:], dtype=int))
        if values.size == 0:
            raise usage(f"the field {name!r} is empty", "give a value for each of what carries it", self.source)
        self.fields.append((str(name), on, components, np.require(values, requirements="CA")))

    def add_function(self, name, on, values):
        """The only field, under the name of a function."""
        self.called = str(name)
        self.add_field(name, on, values)

    def rename(self, called):
        """Gives the function another name, and so its real and imaginary parts."""
        ending = len(self.called)
        self.fields = [(called + name[ending:], *rest) for name, *rest in self.fields]
        self.called = called

    def add_group(self, name, dim, tag, cells):
        cells = np.unique(np.asarray(cells, dtype=np.int64)).astype(np.uint32)
        self.groups.append((name, int(dim), int(tag), cells))


def numbers(values, what, source):
    """An array of numbers in a type that the extension knows: without a copy where it is one."""
    values = np.asarray(values)
    if values.dtype.kind == "b":
        return values.astype(np.uint8)
    if not values.dtype.isnative:
        values = values.astype(values.dtype.newbyteorder("="))
    known = values.dtype.kind in "iuc" or values.dtype in (np.float32, np.float64)
    if values.ndim == 0 or not known:
        raise usage(f"{what} is of shape {values.shape} and type {values.dtype}", "give an array of numbers", source)
    return values


def nodes_of(shape, order):
    """Gmsh's number of the complete element, and its nodes in coordinates of the unit cell, one row a node."""
    kind, nodes = _core.reference_nodes(SHAPES.get(shape, shape), order)
    dim = {"line": 1, "triangle": 2, "quadrangle": 2}.get(SHAPES.get(shape, shape), 3)
    return kind, np.array(nodes)[:, :dim]


def partners(theirs, ours):
    """For each of our nodes the number of theirs at the same place of the unit cell, so that no table of orders has to be right;
    None where they do not have the same."""
    theirs = np.asarray(theirs)
    distances = np.abs(theirs[None, :, : ours.shape[1]] - ours[:, None, :]).max(axis=2)
    found = distances.argmin(axis=1)
    is_same = len(theirs) == len(ours) and distances.min(axis=1).max() < 1e-9
    return found if is_same and len(set(found)) == len(ours) else None


#: Points of the unit cell of any shape that have no symmetry: what vanishes at nodes does not vanish at all of these.
PROBES = np.array([[0.137, 0.211, 0.293], [0.523, 0.109, 0.071], [0.071, 0.587, 0.173], [0.233, 0.197, 0.461]])
#: What rounding may leave of the difference, relative to the largest value.
PROOF = 1e-9


def proved(source, shape, order, least, at, dofs):
    """The degree of a function on each cell, and its places and values at the nodes of that degree.

    `at` gives places and values, cell by cell, at points of the unit cell; `order` is the degree that the space names, and `least`
    that of the cells. A name is not believed: where the polynomial through the values at the nodes is not the function at points
    that are no nodes, the next degree is tried, so that no dof is left out. `dofs` are those of the space.
    """
    degree, expected = max(order, least) if order else 0, None
    while True:
        nodes = nodes_to_try(source, shape, degree)
        probes = PROBES[:, : nodes.shape[1]]
        if expected is None:
            # Some codes tabulate all functions of an element at each call, whatever the number of points.
            places, values = at(np.vstack([nodes, probes]))
            places, values, expected = places[:, : len(nodes)], values[:, : len(nodes)], values[:, len(nodes) :]
            if np.any(dofs) and not np.any(expected):
                raise usage("it is 0 inside all cells, and its dofs are not", "compare what lives on faces as rows of values", source)
        else:
            places, values = at(nodes)
        if represents(shape, degree, nodes, values, probes, expected):
            return degree, places, values
        degree = max(degree + 1, least)


def nodes_to_try(source, shape, degree):
    """The nodes of a degree, for a function that lower ones do not represent."""
    try:
        return nodes_of(shape, max(degree, 1))[1]
    except Error:
        what = "on its cells it is no polynomial of a degree that files hold"
        raise usage(what, "interpolate it into a Lagrange space, and compare that", source) from None


def represents(shape, degree, nodes, values, probes, expected):
    """Is the polynomial through the values at the nodes that of the expected values at other points, on every cell?"""
    if degree == 0:
        found = values[:, :1]
    else:
        exponents = np.indices((degree + 1,) * nodes.shape[1]).reshape(nodes.shape[1], -1).T
        # A complete element of a simplex has the degree in all coordinates together, a box in each.
        if SHAPES.get(shape, shape) in ("triangle", "tetrahedron"):
            exponents = exponents[exponents.sum(axis=1) <= degree]
        powers = [np.prod(of[:, None, :] ** exponents[None, :, :], axis=2) for of in (nodes, probes)]
        weights = np.linalg.solve(powers[0].T, powers[1].T)
        found = np.einsum("np,cn...->cp...", weights, values)
    # What is not a number is found by the comparison.
    largest, apart = (np.max(np.abs(of), initial=0.0, where=np.isfinite(of)) for of in (expected, found - expected))
    return apart <= PROOF * max(largest, np.max(np.abs(values), initial=0.0, where=np.isfinite(values)))


def functions(source, name, shape, order, places, values, numbers_of=None):
    """A function by its values at the nodes of each cell, which have these places: arrays of (cells, nodes, …).

    Cells share the points of one number, or without `numbers_of` those at one place, if the function is continuous there.
    """
    kind, _ = nodes_of(shape, max(order, 1))
    places, values = np.asarray(places, dtype=float), np.asarray(values)
    shape_of_cells, scalar = places.shape[:2], values.shape[2:]
    places = places.reshape(-1, places.shape[2])
    if order == 0:
        points, numbers_of = merged(places)
        arrays = Arrays(source, points)
        arrays.add_cells(kind, numbers_of.reshape(shape_of_cells))
        arrays.add_function(name, "cells", values[:, 0])
        return arrays
    values = values.reshape(-1, *scalar)
    if numbers_of is None:
        points, numbers_of = merged(places)
    else:
        _, first, numbers_of = np.unique(numbers_of, return_index=True, return_inverse=True)
        points, numbers_of = places[first], numbers_of.reshape(-1)
    first = np.empty(len(points), dtype=np.int64)
    first[numbers_of[::-1]] = np.arange(len(places))[::-1]
    largest = np.abs(values).max(initial=0.0)
    # What has two values at one place is discontinuous.
    if np.abs(values - values[first[numbers_of]]).max(initial=0.0) <= 1e-10 * largest:
        places, values = points, values[first]
    else:
        numbers_of = np.arange(len(places))
    arrays = Arrays(source, places)
    arrays.add_cells(kind, numbers_of.reshape(shape_of_cells))
    arrays.add_function(name, "points", values)
    return arrays


def merged(places):
    """The points that differ by more than rounding, and for each place the number of its point."""
    size = np.abs(places).max(initial=0.0) or 1.0
    rounded = np.round(places * (1e10 / size)).astype(np.int64)
    _, first, numbers_of = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
    return places[first], numbers_of.reshape(-1)


def on_faces(source, name, places, faces, values):
    """A Crouzeix–Raviart function: one value a face. Faces are rows of numbers of `places`."""
    arrays = Arrays(source, places)
    arrays.add_cells({2: 1, 3: 2}[faces.shape[1]], faces)
    arrays.add_function(name, "cells", values)
    return arrays


def faces_of_cells(cells, values):
    """The faces of simplices, each opposite a corner, and the mean of a field on each from that of one of its cells: arrays of
    (faces, corners) and (faces, …). `values` are (cells, corners, …): the value on the face opposite each corner."""
    width = cells.shape[1]
    opposite = [[j for j in range(width) if j != i] for i in range(width)]
    faces = np.sort(cells[:, opposite], axis=2).reshape(-1, width - 1)
    faces, first = np.unique(faces, axis=0, return_index=True)
    return faces, values.reshape(-1, *values.shape[2:])[first]
