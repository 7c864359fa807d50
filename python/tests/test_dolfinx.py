"""dolfinx."""

import numpy as np
import pytest
from common import cubes, cubic, linear, quadratic, sampled
from dolfinx import fem, mesh
from mpi4py import MPI

import faceoff_fem as fo

SQUARE = mesh.create_unit_square(MPI.COMM_SELF, 4, 3)
QUADS = mesh.create_unit_square(MPI.COMM_SELF, 4, 3, mesh.CellType.quadrilateral)
CUBE = mesh.create_unit_cube(MPI.COMM_SELF, 2, 2, 2)


def space(on, element):
    if hasattr(fem, "functionspace"):
        family, degree, *vector = element
        return fem.functionspace(on, (family, degree, (vector[0],)) if vector else (family, degree))
    family, degree, *vector = element
    return (fem.VectorFunctionSpace if vector else fem.FunctionSpace)(on, (family, degree))


def interpolant(on, element, formula):
    uh = fem.Function(space(on, element))
    uh.interpolate(lambda x: formula(x[0], x[1], x[2]))
    return uh


@pytest.mark.parametrize(
    "on, element, formula",
    [
        (SQUARE, ("Lagrange", 1), linear),
        (SQUARE, ("Lagrange", 2), quadratic),
        (SQUARE, ("Lagrange", 3), cubic),
        (SQUARE, ("DG", 1), linear),
        (SQUARE, ("DG", 2), quadratic),
        (SQUARE, ("CR", 1), linear),
        (QUADS, ("Lagrange", 1), linear),
        (QUADS, ("Lagrange", 2), quadratic),
        (CUBE, ("Lagrange", 2), quadratic),
        (CUBE, ("DG", 1), linear),
        (CUBE, ("CR", 1), linear),
    ],
)
def test_functions_equal_the_formula_on_another_mesh(on, element, formula):
    uh = interpolant(on, element, formula)
    if on is CUBE:
        reference = cubes(formula)
    elif formula is cubic:
        reference = interpolant(mesh.create_unit_square(MPI.COMM_SELF, 5, 7), ("Lagrange", 3), cubic)
    else:
        reference = sampled(formula, 5, 2)
    assert fo.compare(uh, reference, rtol=1e-11, map="functions")
    wrong = uh.copy()
    dofs = uh.function_space.dofmap.cell_dofs(1)
    wrong.x.array[dofs] = uh.x.array[dofs[::-1]]
    assert not fo.compare(wrong, reference, rtol=1e-3, map="functions")


def test_the_nodes_of_a_function_have_its_values():
    """Each value stands at its place: orders of nodes are those of the library."""
    for on in (SQUARE, QUADS, CUBE):
        for degree in (1, 2, 3):
            uh = interpolant(on, ("Lagrange", degree), cubic)
            found = fo.Mesh(uh)
            assert len(found.points) == len(uh.x.array)
            assert (
                np.abs(found["f" if "f" in [f.name for f in found.fields] else found.fields[0].name] - cubic(*found.points.T)).max() < 1e-14
            )


def test_constants_vectors_and_other_elements():
    uh = interpolant(SQUARE, ("DG", 0), linear)
    constants = fo.Mesh(uh)
    assert constants.fields[0].on == "cells"
    middles = constants.points[constants.cells[0][1]].mean(axis=1)
    assert np.abs(constants.fields[0].values - linear(*middles[:, :2].T)).max() < 1e-14
    both = fem.Function(space(SQUARE, ("Lagrange", 2, 2)))
    both.interpolate(lambda x: np.stack([quadratic(x[0], x[1]), linear(x[0], x[1])]))
    reference = sampled(lambda x, y: np.stack([quadratic(x, y), linear(x, y)], axis=1), 5, 2)
    assert fo.compare(both, reference, rtol=1e-11)
    assert not fo.compare(both, sampled(lambda x, y: np.stack([linear(x, y), quadratic(x, y)], axis=1), 5, 2), rtol=1e-3)
    assert fo.compare(both.sub(0), sampled(quadratic, 5, 2), rtol=1e-11)
    edges = fem.Function(space(SQUARE, ("N1curl", 1)))
    edges.interpolate(lambda x: np.stack([1 - x[1], 2 + x[0]]))
    assert fo.compare(edges, sampled(lambda x, y: np.stack([1 - y, 2 + x], axis=1), 5), rtol=1e-11, map="functions")


def test_a_crouzeix_raviart_function_is_compared_face_by_face():
    uh = interpolant(SQUARE, ("CR", 1), quadratic)
    points = SQUARE.geometry.x[:, :2]
    cells = np.array(
        [SQUARE.geometry.dofmap.links(k) if hasattr(SQUARE.geometry.dofmap, "links") else SQUARE.geometry.dofmap[k] for k in range(24)]
    )
    faces = np.unique(np.sort(cells[:, [[0, 1], [1, 2], [0, 2]]], axis=2).reshape(-1, 2), axis=0)
    # dolfinx interpolates at the middles of faces.
    middle = quadratic(*points[faces].mean(axis=1).T)
    reference = {"points": points, "cells": {"line": faces}, "cell_data": {"u": middle}}
    assert fo.compare(uh, reference, rtol=1e-13)
    middle[11] += 1e-6
    r = fo.compare(uh, reference)
    assert not r and np.allclose(r.worst["worst"]["midpoint"], points[faces[11]].mean(axis=0))


def test_what_cannot_be_compared_says_why():
    import basix
    import ufl

    if hasattr(ufl, "MixedElement"):
        element = ufl.MixedElement(ufl.VectorElement("P", ufl.triangle, 2), ufl.FiniteElement("P", ufl.triangle, 1))
        mixed = fem.Function(fem.FunctionSpace(SQUARE, element))
    else:
        import basix.ufl

        parts = [basix.ufl.element("P", "triangle", 2, shape=(2,)), basix.ufl.element("P", "triangle", 1)]
        mixed = fem.Function(fem.functionspace(SQUARE, basix.ufl.mixed_element(parts)))
    with pytest.raises(fo.UsageError, match="collapse"):
        fo.compare(mixed, sampled(linear))
    assert fo.compare(mixed.sub(0).collapse(), sampled(lambda x, y: np.zeros((len(x), 2)), 5, 2), atol=1e-12)
    assert basix
