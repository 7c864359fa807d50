"""NGSolve: a GridFunction."""

import ngsolve as ng
import numpy as np
import pytest
from common import cubes, cubic, linear, quadratic, sampled
from netgen.geom2d import unit_square
from ngsolve.meshes import MakeStructured2DMesh, MakeStructured3DMesh

import faceoff_fem as fo

TRI = ng.Mesh(unit_square.GenerateMesh(maxh=0.3))
QUAD = MakeStructured2DMesh(quads=True, nx=4, ny=3)
TET = MakeStructured3DMesh(hexes=False, nx=2, ny=2, nz=2)


def interpolant(space, formula):
    uh = ng.GridFunction(space)
    coordinates = (ng.x, ng.y, ng.z)[: space.mesh.dim]
    uh.Set(formula(*coordinates))
    return uh


@pytest.mark.parametrize(
    "space, formula",
    [
        (ng.H1(TRI, order=1), linear),
        (ng.H1(TRI, order=2), quadratic),
        (ng.H1(TRI, order=3), cubic),
        (ng.L2(TRI, order=2), quadratic),
        (ng.FESpace("nonconforming", TRI), linear),
        (ng.H1(QUAD, order=2), quadratic),
        (ng.H1(TET, order=2), quadratic),
        (ng.L2(TET, order=1), linear),
        (ng.FESpace("nonconforming", TET), linear),
    ],
)
def test_functions_equal_the_formula_on_another_mesh(space, formula):
    uh = interpolant(space, formula)
    if space.mesh is TET:
        reference = cubes(formula)
    elif formula is cubic:
        other = ng.Mesh(unit_square.GenerateMesh(maxh=0.23))
        reference = interpolant(ng.H1(other, order=3), cubic)
    else:
        reference = sampled(formula, 5, 2)
    assert fo.compare(uh, reference, rtol=1e-9, map="functions")
    wrong = ng.GridFunction(space)
    wrong.vec.FV().NumPy()[:] = uh.vec.FV().NumPy()
    wrong.vec.FV().NumPy()[1] += 1e-3
    assert not fo.compare(wrong, reference, rtol=1e-6, map="functions")


def test_constants_vectors_and_curved_cells():
    constants = fo.Mesh(interpolant(ng.L2(TRI, order=0), linear))
    assert constants.fields[0].on == "cells"
    both = ng.GridFunction(ng.VectorH1(TRI, order=2))
    both.Set(ng.CF((quadratic(ng.x, ng.y), linear(ng.x, ng.y))))
    reference = sampled(lambda x, y: np.stack([quadratic(x, y), linear(x, y)], axis=1), 5, 2)
    assert fo.compare(both, reference, rtol=1e-9)
    from netgen.geom2d import SplineGeometry

    circle = SplineGeometry()
    circle.AddCircle((0, 0), 1)
    curved = ng.Mesh(circle.GenerateMesh(maxh=0.4))
    curved.Curve(3)
    found = fo.Mesh(interpolant(ng.H1(curved, order=1), linear))
    assert found.cells[0][0] == "triangle10"
    assert np.abs(np.hypot(*found.points[:, :2].T).max() - 1) < 1e-3
    product = ng.GridFunction(ng.H1(TRI) * ng.H1(TRI))
    with pytest.raises(fo.UsageError, match="components"):
        fo.compare(product, reference)


def test_complex_functions_are_compared_part_by_part():
    space = ng.H1(TRI, order=2, complex=True)
    a, b = ng.GridFunction(space), ng.GridFunction(space)
    for function in (a, b):
        function.Set(ng.x + 2j * ng.y)
    r = fo.compare(a, b)
    assert r and [field["field"] for field in r.fields] == ["u (real)", "u (imaginary)"]
    b.vec.FV().NumPy()[3] += 1e-3j
    r = fo.compare(a, b)
    assert not r and r.worst["field"] == "u (imaginary)"
