"""The same modes by dolfinx and SLEPc."""

import sys
from pathlib import Path

import numpy as np
import ufl
from dolfinx import fem, io, mesh
from mpi4py import MPI
from slepc4py import SLEPc

lines = iter(Path(sys.argv[1]).read_text().splitlines())
tables = {line: [next(lines).split() for _ in range(int(next(lines)))] for line in lines if line in ("$Nodes", "$Elements")}
points = np.array([row[1:3] for row in tables["$Nodes"]], float)
cells = np.array([row[-3:] for row in tables["$Elements"] if row[1] == "2"], int) - 1
domain = mesh.create_mesh(MPI.COMM_WORLD, cells, points, ufl.Mesh(ufl.VectorElement("Lagrange", "triangle", 1)))
out, count = Path(sys.argv[2]), int(sys.argv[3])
V = fem.FunctionSpace(domain, ("Lagrange", 2))
u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
facets = mesh.locate_entities_boundary(domain, 1, lambda x: np.full(x.shape[1], True))
held = fem.dirichletbc(0.0, fem.locate_dofs_topological(V, 1, facets), V)
A = fem.petsc.assemble_matrix(fem.form(ufl.inner(ufl.grad(u), ufl.grad(v)) * ufl.dx), bcs=[held])
B = fem.petsc.assemble_matrix(fem.form(u * v * ufl.dx), bcs=[held], diagonal=0.0)
A.assemble()
B.assemble()
solver = SLEPc.EPS().create(domain.comm)
solver.setOperators(A, B)
solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
solver.getST().setType(SLEPc.ST.Type.SINVERT)
solver.setTarget(0.5)
solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
solver.setDimensions(count)
solver.setTolerances(1e-14, 1000)
solver.solve()
rows = []
for k in range(count):
    mode = fem.Function(V)
    rows.append(f"lambda{k + 1},{solver.getEigenpair(k, mode.vector).real!r}\n")
    mode.name = f"m{k + 1}"
    with io.VTKFile(domain.comm, str(out / f"m{k + 1}.pvd"), "w") as file:
        file.write_function(mode)
(out / "numbers.csv").write_text("".join(rows))
