"""-nu Laplace u + grad p = f,  div u = 0,  u = 0 at the left, bottom and top,  nu d_n u - p n = t at the right; P2 and P1."""

from argparse import ArgumentParser
from pathlib import Path

import numpy as np
from dolfinx import fem, io
from dolfinx.fem.petsc import LinearProblem
from dolfinx.mesh import create_unit_square, locate_entities_boundary
from mpi4py import MPI
from ufl import SpatialCoordinate, TestFunctions, TrialFunctions, as_vector, cos, div, ds, dx, grad, inner, pi, sin

from compat import mixed_space

parser = ArgumentParser()
parser.add_argument("n", type=int)
parser.add_argument("out", type=Path)
parser.add_argument("--nu", type=float)
given = parser.parse_args()
nu = given.nu

mesh = create_unit_square(MPI.COMM_WORLD, given.n, given.n)
x, y = SpatialCoordinate(mesh)
laplace_u1 = 2 * pi**2 * cos(2 * pi * x) * sin(2 * pi * y) - 4 * pi**2 * sin(pi * x) ** 2 * sin(2 * pi * y)
laplace_u2 = 4 * pi**2 * sin(2 * pi * x) * sin(pi * y) ** 2 - 2 * pi**2 * sin(2 * pi * x) * cos(2 * pi * y)
grad_p = as_vector([-pi * sin(pi * x) * cos(pi * y), -pi * cos(pi * x) * sin(pi * y)])
f = -nu * as_vector([laplace_u1, laplace_u2]) + grad_p
t = as_vector([cos(pi * y), -2 * pi * nu * sin(pi * y) ** 2])  # v = 0 on the other sides

X = mixed_space(mesh, ("Lagrange", 2), ("Lagrange", 1))
V, _ = X.sub(0).collapse()
walls = locate_entities_boundary(mesh, 1, lambda x: np.isclose(x[0], 0) | np.isclose(x[1], 0) | np.isclose(x[1], 1))
bc = fem.dirichletbc(fem.Function(V), fem.locate_dofs_topological((X.sub(0), V), 1, walls), X.sub(0))

(u, p), (v, q) = TrialFunctions(X), TestFunctions(X)
a = (nu * inner(grad(u), grad(v)) - p * div(v) - q * div(u)) * dx
L = inner(f, v) * dx(degree=6) + inner(t, v) * ds(degree=6)
lu = {"ksp_type": "preonly", "pc_type": "lu", "pc_factor_mat_solver_type": "mumps"}
uh, ph = LinearProblem(a, L, bcs=[bc], petsc_options=lu).solve().split()

for name, function in (("u", uh.collapse()), ("p", ph.collapse())):
    function.name = name
    with io.VTKFile(mesh.comm, str(given.out / f"{name}.pvd"), "w") as file:
        file.write_function(function)
