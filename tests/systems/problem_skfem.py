"""The problems of problem.edp in scikit-fem, with the faults of problem.py: problem_skfem.py MESH OUT PROBLEM FAULT."""

import sys

import numpy as np
import scipy.sparse
import scipy.sparse.linalg
import skfem
from skfem import (
    BilinearForm,
    ElementTriN1,
    ElementTriP0,
    ElementTriP1,
    ElementTriP2,
    ElementTriRT0,
    ElementVector,
    LinearForm,
)
from skfem.helpers import ddot, div, dot, grad, sym_grad, transpose
from system import dofs, write_dofs, write_system

mesh = skfem.Mesh.load(sys.argv[1])
out, problem, fault = sys.argv[2], sys.argv[3], int(sys.argv[4])
of = lambda k, wrong, right: wrong if fault == k else right
sides = {1: "bottom", 2: "right", 3: "top", 4: "left"}
place = {1: lambda x: x[1] == 0, 2: lambda x: x[0] == 1, 3: lambda x: x[1] == 1, 4: lambda x: x[0] == 0}
facets = {k: mesh.facets_satisfying(place[k], boundaries_only=True) for k in sides}
elements = {
    "elasticity": {"u": ElementVector(ElementTriP2())},
    "stokes": {"u": ElementVector(ElementTriP2()), "p": ElementTriP1()},
    "darcy": {"q": ElementTriRT0(), "p": ElementTriP0()},
    "curl": {"E": ElementTriN1()},
    "convection": {"u": ElementTriP1()},
}[problem]
bases = {name: skfem.Basis(mesh, element, intorder=5) for name, element in elements.items()}
on = lambda name, side: skfem.FacetBasis(mesh, elements[name], facets=facets[side], intorder=5)
n = {name: (0 if k == 0 else next(iter(bases.values())).N) for k, name in enumerate(elements)}
N = sum(basis.N for basis in bases.values())
blocks, loads, values = [], [], {}


def add(rows, columns, form, side=None):
    """A bilinear form with the test functions of one field and the unknowns of another."""
    get = lambda name: bases[name] if side is None else on(name, side)
    block = BilinearForm(form).assemble(get(columns), get(rows)).tocoo()
    blocks.append(scipy.sparse.coo_matrix((block.data, (block.row + n[rows], block.col + n[columns])), (N, N)))


def load(rows, form, side=None):
    b = np.zeros(N)
    own = LinearForm(form).assemble(bases[rows] if side is None else on(rows, side))
    b[n[rows] : n[rows] + len(own)] = own
    loads.append(b)


if problem == "elasticity":
    E, nu = 2.1e11, 0.3
    lam, mu = E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))
    if fault == 2:
        lam, mu = mu, lam
    lam = of(3, 2 * lam * mu / (lam + 2 * mu), lam)
    mu = of(6, 1.01 * mu, mu)
    eps = of(7, grad, sym_grad)
    add("u", "u", lambda u, v, w: lam * div(u) * div(v) + 2 * mu * ddot(eps(u), eps(v)))
    load("u", lambda v, w: of(4, -1, of(10, 2, 1)) * 1e6 * w.x[1] * (1 - w.x[1]) * v[1], of(5, 4, 2))
    if fault == 8:
        add("u", "u", lambda u, v, w: 7.8e3 * dot(u, v))
    if fault == 9:
        add("u", "u", lambda u, v, w: 1e11 * dot(u, v), 1)
    if fault == 11:
        load("u", lambda v, w: -9.81 * 7.8e3 * v[1])
if problem == "stokes":
    mu = of(2, 1.01, 1) * 0.5
    strain = lambda u: grad(u) + transpose(grad(u)) if fault == 4 else grad(u)
    add("u", "u", lambda u, v, w: mu * ddot(strain(u), grad(v)))
    add("u", "p", lambda p, v, w: -of(11, 2, 1) * p * div(v))
    add("p", "u", lambda u, q, w: -of(3, -1, 1) * q * div(u))
    if fault == 8:
        add("p", "p", lambda p, q, w: -1e-3 * p * q)
    if fault == 9:
        add("u", "u", lambda u, v, w: grad(u)[0, 0] * v[0] + grad(u)[1, 0] * v[1])
    load("u", lambda v, w: of(5, -1, 1) * (w.x[0] * v[0] + of(10, 0, 1) * w.x[1] * v[1]))
    values = {("u", of(7, 1, 4)): lambda x: np.array([of(6, 2, 1) * x[1] * (1 - x[1]), 0 * x[0]])}
