"""Meshes and functions by formulas, which share no code with the libraries."""

import numpy as np

SQUARE = {"points": [[0, 0], [1, 0], [0, 1], [1, 1]], "cells": {"triangle": [[0, 1, 2], [1, 3, 2]]}}


def square(n, order=1, skew=0.0):
    """Points and triangles of order 1 or 2 on the unit square, in Gmsh's order of nodes; inside, points are moved."""
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1))
    points = np.column_stack([x.ravel(), y.ravel()])
    points += skew * (points * (1 - points)).prod(axis=1)[:, None] * [1.0, -0.5]
    k = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).reshape(-1, 1)
    cells = np.vstack([k + [0, 1, n + 1], k + [1, n + 2, n + 1]])
    if order == 1:
        return points, cells
    edges = np.sort(cells[:, [[0, 1], [1, 2], [2, 0]]], axis=2)
    unique, at = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
    return np.vstack([points, points[unique].mean(axis=1)]), np.hstack([cells, len(points) + at.reshape(-1, 3)])


def sampled(formula, n=5, order=1, name="u", skew=0.3):
    """A function by its values at nodes, on a mesh that no library makes."""
    points, cells = square(n, order, skew)
    kind = "triangle" if order == 1 else "triangle6"
    return {"points": points, "cells": {kind: cells}, "point_data": {name: formula(*points.T)}}


def cubes(formula, n=3, name="u"):
    """The same on tetrahedra of order 2 of the unit cube, six in each of n³ cubes."""
    from itertools import permutations

    grid = np.stack(np.meshgrid(*[np.linspace(0, 1, n + 1)] * 3, indexing="ij"), axis=-1)
    number = np.arange((n + 1) ** 3).reshape((n + 1,) * 3)
    cells = []
    for corner in np.ndindex(n, n, n):
        for order in permutations(range(3)):
            at, path = list(corner), [number[corner]]
            for axis in order:
                at[axis] += 1
                path.append(number[tuple(at)])
            cells.append(path)
    points, cells = grid.reshape(-1, 3), np.array(cells)
    edges = np.sort(cells[:, [[0, 1], [1, 2], [2, 0], [3, 0], [3, 2], [3, 1]]], axis=2)
    unique, at = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
    cells = np.hstack([cells, len(points) + at.reshape(-1, 6)])
    points = np.vstack([points, points[unique].mean(axis=1)])
    return {"points": points, "cells": {"tetrahedron10": cells}, "point_data": {name: formula(*points.T)}}


def linear(x, y, z=0.0):
    return 1 + 2 * x - 3 * y + 0.5 * z


def quadratic(x, y, z=0.0):
    return 1 + x - 2 * x * y + y * y - 0.25 * x * x + z * (x - z)


def cubic(x, y, z=0.0):
    return x**3 - x * y * y + 0.5 * y


def jumping(x, y, z=0.0):
    """Linear on either side of x = 1/2; to be evaluated inside of cells."""
    return linear(x, y) + (x > 0.5)
