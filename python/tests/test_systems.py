"""Linear systems."""

import numpy as np
import pytest

import faceoff_fem as fo

scipy_sparse = pytest.importorskip("scipy.sparse")


def rod(n=8, kappa=1.0, order=None):
    """-κ u'' = 1 in P1, with its table of dofs."""
    order = np.arange(n + 1) if order is None else order
    K = scipy_sparse.diags([-np.ones(n), np.r_[1, 2 * np.ones(n - 1), 1], -np.ones(n)], [-1, 0, 1]).tocsr() * n * kappa
    b = np.r_[0.5, np.ones(n - 1), 0.5] / n
    return K[order][:, order], b[order], {"x": np.linspace(0, 1, n + 1)[order]}


def test_the_order_of_rows_does_not_matter():
    found = fo.compare_systems(rod(), rod(order=np.arange(8, -1, -1)))
    assert found.agree and found
    assert "equal" in str(found)


def test_a_factor_is_found():
    found = fo.compare_systems(rod(), rod(kappa=1.01), volume=1.0)
    assert not found
    (block,) = found.to_dict()["systems"]["matrix"]
    assert block["factor"] == pytest.approx(1.01, rel=1e-13)
    (energy,) = found.to_dict()["systems"]["energies"]
    assert energy["values"] == pytest.approx([1.0, 1.01])


def test_a_dense_matrix_and_other_places_are_taken_as_they_are():
    A, b, dofs = rod()
    assert fo.compare_systems((A.toarray(), b, dofs), rod())
    with pytest.raises(fo.Error, match="no partner"):
        fo.compare_systems((A, b, {"x": dofs["x"] + 0.01}), rod())
    with pytest.raises(fo.UsageError, match="colour"):
        fo.compare_systems((A, b, {**dofs, "colour": b}), rod())
    with pytest.raises(fo.UsageError, match="no sparse matrix"):
        fo.compare_systems(("A", b, dofs), rod())
    with pytest.raises(fo.Error, match="not finite"):
        fo.compare_systems((A, b * np.nan, dofs), rod())


def test_dofs_of_a_space_of_dolfinx_are_made_by_interpolation():
    pytest.importorskip("dolfinx")
    from dolfinx import fem, mesh
    from dolfinx.fem.petsc import assemble_matrix, assemble_vector
    from mpi4py import MPI
    from ufl import TestFunction, TrialFunction, as_vector, div, dot, dx

    def system(n, kappa):
        square = mesh.create_unit_square(MPI.COMM_WORLD, n, n)
        V = getattr(fem, "functionspace", fem.FunctionSpace)(square, ("RT", 1))
        u, v = TrialFunction(V), TestFunction(V)
        A = assemble_matrix(fem.form((kappa * dot(u, v) + div(u) * div(v)) * dx))
        A.assemble()
        return A, assemble_vector(fem.form(dot(as_vector([1, 2]), v) * dx)), V

    assert fo.compare_systems(system(4, 1.0), system(4, 1.0))
    assert not fo.compare_systems(system(4, 1.0), system(4, 1.1))
