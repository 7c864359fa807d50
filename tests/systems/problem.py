"""The problems of problem.edp in dolfinx 0.5, as they are or with one of ten faults: problem.py MESH OUT PROBLEM FAULT."""

import sys

import numpy as np
import scipy.sparse
import scipy.sparse.linalg
import ufl
from compat import read_msh
from dolfinx import fem
from dolfinx.fem.petsc import assemble_matrix, assemble_vector
from mpi4py import MPI
from system import dofs, write_dofs, write_system
from ufl import (
    FacetNormal,
    Identity,
    SpatialCoordinate,
    TestFunctions,
    TrialFunctions,
    as_vector,
    div,
    dot,
    dx,
    grad,
    inner,
    rot,
    sym,
    tr,
)

mesh, boundary = read_msh(sys.argv[1], MPI.COMM_WORLD)
out, problem, fault = sys.argv[2], sys.argv[3], int(sys.argv[4])
x, n = SpatialCoordinate(mesh), FacetNormal(mesh)
ds = ufl.Measure("ds", domain=mesh, subdomain_data=boundary)
of = lambda k, wrong, right: wrong if fault == k else right
element = lambda family, degree: ufl.FiniteElement(family, "triangle", degree)
values = {}  # Dirichlet values by field, side


def space(**parts):
    """Names of fields and their elements."""
    mixed = len(parts) > 1
    V = fem.FunctionSpace(mesh, ufl.MixedElement(list(parts.values())) if mixed else next(iter(parts.values())))
    return V, TrialFunctions(V) if mixed else [ufl.TrialFunction(V)], TestFunctions(V) if mixed else [ufl.TestFunction(V)]


if problem == "elasticity":
    names = ["u"]
    E, nu = 2.1e11, 0.3
    lam, mu = E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))
    if fault == 2:
        lam, mu = mu, lam
    lam = of(3, 2 * lam * mu / (lam + 2 * mu), lam)
    mu = of(6, 1.01 * mu, mu)
    V, (u,), (v,) = space(u=ufl.VectorElement("Lagrange", "triangle", 2))
    eps = lambda u: of(7, grad(u), sym(grad(u)))
    a = inner(lam * tr(eps(u)) * Identity(2) + 2 * mu * eps(u), eps(v)) * dx
    L = of(4, -1, of(10, 2, 1)) * 1e6 * x[1] * (1 - x[1]) * v[1] * ds(of(5, 4, 2))
    if fault == 8:
        a += 7.8e3 * dot(u, v) * dx
    if fault == 9:
        a += 1e11 * dot(u, v) * ds(1)
    if fault == 11:
        L += -9.81 * 7.8e3 * v[1] * dx
if problem == "stokes":
    names = ["u", "p"]
    V, (u, p), (v, q) = space(u=ufl.VectorElement("Lagrange", "triangle", 2), p=element("Lagrange", 1))
    mu = of(2, 1.01, 1) * 0.5
    strain = of(4, 2 * sym(grad(u)), grad(u))
    a = (inner(mu * strain, grad(v)) - of(11, 2, 1) * p * div(v) - of(3, -1, 1) * q * div(u)) * dx
    if fault == 8:
        a += -1e-3 * p * q * dx
    if fault == 9:
        a += dot(dot(grad(u), as_vector([1, 0])), v) * dx
    L = of(5, -1, 1) * (x[0] * v[0] + of(10, 0, 1) * x[1] * v[1]) * dx
    values = {("u", of(7, 1, 4)): lambda x: np.array([of(6, 2, 1) * x[1] * (1 - x[1]), 0 * x[0]])}