if problem == "darcy":
    K = of(2, 0.5, 0.25)
    add("q", "q", lambda u, v, w: dot(u, v) / K)
    add("q", "p", lambda p, v, w: -of(3, -1, 1) * p * div(v))
    add("p", "q", lambda u, q, w: -of(4, -1, 1) * q * div(u))
    if fault == 5:
        add("p", "p", lambda p, q, w: 0.5 * p * q)
    if fault == 6:
        add("q", "q", lambda u, v, w: 2 * u[0] * v[0])
    if fault == 9:
        add("q", "q", lambda u, v, w: 3 * dot(u, w.n) * dot(v, w.n), 2)
    if fault == 10:
        add("q", "q", lambda u, v, w: 0.1 * div(u) * div(v))
    load("p", lambda q, w: of(7, 2, -1) * q)
    load("q", lambda v, w: -of(8, 1, 3) * dot(v, w.n), of(11, 1, 3))
if problem == "curl":
    nu, c = of(2, 4.4, 4), of(3, 3.3, of(4, 0, of(5, -3, 3)))
    times = of(8, 2, 1)
    add("E", "E", lambda u, v, w: times * (nu * u.curl * v.curl + c * dot(u, v)))
    if fault == 6:
        add("E", "E", lambda u, v, w: 2 * (u[0] * v[1] - u[1] * v[0]))
    if fault == 7:
        add("E", "E", lambda u, v, w: 5 * (u[0] * w.n[1] - u[1] * w.n[0]) * (v[0] * w.n[1] - v[1] * w.n[0]), 3)
    load("E", lambda v, w: of(9, -1, 1) * (v[0] + 2 * v[1]) + of(10, 1, 0) * v[0])
    if fault == 11:
        load("E", lambda v, w: v[0] * w.n[1] - v[1] * w.n[0], 2)
if problem == "convection":
    kappa, c = of(2, 2.02, 2), of(5, 0, 5)
    wind = of(3, -1, 1) * np.array([3, 1])
    along = lambda u: wind[0] * grad(u)[0] + wind[1] * grad(u)[1]
    add("u", "u", lambda u, v, w: kappa * dot(grad(u), grad(v)) + along(u) * v + of(4, 5.5, c) * u * v)
    if fault == 6:
        add("u", "u", lambda u, v, w: 4 * u * v, 2)
    if fault == 7:
        add("u", "u", lambda u, v, w: 0.01 * along(u) * along(v))
    load("u", lambda v, w: of(8, 14, 7) * v)
    if fault == 9:
        load("u", lambda v, w: v, 3)
    values = {("u", of(11, 2, 4)): lambda x: of(10, 2, 1) * (1 + x[1])}

A, b = sum(blocks).tocsr(), sum(loads)
fields, eliminated = {}, np.zeros(N, bool)
g = np.zeros(N)
for name, basis in bases.items():
    size = {"u": 1 if problem == "convection" else 2, "q": 2, "E": 2, "p": 1}[name]
    if name in ("q", "E"):
        # Moments on facets by their values for constant fields: the normal or tangential component at the middle, times the length, with the sign of the basis.
        mass = BilinearForm(lambda u, v, w: dot(u, v)).assemble(basis)
        solve = scipy.sparse.linalg.factorized(mass.tocsc())
        interpolate = lambda f, solve=solve, basis=basis: solve(LinearForm(lambda v, w: dot(f(w.x.reshape(2, -1)).reshape(w.x.shape), v)).assemble(basis))
        # A linear field is none of this space: its moment is that of a constant at the middle of the facet.
        middle = mesh.p[:, mesh.facets].mean(1)
        d = np.array([interpolate(lambda x, k=k: np.array([np.ones(x.shape[1]) * (i == k) for i in range(2)])) for k in range(2)])
        at, direction = np.empty((basis.N, 2)), d.T
        at[basis.dofs.facet_dofs[0]] = middle.T
    else:

        def interpolate(f, basis=basis, size=size):
            v = np.asarray(f(basis.doflocs))
            if size == 1:
                return v
            u = np.empty(basis.N)
            for k in range(size):
                own = np.concatenate([table[k::size].ravel() for table in (basis.nodal_dofs, basis.facet_dofs) if table.size])
                u[own] = v[k][own]
            return u

        at, direction = dofs(interpolate, size)
    fields[name] = at, direction, np.arange(basis.N) + n[name]
    for (field, side), f in values.items():
        if field == name:
            found = basis.get_dofs(facets=facets[side]).flatten()
            g[found + n[name]] = interpolate(f)[found]
            eliminated[found + n[name]] = True
# Constrained rows are eliminated.
free = np.flatnonzero(~eliminated)
number = np.cumsum(~eliminated) - 1
b = (b - A @ g)[free]
keep = {}
for name, (at, direction, rows) in fields.items():
    own = ~eliminated[rows]
    keep[name] = at[own], direction[own], number[rows[own]]
write_system(out, A[free][:, free], b)
write_dofs(out, keep, len(b))
