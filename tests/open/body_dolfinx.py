"""The same body by dolfinx, pinned by three dofs at the two corners above."""

import sys
from pathlib import Path

import numpy as np
import ufl
from dolfinx import fem, io, mesh
from mpi4py import MPI
from petsc4py import PETSc

out, mu = Path(sys.argv[2]), float(sys.argv[3])
lines = iter(Path(sys.argv[1]).read_text().splitlines())
tables = {line: [next(lines).split() for _ in range(int(next(lines)))] for line in lines if line in ("$Nodes", "$Elements")}
points = np.array([row[1:3] for row in tables["$Nodes"]], float)
cells = np.array([row[-3:] for row in tables["$Elements"] if row[1] == "2"], int) - 1
domain = mesh.create_mesh(MPI.COMM_WORLD, cells, points, ufl.Mesh(ufl.VectorElement("Lagrange", "triangle", 1)))
V = fem.VectorFunctionSpace(domain, ("Lagrange", 1))
u, v, n, x = ufl.TrialFunction(V), ufl.TestFunction(V), ufl.FacetNormal(domain), ufl.SpatialCoordinate(domain)
ends = mesh.locate_entities_boundary(domain, 1, lambda x: np.isclose(x[0], 0) | np.isclose(x[0], 1))
tags = mesh.meshtags(domain, 1, np.sort(ends), np.full(len(ends), 7, np.int32))
ds = ufl.Measure("ds", domain, subdomain_data=tags, metadata={"quadrature_degree": 4})
a = 2 * mu * ufl.inner(ufl.sym(ufl.grad(u)), ufl.sym(ufl.grad(v))) * ufl.dx + ufl.div(u) * ufl.div(v) * ufl.dx
L = n[0] * (1 + x[1] ** 2) * v[0] * ds(7)
zero = fem.Constant(domain, PETSc.ScalarType(0))


def pin(place, component):
    at = lambda x: np.isclose(x[0], place[0]) & np.isclose(x[1], place[1])
    W, _ = V.sub(component).collapse()
    dofs = fem.locate_dofs_geometrical((V.sub(component), W), at)
    return fem.dirichletbc(zero, dofs[0], V.sub(component))


pins = [pin((1, 1), 0), pin((1, 1), 1), pin((0, 1), 1)]
uh = fem.petsc.LinearProblem(a, L, bcs=pins, petsc_options={"ksp_type": "preonly", "pc_type": "lu"}).solve()
uh.name = "u"
with io.VTKFile(domain.comm, str(out / "u.pvd"), "w") as file:
    file.write_function(uh)
