"""The modes of the cavity by dolfinx and SLEPc, as discontinuous functions."""

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
V = fem.FunctionSpace(domain, ("N1curl", 1))
u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
facets = mesh.locate_entities_boundary(domain, 1, lambda x: np.full(x.shape[1], True))
held = fem.dirichletbc(fem.Function(V), fem.locate_dofs_topological(V, 1, facets))
A = fem.petsc.assemble_matrix(fem.form(ufl.rot(u) * ufl.rot(v) * ufl.dx), bcs=[held], diagonal=1e6)
B = fem.petsc.assemble_matrix(fem.form(ufl.inner(u, v) * ufl.dx), bcs=[held], diagonal=1.0)
A.assemble()
B.assemble()
solver = SLEPc.EPS().create(domain.comm)
solver.setOperators(A, B)
solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
solver.getST().setType(SLEPc.ST.Type.SINVERT)
solver.setTarget(-1.0)
solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
solver.setDimensions(count)
solver.setTolerances(1e-14, 1000)
solver.solve()
broken = fem.VectorFunctionSpace(domain, ("DG", 1))
rows = []
for k in range(count):
    mode, shown = fem.Function(V), fem.Function(broken)
    rows.append(f"lambda{k + 1},{solver.getEigenpair(k, mode.vector).real!r}\n")
    shown.interpolate(mode)
    shown.name = f"m{k + 1}"
    with io.VTKFile(domain.comm, str(out / f"m{k + 1}.pvd"), "w") as file:
        file.write_function(shown)
(out / "numbers.csv").write_text("".join(rows))
