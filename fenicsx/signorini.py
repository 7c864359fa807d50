"""The Signorini problem by Nitsche's method in dolfinx, for jobs of faceoff: the scheme is in nitsche.py.

paper.py is for reading and for runs without a job; here is what a job asks for beyond it: data from outside, quadrature points
as given, tetrahedra, several ranks, the flux corrected by the load, a stopping rule that holds in every row.

Corrected by the load ("flux_corrected" of a case, CR only): (3.2) leaves a flux of order h f on the free faces. The flux
in equilibrium with the load is λ = ∂ₙu - σ_L·n, where σ_L, a Raviart-Thomas field, carries L(φ_F) through each contact
face F and nothing through all others: |F| λ is then what remains of a(u, φ_F) = L(φ_F). λ takes the place of ∂ₙu in
(2.2) and (2.4), and the error in L² is of second order whatever γ.

Run in a job folder:  PYTHONHASHSEED=0 python3 signorini.py             (`--version` only tells dolfinx's)
In parallel:          PYTHONHASHSEED=0 mpirun -n 2 python3 -m mpi4py signorini.py --ranks 2
                      (mpi4py, so that a rank that fails to import ends all; --ranks, so that two lonely processes are noticed)
"""

import math
import sys
import time
import traceback

import compat  # first of all: it refuses a dolfinx that is too old

# isort: split
import dolfinx.fem.petsc
import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc
from ufl import FacetNormal, dot, grad, inner

import job
from nitsche import CONTACT, DIRICHLET, ELEMENTS, assemble, energy, linear_solver, load_form, nitsche_forms


def flux_of_load(V, L, facets, ds, clock):
    """σ_L: the lowest Raviart-Thomas field whose flux through each contact face F is L(φ_F), through others 0."""
    with clock("space"):
        W = compat.function_space(V.mesh, "RT", 1)
        sigma = fem.Function(W)
    with clock("compile"):
        through_C = dot(FacetNormal(V.mesh), ufl.TestFunction(W)) * ds(CONTACT)  # the flux of each basis function
        forms = compat.compiled(L, through_C)
    vectors = [dolfinx.fem.petsc.create_vector(form) for form in forms]
    with clock("assemble"):
        for vector, form in zip(vectors, forms, strict=True):
            assemble(vector, form)
            vector.ghostUpdate(addv=PETSc.InsertMode.INSERT, mode=PETSc.ScatterMode.FORWARD)

    # Both spaces have one dof a facet, in the order of a cell's facets.
    on_faces, of_faces = compat.cell_dofs(V).ravel(), compat.cell_dofs(W).ravel()
    on_C = np.zeros(len(sigma.x.array), dtype=bool)
    on_C[fem.locate_dofs_topological(W, V.mesh.topology.dim - 1, facets.find(CONTACT))] = True
    contact = on_C[of_faces]
    on_faces, of_faces = on_faces[contact], of_faces[contact]
    with vectors[0].localForm() as load, vectors[1].localForm() as basis:
        sigma.x.array[of_faces] = load.array[on_faces] / basis.array[of_faces]
    for vector in vectors:
        vector.destroy()
    return sigma


def sizes(A):
    """|A|, entry by entry."""
    rows, columns, values = A.getValuesCSR()
    return PETSc.Mat().createAIJ(A.getSizes(), csr=(rows, columns, np.abs(values)), comm=A.comm)


