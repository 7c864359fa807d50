"""An elastic cylinder on a rigid plane: -div sigma(u) = 0, contact on the arc, pressed down from the top, symmetric in x; P2.

Nitsche's method of Chouly, Hild, Renard, with e = (0, -1) towards the plane, gap = y, s(u) = e.sigma(u)n (minus the pressure),
gamma = gamma0 h/E, P(u) = u.e - gap - gamma s(u): for all v that keep the symmetry
  a(u, v) - <theta gamma s(u), s(v)> + <1/gamma [P(u)]_+, v.e - theta gamma s(v)> = <t, v>_top.
"""

import sys
from argparse import ArgumentParser
from pathlib import Path

import numpy as np
from dolfinx import fem, io
from dolfinx.fem.petsc import LinearProblem
from mpi4py import MPI
from ufl import (
    CellDiameter,
    FacetNormal,
    Identity,
    Measure,
    SpatialCoordinate,
    TestFunction,
    TrialFunction,
    as_vector,
    conditional,
    dot,
    dx,
    grad,
    gt,
    inner,
    lhs,
    rhs,
    sym,
    tr,
)

from compat import function_space, read_msh

parser = ArgumentParser()
parser.add_argument("mesh")
parser.add_argument("out", type=Path)
for name in ("--E", "--nu", "--F", "--gamma0", "--theta"):
    parser.add_argument(name, type=float)
given = parser.parse_args()
E, nu, F, theta = given.E, given.nu, given.F, given.theta

mesh, boundary = read_msh(given.mesh, MPI.COMM_WORLD)
contact, top, axis = 1, 2, 3
ds = Measure("ds", domain=mesh, subdomain_data=boundary, metadata={"quadrature_degree": 5})  # three points of Gauss

lambda_, mu = E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))
y = SpatialCoordinate(mesh)[1]
n, e = FacetNormal(mesh), as_vector([0, -1])
gamma = given.gamma0 * CellDiameter(mesh) / E


def epsilon(u):
    return sym(grad(u))


def sigma(u):
    return lambda_ * tr(epsilon(u)) * Identity(2) + 2 * mu * epsilon(u)


def s(u):
    return dot(e, sigma(u) * n)


def P(u):
    return dot(u, e) - y - gamma * s(u)


V = function_space(mesh, "Lagrange", 2, size=2)
u, v, w = TrialFunction(V), TestFunction(V), fem.Function(V)
in_contact = conditional(gt(P(w), 0), 1.0, 0.0)
form = (
    inner(sigma(u), epsilon(v)) * dx
    - theta * gamma * s(u) * s(v) * ds(contact)
    + in_contact / gamma * P(u) * (dot(v, e) - theta * gamma * s(v)) * ds(contact)
    - F / 2 * dot(e, v) * ds(top)
)
# the first component of nodes on the axis
X, _ = V.sub(0).collapse()
on_axis = fem.locate_dofs_topological((V.sub(0), X), 1, boundary.find(axis))
bc = fem.dirichletbc(fem.Function(X), on_axis, V.sub(0))
newton = LinearProblem(lhs(form), rhs(form), bcs=[bc], petsc_options={"ksp_type": "preonly", "pc_type": "lu"})

w.x.array[1::2] = -0.01  # starts by pressing it into the plane
for step in range(50):
    uh = newton.solve()
    increment = abs(uh.x.array - w.x.array).max()
    w.x.array[:] = uh.x.array
    if increment < 1e-11 * abs(w.x.array).max():
        break
else:
    sys.exit("Newton's method does not end")


def integral(f):
    return fem.assemble_scalar(fem.form(f * ds(contact)))


pressure = conditional(gt(P(w), 0), P(w), 0.0) / gamma
half, second = integral(pressure), integral(pressure * SpatialCoordinate(mesh)[0] ** 2)
numbers = {
    "force": 2 * half,
    "half-width": 2 * np.sqrt(second / half),
    "peak": 3 * np.pi / 8 * integral(pressure**2) / half,
}
(given.out / "numbers.csv").write_text("".join(f"{name},{value:.17g}\n" for name, value in numbers.items()))

w.name = "u"
with io.VTKFile(mesh.comm, str(given.out / "u.pvd"), "w") as file:
    file.write_function(w)
