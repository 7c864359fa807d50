"""Section 6 of E. Burman, P. Hansbo, M. G. Larson, SIAM J. Numer. Anal. 55 (2017), with nothing but dolfinx; see nitsche.py.

    python3 paper.py --example 6.2 -N 5 -n 32              6.1 (default), or 6.2 with N
    python3 paper.py --method p2                           Chouly, Hild, Renard on P2 by (2.4), or chr: by their own form (2.5)
    python3 paper.py --iteration fixed-point --gamma0 4.5  the paper's, or newton (default)
    python3 paper.py --mesh my.msh --contact 1 --dirichlet 3
"""

import argparse
import itertools
import math
import os
import sys

if sys.flags.hash_randomization:  # with it FFCx would name, and compile, each form anew in every run
    os.execve(sys.executable, [sys.executable, *sys.argv], os.environ | {"PYTHONHASHSEED": "0"})

import compat  # first of all: it refuses a dolfinx that is too old

# isort: split
import dolfinx.fem.petsc
import numpy as np
import ufl
from dolfinx import fem, io
from ufl import FacetNormal, conditional, dot, dx, grad, inner, le

import meshes
from nitsche import CONTACT, DIRICHLET, NEUMANN, assemble, chouly_hild_renard, fixed_point, linear_solver, load_form, nitsche_forms

TOL = 1e-7  # section 6: "iterate until the relative H¹-error of the increment is smaller than a tolerance TOL"


def solve(arrays, load, method, gamma0, iteration="newton"):
    """u of (3.1) from 0, γ and ds on its mesh, and the steps; `load` makes f of x, γ = γ₀ h with h the diameter of the cell."""
    points, cells, boundary, labels = arrays
    mesh = compat.simplex_mesh(meshes.COMM, points, cells)
    facets = compat.facet_tags(mesh, boundary, labels)
    V = compat.function_space(mesh, *(("CR", 1) if method == "cr" else ("Lagrange", 2)))
    gamma = fem.Function(compat.function_space(mesh, "DG", 0))
    gamma.x.array[compat.cell_dofs(gamma.function_space)[:, 0]] = gamma0 * compat.diameters(mesh)

    # Radon's 7 points on the cells, Gauss' 5 on the faces: exact for polynomials of degree 5 and 9.
    ds = ufl.Measure("ds", domain=mesh, subdomain_data=facets, metadata={"quadrature_degree": 9})
    theta2 = 0.0 if method == "cr" else 1.0
    data = {"f": load(ufl.SpatialCoordinate(mesh)), "t": 0.0, "psi": 0.0, "theta1": 1.0, "theta2": theta2}
    u, delta = fem.Function(V), fem.Function(V)
    A_h, J = chouly_hild_renard(u, gamma, 1.0, ds) if method == "chr" else nitsche_forms(u, gamma, data, ds)
    if iteration == "fixed-point":
        J = fixed_point(u, gamma, ds, 1.0, theta2)
    L = load_form(V, data, dx(domain=mesh, metadata={"quadrature_degree": 5}), ds)
    on_D = fem.locate_dofs_topological(V, 1, facets.find(DIRICHLET))
    bc = fem.dirichletbc(0.0, on_D, V)

    def size(v):  # of the broken H¹ norm
        return inner(grad(v), grad(v)) * dx(degree=4) + v * v * dx(degree=4)

    A_h, L, J, *sizes = compat.compiled(A_h, L, J, size(delta), size(u))
    A, b, R = dolfinx.fem.petsc.create_matrix(J), dolfinx.fem.petsc.create_vector(L), dolfinx.fem.petsc.create_vector(L)
    solver = linear_solver(A)
    assemble(b, L)
    for steps in range(1, 501):  # J δ = L - A_h(u), δ = 0 on Γ_D
        assemble(R, A_h)
        R.aypx(-1, b)
        dolfinx.fem.petsc.set_bc(R, [bc])
        A.zeroEntries()
        dolfinx.fem.petsc.assemble_matrix(A, J, bcs=[bc])
        A.assemble()
        solver.setUp()
        solver.solve(R, compat.petsc_vector(delta))
        u.x.array[:] += delta.x.array
        increment = math.sqrt(fem.assemble_scalar(sizes[0]) / max(fem.assemble_scalar(sizes[1]), 1e-300))
        if increment <= TOL:
            return u, gamma, ds, steps
    sys.exit(f"not converged: after {steps} steps the increment is {increment:.1e}")


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
    v.x.array[dofs.ravel()] = u.eval(W.tabulate_dof_coordinates()[dofs.ravel()], np.repeat(parents, dofs.shape[1])).ravel()
    return v


def errors(u, U, m):
    e = U - on_pieces(u, U, m)
    h1, H1 = (math.sqrt(number(inner(grad(v), grad(v)) * dx(degree=4))) for v in (e, U))
    l2, L2 = (math.sqrt(number(v**2 * dx(degree=4))) for v in (e, U))
    print(f"error to fine P2: H¹ {h1 / H1:.12g}, L² {l2 / L2:.12g}, ‖e‖_1,h {(h1 + l2) / (H1 + L2):.12g}")


def write(u, name):
    """name.pvd for ParaView, the values of each cell its own; name.png where matplotlib is installed."""
    V = compat.function_space(u.function_space.mesh, "DG", u.function_space.ufl_element().degree())
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


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--example", choices=["6.1", "6.2"], default="6.1")
    parser.add_argument("-N", type=int, default=3, help="of 6.2: N + 1 zones of contact")
    parser.add_argument("-n", type=int, default=16, help="squares a side of dolfinx's own mesh")
    parser.add_argument("--method", choices=["cr", "p2", "chr"], default="cr")
    parser.add_argument("--iteration", choices=["newton", "fixed-point"], default="newton")
    parser.add_argument("--gamma0", type=float, default=100.0)
    parser.add_argument("--mesh", help=meshes.read.__doc__)
    parser.add_argument("--contact", type=int, action="append", help="label of faces on Γ_C (1, the bottom)")
    parser.add_argument("--dirichlet", type=int, action="append", help="label of faces on Γ_D (3, the top); the rest is Γ_N")
    parser.add_argument("--fine", type=int, default=4, help="errors to P2 on every cell cut into so many squared; 1: none")
    parser.add_argument("--out", default="paper")
    of = parser.parse_args()

    points, cells, boundary, labels = meshes.read(of.mesh) if of.mesh else meshes.square(of.n)
    on_C, on_D = np.isin(labels, of.contact or [1]), np.isin(labels, of.dirichlet or [3])
    if not on_C.any() or not on_D.any():
        sys.exit(f"no face has a label of --contact or none has one of --dirichlet: the labels are {sorted(set(labels.tolist()))}")
    arrays = points, cells, boundary, np.where(on_C, CONTACT, np.where(on_D, DIRICHLET, NEUMANN))

    def load(x):  # (6.1), (6.2)
        return -2 * math.pi * ufl.sin(2 * math.pi * x[0]) if of.example == "6.1" else (2 * math.pi * of.N) ** 2 * ufl.cos(2 * math.pi * of.N * x[0])

    u, gamma, ds, steps = solve(arrays, load, of.method, of.gamma0, of.iteration)
    print(steps, "steps")
    report(u, gamma, ds, arrays)
    write(u, of.out)
    if of.fine > 1:
        U, *_ = solve(meshes.cut(*arrays, of.fine), load, "chr", of.gamma0)
        errors(u, U, of.fine)


if __name__ == "__main__":
    main()
