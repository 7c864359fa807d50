"""-nu Laplace u + grad p = f,  div u = 0,  u = 0 at the left, bottom and top,  nu d_n u - p n = t at the right; CR and P0."""

from argparse import ArgumentParser
from pathlib import Path

import numpy as np
from dolfinx import fem, io
from dolfinx.fem.petsc import LinearProblem
from mpi4py import MPI
from numpy import cos, pi, sin
from ufl import Measure, TestFunctions, TrialFunctions, div, dx, grad, inner

from compat import function_space, mixed_space, read_msh

parser = ArgumentParser()
parser.add_argument("mesh")
parser.add_argument("out", type=Path)
parser.add_argument("--nu", type=float)
given = parser.parse_args()
nu = given.nu

mesh, boundary = read_msh(given.mesh, MPI.COMM_WORLD)
bottom, right, top, left = 1, 2, 3, 4
ds = Measure("ds", domain=mesh, subdomain_data=boundary)


def load(x):
    x, y, _ = x
    laplace_u1 = 2 * pi**2 * cos(2 * pi * x) * sin(2 * pi * y) - 4 * pi**2 * sin(pi * x) ** 2 * sin(2 * pi * y)
    laplace_u2 = 4 * pi**2 * sin(2 * pi * x) * sin(pi * y) ** 2 - 2 * pi**2 * sin(2 * pi * x) * cos(2 * pi * y)
    return np.vstack(
        [-nu * laplace_u1 - pi * sin(pi * x) * cos(pi * y), -nu * laplace_u2 - pi * cos(pi * x) * sin(pi * y)]
    )


# f and t are interpolated, so that every rule that is exact for polynomials gives the same right side.
F = function_space(mesh, "Lagrange", 2, size=2)
f, t = fem.Function(F), fem.Function(F)
f.interpolate(load)
t.interpolate(lambda x: np.vstack([cos(pi * x[1]), -2 * pi * nu * sin(pi * x[1]) ** 2]))

X = mixed_space(mesh, ("CR", 1), ("DG", 0))
V, _ = X.sub(0).collapse()
facets = np.concatenate([boundary.find(side) for side in (left, bottom, top)])
bc = fem.dirichletbc(fem.Function(V), fem.locate_dofs_topological((X.sub(0), V), 1, facets), X.sub(0))

(u, p), (v, q) = TrialFunctions(X), TestFunctions(X)
a = (nu * inner(grad(u), grad(v)) - p * div(v) - q * div(u)) * dx
L = inner(f, v) * dx + inner(t, v) * ds(right)
lu = {"ksp_type": "preonly", "pc_type": "lu", "pc_factor_mat_solver_type": "mumps"}
uh, ph = LinearProblem(a, L, bcs=[bc], petsc_options=lu).solve().split()

# VTU has no Crouzeix-Raviart elements: u as what it is on each triangle.
broken, constant = fem.Function(function_space(mesh, "DG", 1, size=2)), ph.collapse()
broken.interpolate(uh.collapse())
for name, function in (("u", broken), ("p", constant)):
    function.name = name
    with io.VTKFile(mesh.comm, str(given.out / f"{name}.pvd"), "w") as file:
        file.write_function(function)
