"""Problems with orders that something limits. Words: which, n, a parameter, mesh, folder."""

import sys

import meshio
import numpy as np
from scipy.sparse.linalg import cg
from skfem import (
    Basis,
    BilinearForm,
    ElementDG,
    ElementTriP1,
    ElementTriP2,
    InteriorFacetBasis,
    LinearForm,
    MeshTri,
    asm,
    condense,
    enforce,
    solve,
)
from skfem.helpers import dot, grad, jump

which, n, given, mesh, out = sys.argv[1], int(sys.argv[2]), float(sys.argv[3]), *sys.argv[4:]
quadratic = which in ("disc", "nitsche", "symmetric")


def smooth(x):
    return np.sin(np.pi * x[0]) * np.sin(np.pi * x[1])


def singular(x):
    angle = np.arctan2(x[1] + 0.0, x[0]) + np.pi / 2
    return np.hypot(x[0], x[1]) ** (2 / 3) * np.sin(2 / 3 * angle)


if which == "disc":
    m = MeshTri.init_circle(n)
elif which == "corner":
    line = np.linspace(-1, 1, 2 * n + 1)
    m = MeshTri.init_tensor(line, line)
    middle = m.p[:, m.t].mean(axis=1)
    m = m.restrict(np.flatnonzero((middle[0] > 0) | (middle[1] > 0)))
elif which == "slit":
    read = meshio.read(mesh)
    m = MeshTri(read.points[:, :2].T.copy(), read.cells_dict["triangle"].T.astype(np.int64))
else:
    line = np.linspace(0, 1, n + 1)
    m = MeshTri.init_tensor(line, line).with_defaults()

basis = Basis(m, ElementTriP2() if quadratic else ElementTriP1(), intorder=6)
laplace = BilinearForm(lambda u, v, w: dot(grad(u), grad(v)))
mass = BilinearForm(lambda u, v, w: u * v)
load = LinearForm(lambda v, w: 2 * np.pi**2 * smooth(w.x) * v)
hump = LinearForm(lambda v, w: 2 * (w.x[0] * (1 - w.x[0]) + w.x[1] * (1 - w.x[1])) * v)
edge = basis.get_dofs()
place = basis.doflocs


def jumping(at):
    form = BilinearForm(lambda u, v, w: np.where(w.x[0] < at, 1.0, 10.0) * dot(grad(u), grad(v)))
    f = LinearForm(lambda v, w: (np.pi / at) ** 2 * np.sin(np.pi / at * w.x[0]) * v).assemble(basis)
    return solve(*condense(form.assemble(basis), f, D=basis.get_dofs(["left", "right"])))


def held(values, f):
    u = basis.zeros()
    u[edge.all()] = values(place[:, edge.all()])
    return solve(*condense(laplace.assemble(basis), f, x=u, D=edge))


if which == "disc":
    u = held(lambda x: 0 * x[0], LinearForm(lambda v, w: 1.0 * v).assemble(basis))
elif which == "heat":
    A, M = laplace.assemble(basis), mass.assemble(basis)
    u = smooth(place)
    for _ in range(round(0.1 / given)):
        u = solve(*condense(M + given * A, M @ u, D=edge))
elif which == "solver":
    A, f = enforce(laplace.assemble(basis), hump.assemble(basis), D=edge)
    u, _ = cg(A, f, rtol=given)
elif which == "penalty":
    u = solve(laplace.assemble(basis) + mass.assemble(basis.boundary()) / given, load.assemble(basis))
elif which == "corner":
    u = held(singular, basis.zeros())
elif which == "slit":
    u = held(lambda x: np.sqrt(np.maximum(0, (np.hypot(x[0], x[1]) + x[0]) / 2)), basis.zeros())
elif which == "jump":
    u = jumping(1 / 3)
elif which == "fitted":
    u = jumping(1 / 2)
else:
    # Interior penalty, whose values on the boundary are imposed by Nitsche's method.
    theta, gamma = (1, 5) if which == "nitsche" else (-1, 20)
    element = ElementDG(ElementTriP2())
    cells = Basis(m, element, intorder=6)
    sides = [InteriorFacetBasis(m, element, side=k, intorder=6) for k in (0, 1)]
    outer = cells.boundary()

    def terms(a, b, u, v, w, share):
        slopes = [share * dot(w.n, grad(x)) for x in (u, v)]
        return -slopes[0] * b + theta * slopes[1] * a + gamma / w.h * a * b

    inner = BilinearForm(lambda u, v, w: terms(*jump(w, u, v), u, v, w, 0.5))
    weak = BilinearForm(lambda u, v, w: terms(u, v, u, v, w, 1))
    A = laplace.assemble(cells) + asm(inner, sides, sides) + weak.assemble(outer)
    broken = solve(A, load.assemble(cells))
    u, count = basis.zeros(), basis.zeros()
    np.add.at(u, basis.element_dofs, broken[cells.element_dofs])
    np.add.at(count, basis.element_dofs, 1)
    u /= count

kind, cells = ("triangle6", basis.element_dofs.T) if quadratic else ("triangle", m.t.T)
points = np.column_stack([place.T, np.zeros(place.shape[1])])
meshio.Mesh(points, [(kind, cells)], {"u": u}).write(f"{out}/u.vtu")
