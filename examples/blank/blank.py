"""Put your problem here; it reads the mesh, and writes what is compared."""

import sys
from pathlib import Path

import numpy as np
from dolfinx import fem, io
from dolfinx.fem.petsc import LinearProblem
from mpi4py import MPI
from ufl import TestFunction, TrialFunction, dx, grad, inner

from compat import function_space, read_msh

mesh, boundary = read_msh(sys.argv[1], MPI.COMM_WORLD)
out, k = Path(sys.argv[2]), float(sys.argv[3])

V = function_space(mesh, "Lagrange", 2)
u, v = TrialFunction(V), TestFunction(V)
bc = fem.dirichletbc(np.float64(0), fem.locate_dofs_topological(V, 1, boundary.find(1)), V)
one = fem.Constant(mesh, np.float64(1))
solver = {"ksp_type": "preonly", "pc_type": "lu"}
uh = LinearProblem(k * inner(grad(u), grad(v)) * dx, one * v * dx, bcs=[bc], petsc_options=solver).solve()

uh.name = "u"
with io.VTKFile(mesh.comm, str(out / "u.pvd"), "w") as file:
    file.write_function(uh)
total, area = (fem.assemble_scalar(fem.form(w * dx)) for w in (uh, one))
(out / "numbers.csv").write_text(f"mean,{total / area!r}\n")
