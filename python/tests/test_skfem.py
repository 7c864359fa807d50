"""scikit-fem, alone."""

import numpy as np
import pytest
import skfem
from common import cubes, cubic, jumping, linear, quadratic, sampled, square

import faceoff_fem as fo

TRI = skfem.MeshTri(*[np.ascontiguousarray(a.T) for a in square(4, skew=0.2)])
TET = skfem.MeshTet().refined(1)


def interpolant(mesh, element, formula):
    basis = skfem.Basis(mesh, element)
    return basis, basis.project(lambda x: formula(*x))


@pytest.mark.parametrize(
    "mesh, element, formula",
    [
        (TRI, skfem.ElementTriP1(), linear),
        (TRI, skfem.ElementTriP2(), quadratic),
        (TRI, skfem.ElementTriP4(), cubic),
        (TRI, skfem.ElementTriMini(), linear),
        (TRI, skfem.ElementTriArgyris(), cubic),
        (TRI, skfem.ElementDG(skfem.ElementTriP2()), quadratic),
        (TRI, skfem.ElementTriCR(), linear),
        (skfem.MeshQuad().refined(2), skfem.ElementQuad2(), quadratic),
    ],
)
def test_functions_equal_the_formula_on_another_mesh(mesh, element, formula):
    uh = interpolant(mesh, element, formula)
    options = {"rtol": 1e-9, "map": "functions"}
    if formula is cubic:
        basis = skfem.Basis(TRI.refined(), skfem.ElementTriP3())
        reference = basis, cubic(*basis.doflocs)
    else:
        reference = sampled(formula, 5, 2)
    assert fo.compare(uh, reference, **options)
    basis, x = uh
    wrong = x.copy()
    wrong[basis.element_dofs[:, 3]] = wrong[basis.element_dofs[::-1, 3]]
    wrong[basis.element_dofs[0, 0]] += 1e-3
    assert not fo.compare((basis, wrong), reference, **options)


@pytest.mark.parametrize(
    "element, formula", [(skfem.ElementTetP1(), linear), (skfem.ElementTetP2(), quadratic), (skfem.ElementTetCR(), linear)]
)
def test_tetrahedra(element, formula):
    uh = interpolant(TET, element, formula)
    assert fo.compare(uh, cubes(formula), rtol=1e-9, map="functions")
    wrong = uh[1].copy()
    wrong[uh[0].element_dofs[:2, 0]] = wrong[uh[0].element_dofs[1::-1, 0]]
    assert not fo.compare((uh[0], wrong), cubes(formula), rtol=1e-6, map="functions")


def test_hexahedra_and_constants():
    mesh = skfem.MeshHex().refined(1)
    basis = skfem.Basis(mesh, skfem.ElementHex2())
    mesh_of_it = fo.Mesh((basis, quadratic(*basis.doflocs)))
    assert mesh_of_it.cells[0][0] == "hexahedron27"
    assert np.abs(mesh_of_it["u"] - quadratic(*mesh_of_it.points.T)).max() < 1e-12
    basis = skfem.Basis(TRI, skfem.ElementTriP0())
    x = np.arange(basis.N, dtype=float)
    constants = fo.Mesh((basis, x))
    assert constants.fields[0].on == "cells" and np.array_equal(constants["u"], x)
    middles = constants.points[constants.cells[0][1]].mean(axis=1)[:, :2]
    assert np.abs(middles - TRI.p[:, TRI.t].mean(axis=1).T).max() < 1e-14


def test_curved_cells_keep_their_nodes():
    basis = skfem.Basis(skfem.MeshTri2.init_circle(2), skfem.ElementTriP2())
    found = fo.Mesh((basis, quadratic(*basis.doflocs)))
    assert found.cells[0][0] == "triangle6" and abs(np.hypot(*found.points[:, :2].T).max() - 1) < 1e-12
    assert np.abs(found["u"] - quadratic(*found.points[:, :2].T)).max() < 1e-12


