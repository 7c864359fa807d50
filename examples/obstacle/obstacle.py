"""-Laplace u = lambda,  u >= psi,  lambda >= 0,  lambda (u - psi) = 0,  u = g on the boundary; in P1, by a primal-dual active set."""

import sys
from pathlib import Path

import numpy as np
from dolfinx import fem, io
from dolfinx.fem.petsc import LinearProblem, assemble_vector
from mpi4py import MPI
from ufl import TestFunction, TrialFunction, dx, grad, inner

from compat import function_space, read_msh

mesh, boundary = read_msh(sys.argv[1], MPI.COMM_WORLD)
out = Path(sys.argv[2])

a = 0.697965148223374  # radius of the contact set; u = A log(2/r) beyond it
A = a**2 / np.sqrt(1 - a**2)


def r(x):
    return np.hypot(x[0], x[1])


def hemisphere(x):  # beyond 0.9 its tangent
    return np.where(r(x) < 0.9, np.sqrt(np.maximum(1 - r(x) ** 2, 0)), (1 - 0.9 * r(x)) / np.sqrt(1 - 0.81))


V = function_space(mesh, "Lagrange", 1)
psi, g, zero = fem.Function(V), fem.Function(V), fem.Function(V)
psi.interpolate(hemisphere)
g.interpolate(lambda x: A * np.log(2 / np.maximum(r(x), 1e-300)))
fixed = fem.locate_dofs_topological(V, 1, boundary.find(1))
on_boundary = fem.dirichletbc(g, fixed)
free = np.ones(len(psi.x.array), bool)
free[fixed] = False

u, v = TrialFunction(V), TestFunction(V)
m = assemble_vector(fem.form(v * dx)).array
active = np.zeros(len(free), bool)
for step in range(100):
    in_contact = fem.dirichletbc(psi, np.flatnonzero(active).astype(np.int32))
    lu = {"ksp_type": "preonly", "pc_type": "lu"}
    uh = LinearProblem(inner(grad(u), grad(v)) * dx, zero * v * dx, [on_boundary, in_contact], petsc_options=lu).solve()
    lambda_ = assemble_vector(fem.form(inner(grad(uh), grad(v)) * dx)).array

    before = active
    active = free & np.where(before, lambda_ > 0, uh.x.array < psi.x.array)
    if (active == before).all():
        break
else:
    sys.exit("the active set still changes after 100 steps")

force, area = float(lambda_[active].sum()), float(m[active].sum())
(out / "numbers.csv").write_text(f"force,{force!r}\narea,{area!r}\n")

pressure = fem.Function(V)
pressure.x.array[:] = active * lambda_ / m
for name, function in (("u", uh), ("pressure", pressure)):
    function.name = name
    with io.VTKFile(mesh.comm, str(out / f"{name}.pvd"), "w") as file:
        file.write_function(function)
