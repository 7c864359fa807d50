"""The Signorini problem by Nitsche's method, in GetFEM (https://getfem.org), for `getfem.toml`.

In the notation of fenicsx/nitsche.py, where the scheme is explained: find u in V_h, u = g on Γ_D, with

    (∇u, ∇v) - <λ, v>_C + <u - ψ + [P]₊, θ₁ ∂ₙv + θ₂/γ v>_C = (f, v) + <t, v>_N = L(v),   P = γ λ - (u - ψ),

where λ = ∂ₙu or, corrected by the load, ∂ₙu - L(φ_F)/|F|. GetFEM derives the Newton matrix, with 1 where P > 0 as
derivative of [P]₊.

To install, on Debian or Ubuntu as root:  apt install python3-getfem
"""

import math
import time

import getfem as gf
import job
import numpy as np
from scipy.spatial import cKDTree

CONTACT, DIRICHLET, NEUMANN = 1, 2, 3  # labels of the boundary faces, and numbers of GetFEM's regions
EVERYWHERE = -1
# GetFEM has no CR in 3D; it is discontinuous P1 there, reduced to what has one mean a face.
ELEMENTS = {
    (2, "CR"): "FEM_P1_NONCONFORMING",
    (2, "P1"): "FEM_PK(2,1)",
    (2, "P2"): "FEM_PK(2,2)",
    (3, "CR"): "FEM_PK_DISCONTINUOUS(3,1)",
    (3, "P1"): "FEM_PK(3,1)",
    (3, "P2"): "FEM_PK(3,2)",
}
# GetFEM takes no points, only names; a rule on faces is part of one on cells. Those of 5, 3, 2 and 1 points, by
# Gauss, on edges; of 7, 3 and 1 on triangles.
RULES = {
    2: ["IM_TRIANGLE(9)", "IM_TRIANGLE(5)", "IM_TRIANGLE(2)", "IM_TRIANGLE(1)"],
    3: ["IM_TETRAHEDRON(5)", "IM_NC(3,2)", "IM_TETRAHEDRON(1)"],
}


def rule_on_faces(of_job, d):
    """GetFEM's rule on cells whose points and weights on faces are those of the job, if in another order."""
    wanted = np.column_stack(job.rule(of_job))
    for name in RULES[d]:
        rule = gf.Integ(name)
        # the face opposite vertex 1, in the coordinates of the others
        there = np.column_stack([rule.face_pts(1)[1:].T, rule.face_coeffs(1)])
        if there.shape == wanted.shape and (cKDTree(there).query(wanted)[0] < 1e-14).all():
            return rule
    raise ValueError(f"GetFEM has no rule with the points {of_job['points']}")


def make_mesh(d, points, cells, boundary, labels):
    """The mesh, the faces of its cells, (M, d+1, d) vertices, and the cell and side of each boundary face."""
    mesh = gf.Mesh("ptND", points.T, cells.T)
    if not (np.array_equal(mesh.pts(), points.T) and np.array_equal(mesh.pid_from_cvid()[0], cells.ravel())):
        raise ValueError("GetFEM has renumbered the mesh")
    faces = np.sort(np.stack([np.delete(cells, i, axis=1) for i in range(d + 1)], axis=1), axis=2)
    sides = {tuple(face): divmod(k, d + 1) for k, face in enumerate(faces.reshape(-1, d).tolist())}
    sides = np.array([sides[tuple(face)] for face in np.sort(boundary, axis=1).tolist()])
    for label in CONTACT, NEUMANN:
        mesh.set_region(label, sides[labels == label].T)
    return mesh, faces, sides


def make_space(mesh, element, cells, faces):
    """The space, its dofs of each cell in the protocol's order, and the shape functions in that order, of a point."""
    d = mesh.dim()
    fem = gf.Fem(ELEMENTS[d, element])
    V = gf.MeshFem(mesh, 1)
    V.set_fem(fem)
    own = V.basic_dof_from_cvid()[0].reshape(len(cells), -1)
    if (d, element) == (3, "CR"):
        _, dofs = np.unique(faces.reshape(-1, d), axis=0, return_inverse=True)
        dofs = dofs.reshape(own.shape)
        vertices = np.linalg.inv(job.nodes("CR", d))  # values there, of means on faces
        extend = gf.Spmat("empty", own.size, dofs.max() + 1)
        reduce = gf.Spmat("empty", dofs.max() + 1, own.size)
        for here, there in zip(own, dofs, strict=True):
            extend[here, there] = vertices
            reduce[there, here] = job.nodes("CR", d)
        V.reduction_matrices(reduce, extend)
        return V, dofs, lambda x: fem.base_value(x).ravel() @ vertices
    places = job.nodes(element, d)[:, 1:]
    order = cKDTree(fem.pts().T).query(places)[1]
    return V, own[:, order], lambda x: fem.base_value(x).ravel()[order]