def backward_error(A, stiffness, u, r):
    """The largest |r_i| over the sum of the sizes of the row's terms: those of (∇u, ∇v), of the rest of A u, and of the rest of r.

    In A the first two cancel on a contact face of Crouzeix-Raviart. A row counts for a thousandth of the largest one at least.
    """
    rest = A.copy()
    rest.axpy(-1, stiffness, structure=PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
    size, product, terms = u.copy(), A.createVecLeft(), A.createVecLeft()
    size.abs()
    for matrix in sizes(stiffness), sizes(rest):
        matrix.multAdd(size, terms, terms)
        matrix.destroy()
    A.mult(u, product)
    terms.array += np.abs(product.array + r.array)
    terms.array = np.maximum(terms.array, 1e-3 * terms.max()[1])
    product.array = np.where(r.array == 0, 0, np.abs(r.array) / np.where(r.array == 0, 1, terms.array))
    worst = product.max()[1]
    for thing in rest, size, product, terms:
        thing.destroy()
    return worst


SOLVED, ROUNDING = 1e-9, 1.5e-14  # backward errors of a solution, and of one that no step makes better


def interpolate(g, V):
    """The nodal interpolant of g; for Crouzeix-Raviart its values at the facets' midpoints."""
    g_h = fem.Function(V)
    if isinstance(g, float):
        g_h.x.array[:] = g
    else:
        g_h.interpolate(fem.Expression(g, compat.interpolation_points(V)))
    return g_h


def newton(u, A_h, L, J, bc, degree, stop, clock, progress):
    """Semismooth Newton for A_h(u; v) = L(v) from the given u: J δ = L - A_h(u), δ = 0 on Γ_D, u <- u + δ.

    Ends when ‖∇δ‖ / ‖∇u‖ < `stop["increment"]` and u solves (3.1), when two steps leave nothing but rounding in every row of (3.1),
    after `stop["max_iterations"]` steps, or with a NaN.
    Returns whether it converged and the quotient of each step.
    """
    comm = u.function_space.mesh.comm
    with clock("compile"):
        delta = fem.Function(u.function_space)
        v, w = ufl.TestFunction(u.function_space), ufl.TrialFunction(u.function_space)
        volume = inner(grad(w), grad(v)) * ufl.dx(degree=2)
        forms = compat.compiled(A_h, L, J, volume, energy(delta, degree), energy(u, degree))
        A_h, L, J, volume, *norms = forms

    A, stiffness = dolfinx.fem.petsc.create_matrix(J), dolfinx.fem.petsc.create_matrix(volume)
    load, b = dolfinx.fem.petsc.create_vector(L), dolfinx.fem.petsc.create_vector(L)
    step, at = compat.petsc_vector(delta), compat.petsc_vector(u)
    solver = linear_solver(A)

    def residual():  # b <- L - A_h(u), 0 on Γ_D
        assemble(b, A_h)
        b.aypx(-1, load)
        dolfinx.fem.petsc.set_bc(b, [bc])

    with clock("assemble"):
        assemble(load, L)
        residual()
        dolfinx.fem.petsc.assemble_matrix(stiffness, volume, bcs=[bc])
        stiffness.assemble()

    increments, converged, was_small, was_rounding = [], False, False, False
    while len(increments) < stop["max_iterations"] and not converged:
        with clock("assemble"):
            A.zeroEntries()
            dolfinx.fem.petsc.assemble_matrix(A, J, bcs=[bc])
            A.assemble()
        with clock("factor"):
            solver.setUp()
        with clock("solve"):
            solver.solve(b, step)
        delta.x.scatter_forward()
        u.x.array[:] += delta.x.array

        with clock("assemble"):
            size_delta, size_u = (math.sqrt(comm.allreduce(fem.assemble_scalar(norm))) for norm in norms)
        increments.append(size_delta / size_u if size_u != 0 else (math.inf if size_delta > 0 else 0.0))
        progress(len(increments), increments[-1])
        if math.isnan(size_delta) or math.isnan(size_u):
            break
        with clock("assemble"):
            residual()
            is_small = increments[-1] < stop["increment"]
            error = backward_error(A, stiffness, at, b)
            is_rounding = error <= ROUNDING
            enough = max(SOLVED if was_small else ROUNDING, stop["increment"])
            converged = (is_small and error <= enough) or (is_rounding and was_rounding)
            was_small, was_rounding = is_small, is_rounding

    for thing in solver, A, stiffness, load, b, step:
        thing.destroy()
    return converged, increments


class Clock:
    """Adds up the seconds spent in named stretches: `with clock("solve"): …`."""

    def __init__(self, *names):
        self.seconds = dict.fromkeys(names, 0.0)

    def __call__(self, name):
        self.name = name
        return self

    def __enter__(self):
        self.start = time.perf_counter()

    def __exit__(self, *_):
        self.seconds[self.name] += time.perf_counter() - self.start


def solve(case, stop, quadrature, comm):
    """Solves one case, writes its dofs and returns its entry in the status (rank 0; None elsewhere)."""
    clock = Clock("read", "mesh", "space", "compile", "assemble", "factor", "solve", "write")

    with clock("read"):
        d = case["dimension"]
        points, cells, boundary, labels = job.read_mesh(case)
    with clock("mesh"):
        mesh = compat.simplex_mesh(comm, points, cells)
        facets = compat.facet_tags(mesh, boundary, labels)

    with clock("space"):
        family, degree = ELEMENTS[case["element"]]
        V = compat.function_space(mesh, family, degree)
        gamma = job.read_gamma(case, mesh, facets.find(CONTACT))
        data = job.read_data(case, mesh)
        dx = ufl.Measure("dx", domain=mesh, metadata=job.quadrature_rule(quadrature["cell"], d))
        ds = ufl.Measure(
            "ds", domain=mesh, subdomain_data=facets, metadata=job.quadrature_rule(quadrature["face"], d - 1)
        )

        u = fem.Function(V)  # starts as 0, but g on Γ_D, where the steps then are 0
        on_D = fem.locate_dofs_topological(V, d - 1, facets.find(DIRICHLET))
        u.x.array[on_D] = interpolate(data["g"], V).x.array[on_D]
        bc = fem.dirichletbc(PETSc.ScalarType(0), on_D, V)

    def progress(iteration, increment):
        if comm.rank == 0:
            print("progress", case["id"], iteration, f"{increment:.3e}", flush=True)

    L = load_form(V, data, dx, ds)
    sigma = flux_of_load(V, L, facets, ds, clock) if case["flux_corrected"] else None
    A_h, J = nitsche_forms(u, gamma, data, ds, sigma)
    converged, increments = newton(u, A_h, L, J, bc, degree, stop, clock, progress)

    with clock("write"):
        dofs = job.gather_dofs(u, cells)
        if dofs is None:
            return None
        name = job.write_dofs(case, dofs)
    return {
        "id": case["id"],
        "converged": converged,
        "iterations": len(increments),
        "increments": [job.finite_or_none(increment) for increment in increments],
        "rows": dofs.size,
        "dofs": name,
        "seconds": clock.seconds,
    }


def check_ranks(comm):
    """`--ranks R` tells how many there should be, or `several`: started by a foreign mpirun, each would be alone."""
    if sys.argv[1:2] == ["--ranks"]:
        ranks = sys.argv[2]
        if comm.size == 1 if ranks == "several" else comm.size != int(ranks):
            raise RuntimeError(
                f"started as {ranks} processes, but MPI counts {comm.size}: the launcher is not of the MPI that mpi4py uses"
            )


def main():
    if sys.argv[1:] == ["--version"]:
        print("dolfinx", compat.VERSION)
        return
    if sys.flags.hash_randomization:
        # Otherwise FFCx names each form anew in every process, and compiles it anew.
        sys.exit("signorini.py: PYTHONHASHSEED is not 0, so no compiled form would ever be found again; set it to 0")

    comm = MPI.COMM_WORLD
    where = f"on rank {comm.rank} of {comm.size}"
    try:
        check_ranks(comm)
        todo = job.read_job()
        done = []
        for case in todo["cases"]:
            where = f"{case['id']} on rank {comm.rank} of {comm.size}"
            done.append(solve(case, todo["stop"], todo["quadrature"], comm))
        if comm.rank == 0:
            job.write_status(done)
    except Exception as error:
        print(f"error {where}: {type(error).__name__}: {error}".replace("\n", " "), flush=True)
        if comm.size == 1:
            raise
        # Here and now: on its way out PETSc would wait for the other ranks, and they wait for this one.
        traceback.print_exc()
        comm.Abort(1)


if __name__ == "__main__":
    main()