def test_vectors_and_parts_of_mixed_functions():
    basis = skfem.Basis(TRI, skfem.ElementVector(skfem.ElementTriP2()))
    x = basis.project(lambda p: np.stack([quadratic(*p), linear(*p)]))
    reference = sampled(lambda x, y: np.stack([quadratic(x, y), linear(x, y)], axis=1), 5, 2)
    assert fo.compare((basis, x), reference, rtol=1e-9)
    turned = sampled(lambda x, y: np.stack([linear(x, y), quadratic(x, y)], axis=1), 5, 2)
    assert not fo.compare((basis, x), turned, rtol=1e-3)
    raviart = skfem.Basis(TRI, skfem.ElementTriRT0())
    y = raviart.project(lambda p: np.stack([1 + 0 * p[0], 2 + 0 * p[0]]))
    constant = sampled(lambda x, y: np.stack([1 + 0 * x, 2 + 0 * x], axis=1), 5)
    assert fo.compare((raviart, y), constant, rtol=1e-9, map="functions")
    mixed = skfem.Basis(TRI, skfem.ElementTriP2() * skfem.ElementTriP1())
    z = mixed.zeros()
    with pytest.raises(fo.UsageError, match="split"):
        fo.compare((mixed, z), reference)
    for part, of in zip(mixed.split(z), mixed.split_bases()):
        assert fo.compare((of, part[0] if isinstance(part, tuple) else part), (of, np.zeros(of.N)), atol=1e-15)


def test_discontinuous_functions_keep_their_jumps():
    mesh = skfem.MeshTri().refined(3)
    basis = skfem.Basis(mesh, skfem.ElementDG(skfem.ElementTriP1()))
    x = basis.project(lambda p: jumping(*p))
    places = mesh.p[:, mesh.t].T
    middles = places.mean(axis=1, keepdims=True)
    values = linear(places[..., 0], places[..., 1]) + (middles[..., 0] > 0.5)
    cells = np.arange(3 * mesh.t.shape[1]).reshape(-1, 3)
    file = {"points": places.reshape(-1, 2), "cells": {"triangle": cells}, "point_data": {"u": values.ravel()}}
    assert fo.compare((basis, x), file, rtol=1e-9)
    file["point_data"]["u"] = linear(*places.reshape(-1, 2).T)
    assert not fo.compare((basis, x), file, rtol=1e-3)


def test_a_crouzeix_raviart_function_is_compared_face_by_face():
    uh = interpolant(TRI, skfem.ElementTriCR(), quadratic)
    faces = TRI.facets.T
    reference = {"points": TRI.p.T, "cells": {"line": faces}, "cell_data": {"u": uh[1].copy()}}
    assert fo.compare(uh, reference, rtol=1e-14)
    assert fo.compare(uh, reference).fields[0]["on"] == "cells"
    other = uh[1].copy()
    other[7] += 1e-6
    r = fo.compare(uh, {**reference, "cell_data": {"u": other}})
    assert not r and np.allclose(r.worst["worst"]["midpoint"], TRI.p[:, faces[7]].mean(axis=1), atol=1e-12)


def test_the_name_is_that_of_the_other_side(tmp_path):
    uh = interpolant(TRI, skfem.ElementTriP1(), linear)
    reference = {"points": TRI.p.T, "cells": {"triangle": TRI.t.T}, "point_data": {"height": linear(*TRI.p)}}
    fo.write(tmp_path / "h.vtu", reference)
    assert fo.compare(uh, tmp_path / "h.vtu")
    fo.write(tmp_path / "two.vtu", {**reference, "point_data": {"a": TRI.p[0], "b": linear(*TRI.p)}})
    with pytest.raises(fo.UsageError, match="a, b"):
        fo.compare(uh, tmp_path / "two.vtu")
    assert fo.compare(uh, tmp_path / "two.vtu", name="b")
    with pytest.raises(fo.UsageError, match="values for"):
        fo.compare((uh[0], uh[1][1:]), tmp_path / "h.vtu")