def solve(case, stop, quadrature):
    start = time.perf_counter()
    d, element = case["dimension"], case["element"]
    points, cells, boundary, labels = job.read_mesh(case)
    mesh, faces, sides = make_mesh(d, points, cells, boundary, labels)
    V, dofs, shapes = make_space(mesh, element, cells, faces)
    exact, on_faces = gf.MeshIm(mesh, 4), gf.MeshIm(mesh, rule_on_faces(quadrature["face"], d))

    # (f, v) by the points themselves, as not every rule has a name
    b = np.zeros(V.nbdof())
    of_cell = points[cells]
    volume = abs(np.linalg.det(of_cell[:, 1:] - of_cell[:, :1]))
    for x, weight in zip(*job.rule(quadrature["cell"]), strict=True):
        f = job.values(case["data"]["f"], (np.array([1 - x.sum(), *x]) @ of_cell).T)
        np.add.at(b, dofs, (weight * volume * f)[:, None] * shapes(x))

    model = gf.Model("real")
    model.add_fem_variable("u", V)
    model.add_initialized_data("theta1", case["theta1"])
    model.add_initialized_data("theta2", case["theta2"])

    def points_of(region):
        at = gf.MeshImData(on_faces, region)
        return at, np.array([model.interpolation(f"X({i + 1})", at, region) for i in range(d)])

    def add_data(name, at, values):
        model.add_im_data(name, at)
        model.set_variable(name, values)

    if (labels == NEUMANN).any():
        at, x = points_of(NEUMANN)
        add_data("t", at, job.values(case["data"]["t"], x))
        b += gf.asm_generic(on_faces, 1, "t*Test_u", NEUMANN, model)

    on_C = sides[labels == CONTACT]
    corners = points[faces[on_C[:, 0], on_C[:, 1]]]
    of_load = np.zeros(len(on_C))
    if case["flux_corrected"]:
        edges = corners[:, 1:] - corners[:, :1]
        areas = np.sqrt(np.linalg.det(edges @ edges.transpose(0, 2, 1))) / math.factorial(d - 1)
        of_load = b[dofs[on_C[:, 0], on_C[:, 1]]] / areas
    at, x = points_of(CONTACT)
    count = len(quadrature["face"]["weights"])
    middles = x.reshape(d, -1, count).mean(axis=2).T
    face = np.repeat(cKDTree(corners.mean(axis=1)).query(middles)[1], count)  # of each point
    add_data("psi", at, job.values(case["data"]["psi"], x))
    add_data("of_load", at, of_load[face])
    add_data("gamma", at, job.read_gamma(case, len(cells))[on_C[face, 0]])
    model.add_macro("flux", "(Grad_u.Normal - of_load)")
    model.add_macro("P", "(gamma*flux - (u - psi))")
    model.add_nonlinear_term(exact, "Grad_u.Grad_Test_u")
    # [P]₊ as the negative part of -P: GetFEM's derivative of pos_part is 1 in 0, too, and what lies there would come loose.
    model.add_nonlinear_term(
        on_faces,
        "(u - psi + neg_part(-P))*(theta1*Grad_Test_u.Normal + theta2/gamma*Test_u) - flux*Test_u",
        CONTACT,
    )
    H = gf.asm_generic(exact, 2, "Grad_u.Grad_Test_u", EVERYWHERE, model)

    u = np.zeros(len(b))  # but g in the nodes on Γ_D, where the steps are 0
    nodes = job.nodes(element, d)
    fixed = np.zeros(len(b), dtype=bool)
    for cell, side in sides[labels == DIRICHLET]:
        there = nodes[:, side] == 0
        fixed[dofs[cell, there]] = True
        u[dofs[cell, there]] = job.values(case["data"]["g"], (nodes[there] @ of_cell[cell]).T)
    free = np.flatnonzero(~fixed)

    increments, converged = [], False
    while len(increments) < stop["max_iterations"] and not converged:
        model.set_variable("u", u)
        model.assembly("build_all")
        step = np.zeros(len(b))
        rhs = model.rhs() + b
        # by MUMPS; linsolve_superlu of Debian 12 crashes even on 3 × 3
        step[free] = gf.linsolve_mumps(gf.Spmat("copy", model.tangent_matrix(), free, free), rhs[free]).ravel()
        u += step
        norms = [math.sqrt(max(w @ H.mult(w), 0)) for w in (step, u)]
        increments.append(norms[0] / max(norms[1], 1e-300))
        job.progress(case, len(increments), increments[-1])
        if not math.isfinite(increments[-1]):
            break
        converged = increments[-1] < stop["increment"]
    return job.write_dofs(case, u[dofs], converged, increments, time.perf_counter() - start)


def main():
    todo = job.read_job()
    gf.util_trace_level(0)
    gf.util_warning_level(0)
    done = [solve(case, todo["stop"], todo["quadrature"]) for case in todo["cases"]]
    job.write_status(gf.getfem_env("version"), done)


if __name__ == "__main__":
    main()
