"""The same modes by scikit-fem and ARPACK."""

import sys

import meshio
import numpy as np
from scipy.sparse.linalg import eigsh
from skfem import Basis, ElementTriP2, MeshTri, condense
from skfem.models.poisson import laplace, mass

read = meshio.read(sys.argv[1])
out, count = sys.argv[2], int(sys.argv[3])
basis = Basis(MeshTri(read.points[:, :2].T, read.cells_dict["triangle"].T), ElementTriP2(), intorder=4)
K, M, _, free = condense(laplace.assemble(basis), mass.assemble(basis), D=basis.get_dofs())
values, vectors = eigsh(K, count, M, sigma=0, v0=np.ones(K.shape[0]))
modes = np.zeros((basis.N, count))
modes[free] = vectors
points = np.vstack([basis.doflocs, np.zeros(basis.N)]).T
for k in range(count):
    cells = [("triangle6", basis.element_dofs.T)]
    meshio.Mesh(points, cells, point_data={f"m{k + 1}": modes[:, k]}).write(f"{out}/m{k + 1}.vtu")
with open(f"{out}/numbers.csv", "w") as file:
    file.writelines(f"lambda{k + 1},{float(value)!r}\n" for k, value in enumerate(values))
