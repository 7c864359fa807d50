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


def test_dofs_of_a_basis_of_scikit_fem_are_made_by_projection():
    skfem = pytest.importorskip("skfem")
    from skfem.helpers import div, dot

    def system(n, kappa, elements, turned=False):
        mesh = skfem.MeshTri().refined(n)
        if turned:  # other numbers of vertices and cells, and so other signs of moments
            order = np.arange(mesh.nvertices)[::-1]
            mesh = skfem.MeshTri(mesh.p[:, order], np.sort(order[mesh.t], axis=0)[:, ::-1])
        basis = skfem.Basis(mesh, elements, intorder=4)
        mixed = hasattr(elements, "elems")
        if mixed:
            a = skfem.BilinearForm(lambda q, p, w, r, _: kappa * dot(q, w) - p * div(w) - r * div(q))
            b = skfem.LinearForm(lambda w, r, _: _.x[0] * r)
        else:
            a = skfem.BilinearForm(lambda q, w, _: kappa * dot(q, w) + div(q) * div(w))
            b = skfem.LinearForm(lambda w, _: w[0] + 2 * w[1])
        return a.assemble(basis), b.assemble(basis), basis

    for elements in (skfem.ElementTriRT0(), skfem.ElementTriRT0() * skfem.ElementTriP0(), skfem.ElementVector(skfem.ElementTriP2())):
        right = fo.compare_systems(system(1, 1.0, elements), system(1, 1.0, elements, turned=True))
        assert right, str(right)
        assert not fo.compare_systems(system(1, 1.0, elements), system(1, 1.1, elements, turned=True))


def test_a_system_is_written_as_a_face_off_reads_it(tmp_path):
    scipy_io = pytest.importorskip("scipy.io")
    A, b, dofs = rod()
    fo.write_system(tmp_path, A, b, {**dofs, "value": b})
    assert abs(scipy_io.mmread(tmp_path / "A.mtx") - A).max() == 0
    assert (scipy_io.mmread(tmp_path / "b.mtx")[:, 0] == b).all()
    lines = (tmp_path / "dofs.csv").read_text().splitlines()
    assert lines[0] == "field,x,y,z,dx,dy,dz,value" and lines[2] == "u,0.125,0.0,0.0,1.0,0.0,0.0,0.125"


def test_moments_of_ngsolve_are_those_of_scikit_fem():
    ng, skfem = pytest.importorskip("ngsolve"), pytest.importorskip("skfem")
    from ngsolve.meshes import MakeStructured2DMesh
    from skfem.helpers import curl, div, dot

    square = MakeStructured2DMesh(quads=False, nx=3, ny=3)
    points = np.array([v.point for v in square.vertices])
    cells = np.array([[v.nr for v in e.vertices] for e in square.Elements(ng.VOL)])
    mesh = skfem.MeshTri(points.T, cells.T)

    def of_ngsolve(V, kappa, derivative):
        u, v = V.TnT()
        a = ng.BilinearForm((kappa * u * v + derivative(u) * derivative(v)) * ng.dx).Assemble()
        return a.mat, ng.LinearForm(v[0] * ng.dx).Assemble().vec, V

    def of_skfem(element, derivative):
        basis = skfem.Basis(mesh, element, intorder=3)
        a = skfem.BilinearForm(lambda u, v, w: dot(u, v) + derivative(u) * derivative(v)).assemble(basis)
        return a, skfem.LinearForm(lambda v, w: v[0]).assemble(basis), basis

    for V, element, derivatives in (
        (ng.HDiv(square, order=0, RT=True), skfem.ElementTriRT0(), (ng.div, div)),
        (ng.HCurl(square, order=0), skfem.ElementTriN1(), (ng.curl, curl)),
    ):
        other = of_skfem(element, derivatives[1])
        right = fo.compare_systems(of_ngsolve(V, 1.0, derivatives[0]), other)
        assert right, str(right)
        assert not fo.compare_systems(of_ngsolve(V, 1.1, derivatives[0]), other)
