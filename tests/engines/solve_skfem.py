"""The Signorini problem by Nitsche's method, in scikit-fem (https://scikit-fem.readthedocs.io), for `skfem.toml`.

In the notation of fenicsx/nitsche.py, where the scheme is explained: find u in V_h, u = g on Γ_D, with

    (∇u, ∇v) - <λ, v>_C + <u - ψ + [P]₊, θ₁ ∂ₙv + θ₂/γ v>_C = (f, v) + <t, v>_N = L(v),   P = γ λ - (u - ψ),

where λ = ∂ₙu or, corrected by the load, ∂ₙu - L(φ_F)/|F|. Semismooth Newton, with 1 where P > 0 as derivative of [P]₊.

To install, in the repository:  python3 -m venv target/python && target/python/bin/pip install scikit-fem
"""

import importlib.metadata
import time

import job
import numpy as np
import skfem
from skfem.helpers import dot, grad

CONTACT, DIRICHLET, NEUMANN = 1, 2, 3  # labels of the boundary faces
MESHES = {2: skfem.MeshTri1, 3: skfem.MeshTet1}
ELEMENTS = {
    (2, "CR"): skfem.ElementTriCR,
    (2, "P1"): skfem.ElementTriP1,
    (2, "P2"): skfem.ElementTriP2,
    (3, "CR"): skfem.ElementTetCR,
    (3, "P1"): skfem.ElementTetP1,
    (3, "P2"): skfem.ElementTetP2,
}


def dn(w, v):
    return dot(w.n, grad(v))


@skfem.BilinearForm
def stiffness(u, v, w):
    return dot(grad(u), grad(v))


@skfem.LinearForm
def load(v, w):
    return w.density * v


def flux_and_P(w):
    flux = dn(w, w.u) - w.of_load
    return flux, w.gamma * flux - (w.u - w.psi)


@skfem.LinearForm
def contact(v, w):
    flux, P = flux_and_P(w)
    return (w.u - w.psi + np.maximum(P, 0)) * (w.theta1 * dn(w, v) + w.theta2 / w.gamma * v) - flux * v


@skfem.BilinearForm
def contact_derivative(s, v, w):
    _, P = flux_and_P(w)
    change = s + (P > 0) * (w.gamma * dn(w, s) - s)
    return change * (w.theta1 * dn(w, v) + w.theta2 / w.gamma * v) - dn(w, s) * v


def make_mesh(d, points, cells, boundary):
    """The mesh, and the numbers of the boundary faces in it."""
    mesh = MESHES[d](np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T), sort_t=False)
    if not np.array_equal(mesh.t, cells.T):
        raise ValueError("scikit-fem has renumbered the cells")
    number = {tuple(face): k for k, face in enumerate(np.sort(mesh.facets.T, axis=1))}
    return mesh, np.array([number[tuple(sorted(face))] for face in boundary], dtype=np.int64)


def solve(case, stop, quadrature):
    start = time.perf_counter()
    d, element = case["dimension"], ELEMENTS[case["dimension"], case["element"]]()
    points, cells, boundary, labels = job.read_mesh(case)
    mesh, faces = make_mesh(d, points, cells, boundary)

    def data(name, x):
        return job.values(case["data"][name], x)

    def rule(which):
        x, weights = job.rule(quadrature[which])
        return x.T, weights

    V = skfem.CellBasis(mesh, element, intorder=2 * element.maxdeg)
    V_f = skfem.CellBasis(mesh, element, quadrature=rule("cell"))
    b = load.assemble(V_f, density=data("f", V_f.global_coordinates()))
    if (labels == NEUMANN).any():
        V_N = skfem.FacetBasis(mesh, element, facets=faces[labels == NEUMANN], quadrature=rule("face"))
        b += load.assemble(V_N, density=data("t", V_N.global_coordinates()))
    A = stiffness.assemble(V)

    on_C = faces[labels == CONTACT]
    V_C = skfem.FacetBasis(mesh, element, facets=on_C, quadrature=rule("face"))
    of_load = np.zeros(len(on_C))
    if case["flux_corrected"]:
        of_load = b[V.facet_dofs[0, on_C]] / V_C.dx.sum(axis=1)  # CR has one dof a face
    fixed = {
        "gamma": np.broadcast_to(job.read_gamma(case, len(cells))[mesh.f2t[0, on_C], None], V_C.dx.shape),
        "of_load": np.broadcast_to(of_load[:, None], V_C.dx.shape),
        "psi": data("psi", V_C.global_coordinates()),
        "theta1": float(case["theta1"]),
        "theta2": float(case["theta2"]),
    }

    u = V.zeros()  # but g in the nodes on Γ_D, where the steps are 0
    on_D = V.get_dofs(faces[labels == DIRICHLET]).all() if (labels == DIRICHLET).any() else np.array([], dtype=int)
    u[on_D] = data("g", V.doflocs[:, on_D])

    increments, converged = [], False
    while len(increments) < stop["max_iterations"] and not converged:
        at_u = {"u": V_C.interpolate(u), **fixed}
        residual = A @ u + contact.assemble(V_C, **at_u) - b
        J = A + contact_derivative.assemble(V_C, **at_u)
        step = skfem.solve(*skfem.condense(J, -residual, D=on_D))
        u += step
        increments.append(np.sqrt(step @ (A @ step)) / max(np.sqrt(u @ (A @ u)), 1e-300))
        job.progress(case, len(increments), increments[-1])
        if not np.isfinite(increments[-1]):
            break
        converged = increments[-1] < stop["increment"]

    places = job.nodes(case["element"], d)[:, 1:]
    order = [np.abs(element.doflocs - place).sum(axis=1).argmin() for place in places]
    return job.write_dofs(case, u[V.element_dofs[order].T], converged, increments, time.perf_counter() - start)


def main():
    todo = job.read_job()
    done = [solve(case, todo["stop"], todo["quadrature"]) for case in todo["cases"]]
    job.write_status(importlib.metadata.version("scikit-fem"), done)


if __name__ == "__main__":
    main()
