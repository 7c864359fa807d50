"""The modes of the cavity by scikit-fem and ARPACK."""

import sys

import meshio
import numpy as np
import skfem
from scipy.sparse.linalg import eigsh
from skfem.helpers import curl, dot

read = meshio.read(sys.argv[1])
out, count = sys.argv[2], int(sys.argv[3])
mesh = skfem.MeshTri(read.points[:, :2].T, read.cells_dict["triangle"].T)
basis = skfem.Basis(mesh, skfem.ElementTriN1())
stiffness = skfem.BilinearForm(lambda u, v, w: curl(u) * curl(v)).assemble(basis)
mass = skfem.BilinearForm(lambda u, v, w: dot(u, v)).assemble(basis)
K, M, _, free = skfem.condense(stiffness, mass, D=basis.get_dofs())
values, vectors = eigsh(K, count, M, sigma=-1, v0=np.ones(K.shape[0]))
modes = np.zeros((basis.N, count))
modes[free] = vectors
# The tangential component is constant on each edge, here in its middle.
middle = np.array([[0.5]]), np.array([1.0])
edges = skfem.FacetBasis(mesh, basis.elem, facets=np.arange(mesh.facets.shape[1]), quadrature=middle)
v0, v1 = mesh.facets
along = mesh.p[:, v1] - mesh.p[:, v0]
for k in range(count):
    moments = np.sum(along * np.asarray(edges.interpolate(modes[:, k]))[:, :, 0], axis=0)
    with open(f"{out}/m{k + 1}.csv", "w") as file:
        file.write(f"v0,v1,m{k + 1}\n")
        file.writelines(f"{a},{b},{c!r}\n" for a, b, c in zip(v0.tolist(), v1.tolist(), moments.tolist()))
with open(f"{out}/numbers.csv", "w") as file:
    file.writelines(f"lambda{k + 1},{float(value)!r}\n" for k, value in enumerate(values))
