"""The same body by scikit-fem, pinned by three dofs at the two corners on the left."""

import sys

import meshio
import numpy as np
from skfem import (
    Basis,
    BilinearForm,
    ElementTriP1,
    ElementVector,
    FacetBasis,
    LinearForm,
    MeshTri,
    condense,
    solve,
)
from skfem.helpers import ddot, div, sym_grad

read = meshio.read(sys.argv[1])
mesh = MeshTri(read.points[:, :2].T, read.cells_dict["triangle"].T)
mu = float(sys.argv[3])
basis = Basis(mesh, ElementVector(ElementTriP1()))
stiffness = BilinearForm(lambda u, v, w: 2 * mu * ddot(sym_grad(u), sym_grad(v)) + div(u) * div(v)).assemble(basis)


def pull(side):
    facets = FacetBasis(mesh, ElementVector(ElementTriP1()), facets=mesh.facets_satisfying(lambda x: np.isclose(x[0], side)), intorder=4)
    return LinearForm(lambda v, w: w.n[0] * (1 + w.x[1] ** 2) * v[0]).assemble(facets)


corner = lambda x, y: basis.nodal_dofs[:, np.argmin(np.hypot(mesh.p[0] - x, mesh.p[1] - y))]
fixed = np.array([*corner(0, 0), corner(0, 1)[0]])
u = solve(*condense(stiffness, pull(0) + pull(1), D=fixed))
values = np.vstack([u[basis.nodal_dofs], np.zeros(mesh.p.shape[1])]).T
meshio.Mesh(read.points, [("triangle", mesh.t.T)], point_data={"u": values}).write(f"{sys.argv[2]}/u.vtu")
