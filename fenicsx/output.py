"""What paper.py tells of a solution: the numbers of section 6, where contact begins and ends, errors, files."""

import itertools
import math

import compat

# isort: split
import dolfinx.fem.petsc
import numpy as np
import ufl
from dolfinx import fem, io
from ufl import FacetNormal, conditional, dot, dx, grad, inner, le

import meshes
from nitsche import CONTACT, assemble


def number(form):
    return fem.assemble_scalar(fem.form(form))


def report(u, gamma, ds, arrays):
    """The numbers of section 6, and where contact begins and ends."""
    mesh = u.function_space.mesh
    n, ds_C = FacetNormal(mesh), ds(CONTACT)
    flux = dot(n, grad(u))
    P = gamma * flux - u
    law = conditional(le(P, 0), u, gamma * flux)  # u + [P]₊, plotted in Figure 2; (5.12) bounds it with the weight
    print(f"‖∇u‖² {number(inner(grad(u), grad(u)) * dx(degree=2)):.12g}, flux through Γ_C {number(flux * ds_C):.12g}")
    left, weighted = math.sqrt(number(law**2 * ds_C)), math.sqrt(number(law**2 / gamma * ds_C))
    print(f"‖u + [P]₊‖ on Γ_C {left:.12g}, with weight γ^(-1/2) {weighted:.12g}")

    points, cells, boundary, labels = arrays
    W = gamma.function_space
    lengths = []  # of what is in contact, and of all, in each cell
    for indicator in conditional(le(P, 0), 1.0, 0.0), conditional(le(P, 0), 1.0, 1.0):
        form = fem.form(indicator * ufl.TestFunction(W) * ds_C)
        vector = dolfinx.fem.petsc.create_vector(form)
        assemble(vector, form)
        of_input = np.empty(len(cells))
        of_input[mesh.topology.original_cell_index] = vector.array[compat.cell_dofs(W)[:, 0]]
        lengths.append(of_input)
    behind = {frozenset(pair): c for c, cell in enumerate(cells) for pair in itertools.combinations(cell.tolist(), 2)}
    sides = set(), set()
    for face in boundary[labels == CONTACT].tolist():
        c = behind[frozenset(face)]
        sides[int(lengths[0][c] > lengths[1][c] / 2)].update(face)
    ends = sorted(tuple(points[v]) for v in sides[0] & sides[1])
    share = 100 * lengths[0].sum() / lengths[1].sum()
    print(f"contact on {share:.10g} % of Γ_C, begins or ends at", *(f"({x:g}, {y:g})" for x, y in ends))


def on_pieces(u, U, m):
    """u as a discontinuous function on the mesh of U, whose cell k is a piece of the input cell k // m²."""
    mesh, fine = u.function_space.mesh, U.function_space.mesh
    W = compat.function_space(fine, "DG", 2)
    local = np.argsort(mesh.topology.original_cell_index)
    parents = local[np.asarray(fine.topology.original_cell_index) // m**2]
    dofs = compat.cell_dofs(W)
    v = fem.Function(W)
    v.x.array[dofs.ravel()] = u.eval(
        W.tabulate_dof_coordinates()[dofs.ravel()], np.repeat(parents, dofs.shape[1])
    ).ravel()
    return v


def errors(u, U, m):
    e = U - on_pieces(u, U, m)
    h1, H1 = (math.sqrt(number(inner(grad(v), grad(v)) * dx(degree=4))) for v in (e, U))
    l2, L2 = (math.sqrt(number(v**2 * dx(degree=4))) for v in (e, U))
    print(f"error to fine P2: H¹ {h1 / H1:.12g}, L² {l2 / L2:.12g}, ‖e‖_1,h {(h1 + l2) / (H1 + L2):.12g}")


def write(u, name):
    """name.pvd for ParaView, the values of each cell its own; name.png where matplotlib is installed."""
    V = compat.function_space(u.function_space.mesh, "DG", compat.degree(u.function_space))
    v = fem.Function(V, name="u")
    v.interpolate(u)
    with io.VTKFile(meshes.COMM, f"{name}.pvd", "w") as file:
        file.write_function(v)
    try:
        import matplotlib
    except ImportError:
        print("no picture: matplotlib is not installed (on Debian apt-get install python3-matplotlib)")
        return
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    dofs = compat.cell_dofs(V)[:, :3]
    x = V.tabulate_dof_coordinates()[dofs.ravel()]
    plt.tripcolor(x[:, 0], x[:, 1], np.arange(dofs.size).reshape(-1, 3), v.x.array[dofs.ravel()], shading="gouraud")
    plt.gca().set_aspect("equal")
    plt.colorbar(label="u")
    plt.savefig(f"{name}.png", dpi=150)
