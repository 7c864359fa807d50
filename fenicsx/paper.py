"""Section 6 of E. Burman, P. Hansbo, M. G. Larson, SIAM J. Numer. Anal. 55 (2017), with nothing but dolfinx; see nitsche.py.

python3 paper.py --example 6.2 -N 5 -n 32              6.1 (default), or 6.2 with N
python3 paper.py --method p2                           Chouly, Hild, Renard on P2 by (2.4), or chr: by their own form (2.5)
python3 paper.py --iteration fixed-point --gamma0 4.5  the paper's, or newton (default)
python3 paper.py --mesh my.msh --contact 1 --dirichlet 3
"""

import math
import os
import sys

if sys.flags.hash_randomization:  # with it FFCx would name, and compile, each form anew in every run
    os.execve(sys.executable, [sys.executable, *sys.argv], os.environ | {"PYTHONHASHSEED": "0"})

import compat  # first of all: it refuses a dolfinx that is too old

# isort: split
import dolfinx.fem.petsc
import ufl
from dolfinx import fem
from ufl import dx, grad, inner

import meshes
import options
import output
from nitsche import (
    DIRICHLET,
    assemble,
    chouly_hild_renard,
    fixed_point,
    linear_solver,
    load_form,
    nitsche_forms,
)

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


def main():
    of, arrays = options.of_command_line(__doc__)

    def load(x):  # (6.1), (6.2)
        return (
            -2 * math.pi * ufl.sin(2 * math.pi * x[0])
            if of.example == "6.1"
            else (2 * math.pi * of.N) ** 2 * ufl.cos(2 * math.pi * of.N * x[0])
        )

    u, gamma, ds, steps = solve(arrays, load, of.method, of.gamma0, of.iteration)
    print(steps, "steps")
    output.report(u, gamma, ds, arrays)
    output.write(u, of.out)
    if of.fine > 1:
        U, *_ = solve(meshes.cut(*arrays, of.fine), load, "chr", of.gamma0)
        output.errors(u, U, of.fine)


if __name__ == "__main__":
    main()
