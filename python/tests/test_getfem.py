"""GetFEM: (mf, U)."""

import getfem as gf
import numpy as np
import pytest
from common import cubes, linear, quadratic, sampled

import faceoff_fem as fo

GRID = np.linspace(0, 1, 5)
TRI = gf.Mesh("regular simplices", GRID, GRID)
QUAD = gf.Mesh("cartesian", GRID, GRID)
TET = gf.Mesh("regular simplices", GRID[::2], GRID[::2], GRID[::2])


def interpolant(mesh, fem, formula, components=1):
    space = gf.MeshFem(mesh, components)
    space.set_fem(gf.Fem(fem))
    nodes = space.basic_dof_nodes()
    values = np.asarray(formula(*nodes))
    if components > 1:
        values = values[np.arange(values.shape[0]), np.arange(values.shape[0]) % components]
    return space, values


@pytest.mark.parametrize(
    "mesh, fem, formula",
    [
        (TRI, "FEM_PK(2,1)", linear),
        (TRI, "FEM_PK(2,2)", quadratic),
        (TRI, "FEM_PK_DISCONTINUOUS(2,1)", linear),
        (TRI, "FEM_P1_NONCONFORMING", linear),
        (QUAD, "FEM_QK(2,1)", linear),
        (QUAD, "FEM_QK(2,2)", quadratic),
        (TET, "FEM_PK(3,2)", quadratic),
    ],
)
def test_functions_equal_the_formula_on_another_mesh(mesh, fem, formula):
    space, u = interpolant(mesh, fem, formula)
    reference = cubes(formula) if mesh is TET else sampled(formula, 5, 2)
    assert fo.compare((space, u), reference, rtol=1e-9, map="functions")
    wrong = u.copy()
    # Two dofs of a cell that differ change places.
    of_cells, starts = space.basic_dof_from_cvid()
    first = of_cells[: starts[1]]
    low, high = first[u[first].argmin()], first[u[first].argmax()]
    wrong[[low, high]] = u[[high, low]]
    assert not fo.compare((space, wrong), reference, rtol=1e-3, map="functions")


def test_constants_and_vectors():
    space, u = interpolant(TRI, "FEM_PK(2,0)", linear)
    assert fo.Mesh((space, u)).fields[0].on == "cells"
    both = interpolant(TRI, "FEM_PK(2,2)", lambda x, y: np.stack([quadratic(x, y), linear(x, y)], axis=1), 2)
    reference = sampled(lambda x, y: np.stack([quadratic(x, y), linear(x, y)], axis=1), 5, 2)
    assert fo.compare(both, reference, rtol=1e-9)
    with pytest.raises(fo.UsageError, match="values for"):
        fo.compare((space, u[1:]), reference)