if problem == "darcy":
    names = ["q", "p"]
    V, (u, p), (v, q) = space(q=element("RT", 1), p=element("DG", 0))
    K = of(2, 0.5, 0.25)
    a = (dot(u, v) / K - of(3, -1, 1) * p * div(v) - of(4, -1, 1) * q * div(u)) * dx
    if fault == 5:
        a += 0.5 * p * q * dx
    if fault == 6:
        a += 2 * u[0] * v[0] * dx
    if fault == 9:
        a += 3 * dot(u, n) * dot(v, n) * ds(2)
    if fault == 10:
        a += 0.1 * div(u) * div(v) * dx
    L = of(7, 2, -1) * q * dx - of(8, 1, 3) * dot(v, n) * ds(of(11, 1, 3))
if problem == "curl":
    names = ["E"]
    V, (u,), (v,) = space(E=element("N1curl", 1))
    nu, c = of(2, 4.4, 4), of(3, 3.3, of(4, 0, of(5, -3, 3)))
    a = (nu * rot(u) * rot(v) + c * dot(u, v)) * dx
    if fault == 6:
        a += 2 * (u[0] * v[1] - u[1] * v[0]) * dx
    if fault == 7:
        a += 5 * (u[0] * n[1] - u[1] * n[0]) * (v[0] * n[1] - v[1] * n[0]) * ds(3)
    if fault == 8:
        a = 2 * a
    L = (of(9, -1, 1) * (v[0] + 2 * v[1]) + of(10, 1, 0) * v[0]) * dx
    if fault == 11:
        L += (v[0] * n[1] - v[1] * n[0]) * ds(2)
if problem == "convection":
    names = ["u"]
    V, (u,), (v,) = space(u=element("Lagrange", 1))
    kappa, c = of(2, 2.02, 2), of(5, 0, 5)
    w = as_vector([of(3, -3, 3), of(3, -1, 1)])
    a = (kappa * dot(grad(u), grad(v)) + dot(w, grad(u)) * v + of(4, 5.5, c) * u * v) * dx
    if fault == 6:
        a += 4 * u * v * ds(2)
    if fault == 7:
        a += 0.01 * dot(w, grad(u)) * dot(w, grad(v)) * dx
    L = of(8, 14, 7) * v * dx + of(9, 1, 0) * v * ds(3)
    values = {("u", of(11, 2, 4)): lambda x: of(10, 2, 1) * (1 + x[1])}

A, b = assemble_matrix(fem.form(a)), assemble_vector(fem.form(L)).array
A.assemble()
i, j, entries = A.getValuesCSR()
A = scipy.sparse.csr_matrix((entries, j, i), (len(b), len(b)))
fields, g, held = {}, np.zeros(len(b)), np.zeros(len(b), bool)
for k, name in enumerate(names):
    own, rows = (V, np.arange(len(b))) if len(names) == 1 else V.sub(k).collapse()
    w = fem.Function(own)

    def interpolate(f, w=w):
        w.interpolate(f)
        return w.x.array.copy()

    size = ufl.FiniteElement.value_shape(own.ufl_element())
    fields[name] = *dofs(interpolate, size[0] if size else 1), np.asarray(rows)
    for (field, side), f in values.items():
        if field == name:
            part = V.sub(k) if len(names) > 1 else V
            found = boundary.find(side)
            both = fem.locate_dofs_topological((part, own) if len(names) > 1 else V, 1, found)
            there, here = both if len(names) > 1 else (both, both)
            bs = 1 if len(names) > 1 else V.dofmap.index_map_bs
            held[there], g[there] = True, interpolate(f)[here]
# Constrained rows of the identity, symmetrically.
b = np.where(held, g, b - A @ g)
keep = scipy.sparse.diags((~held).astype(float))
A = keep @ A @ keep + scipy.sparse.diags(held.astype(float))
write_system(out, A, b)
write_dofs(out, fields, len(b))
if problem == "convection":
    u = scipy.sparse.linalg.spsolve(A.tocsc(), b)
    table = np.column_stack([fields["u"][0], u])
    np.savetxt(f"{out}/u.csv", table, delimiter=",", header="x,y,u", comments="")
