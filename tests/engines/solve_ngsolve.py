"""The Signorini problem by Nitsche's method, in NGSolve (https://ngsolve.org), for `ngsolve.toml`.

In the notation of fenicsx/nitsche.py, where the scheme is explained: find u in V_h, u = g on Γ_D, with

    (∇u, ∇v) - <λ, v>_C + <u - ψ + [P]₊, θ₁ ∂ₙv + θ₂/γ v>_C = (f, v) + <t, v>_N = L(v),   P = γ λ - (u - ψ),

where λ = ∂ₙu or, corrected by the load, ∂ₙu - L(φ_F)/|F|. NGSolve derives the Newton matrix, with 1 where P > 0 as
derivative of [P]₊.

To install, in the repository:  python3 -m venv target/python && target/python/bin/pip install ngsolve
"""

import math
import time

import job
import netgen.meshing
import ngsolve as ng
import numpy as np
from ngsolve import CF, ET, VOL, IfPos, ds, dx, grad

PARTS = {1: "contact", 2: "dirichlet", 3: "neumann"}  # of the boundary, by label
SPACES = {"CR": ("nonconforming", 1), "P1": ("h1ho", 1), "P2": ("h1ho", 2)}


def power(a, b):
    """a^b; NGSolve takes logarithms where b is not an int, and there is none of 0."""
    if isinstance(b, float) and b.is_integer():
        return CF(a) ** int(b) if b != 0 else CF(1.0)
    return CF(a) ** CF(b)


FUNCTIONS = {
    **{name: getattr(ng, name) for name in ["sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "exp", "log", "sqrt"]},
    "tanh": lambda a: 1 - 2 / (ng.exp(2 * a) + 1),
    "abs": lambda a: IfPos(CF(a), a, -a),
    "min": lambda a, b: IfPos(CF(b) - a, a, b),
    "max": lambda a, b: IfPos(CF(a) - b, a, b),
    "pow": power,
    # A comparison is a number and whether it has to be positive or must not be.
    "lt": lambda a, b: (CF(b) - a, True),
    "le": lambda a, b: (CF(a) - b, False),
    "where": lambda positive, a, b: IfPos(positive[0], *((a, b) if positive[1] else (b, a))),
    **dict(zip("xyz", (ng.x, ng.y, ng.z), strict=True)),
}


def make_mesh(d, points, cells, boundary, labels):
    mesh = netgen.meshing.Mesh(dim=d)
    mesh.AddPoints(np.hstack([points, np.zeros((len(points), 3 - d))]))
    mesh.AddElements(dim=d, index=mesh.AddRegion("body", dim=d), data=cells.astype(np.int32), base=0)
    for label, name in PARTS.items():
        faces = boundary[labels == label].astype(np.int32)
        if len(faces):
            mesh.AddElements(dim=d - 1, index=mesh.AddRegion(name, dim=d - 1), data=faces, base=0)
    return ng.Mesh(mesh)


class Nodes:
    """Nodal values from coefficients, which in NGSolve are those of a hierarchical basis, and back."""

    def __init__(self, V, element, points, cells):
        d = points.shape[1]
        barycentric = job.nodes(element, d)
        self.points = np.einsum("ni,cid->dcn", barycentric, points[cells])
        self.dofs, self.shapes = [], []
        for k, cell in enumerate(V.mesh.Elements(VOL)):
            here = {vertex.nr: i for i, vertex in enumerate(cell.vertices)}
            # NGSolve's reference simplex has its last vertex in 0.
            at = barycentric[:, np.argsort([here[v] for v in cells[k]])][:, :d]
            fe = V.GetFE(ng.ElementId(VOL, k))
            self.shapes.append([fe.CalcShape(*x) for x in at])
            self.dofs.append(list(V.GetDofNrs(ng.ElementId(VOL, k))))
        self.dofs, self.shapes = np.array(self.dofs), np.array(self.shapes)

    def values(self, coefficients):
        return np.einsum("cni,ci->cn", self.shapes, coefficients[self.dofs])

    def interpolate(self, values, coefficients):
        coefficients[self.dofs] = np.linalg.solve(self.shapes, values[:, :, None])[:, :, 0]


def rules(of_job, d):
    points, weights = job.rule(of_job)
    return {(ET.SEGM, ET.TRIG, ET.TET)[d - 1]: ng.IntegrationRule(points.tolist(), weights.tolist())}


def load_of_faces(L, nodes, mesh, cells):
    """L(φ_F) / |F| on each contact face F, of Crouzeix-Raviart, as a function on faces."""
    of_cells = nodes.values(L.vec.FV().NumPy())  # φ_F has the value 1 in its node: the loads are those of nodes, too
    loads = {
        frozenset(np.delete(cell, i).tolist()): load
        for cell, of_cell in zip(cells, of_cells, strict=True)
        for i, load in enumerate(of_cell)
    }
    F = ng.FacetFESpace(mesh, order=0)
    area = ng.LinearForm(F.TestFunction() * ds("contact", skeleton=True)).Assemble()
    density = ng.GridFunction(F)
    for face in mesh.Boundaries("contact").Elements():
        (here,) = face.edges if mesh.dim == 2 else face.faces
        density.vec[here.nr] = loads[frozenset(vertex.nr for vertex in face.vertices)] / area.vec[here.nr]
    return density


def solve(case, stop, quadrature):
    start = time.perf_counter()
    d = case["dimension"]
    points, cells, boundary, labels = job.read_mesh(case)
    mesh = make_mesh(d, points, cells, boundary, labels)
    name, order = SPACES[case["element"]]
    V = ng.FESpace(name, mesh, order=order, dirichlet="dirichlet")
    nodes = Nodes(V, case["element"], points, cells)
    # NGSolve drops terms that it sees to be 0, and then misses the test function; a parameter could become another.
    zero = ng.Parameter(0)
    f, t, psi = (job.expression(case["data"][key], FUNCTIONS) + zero for key in ("f", "t", "psi"))
    gamma = ng.GridFunction(ng.L2(mesh, order=0))
    gamma.vec.FV().NumPy()[:] = np.nan_to_num(job.read_gamma(case, len(cells)), nan=1.0)
    theta1, theta2 = case["theta1"], case["theta2"]

    # skeleton: the fields are those of the cell behind the face, whose whole gradient there is
    faces = rules(quadrature["face"], d - 1)
    ds_C, ds_N = (ds(name, skeleton=True, intrules=faces) for name in ("contact", "neumann"))
    n = ng.specialcf.normal(d)
    u, v = V.TnT()
    L = ng.LinearForm(f * v * dx(intrules=rules(quadrature["cell"], d)) + t * v * ds_N).Assemble()
    of_load = load_of_faces(L, nodes, mesh, cells) if case["flux_corrected"] else 0

    flux = grad(u) * n - of_load
    P = gamma * flux - (u - psi)
    A = ng.BilinearForm(V)
    A += grad(u) * grad(v) * dx
    A += (-flux * v + (u - psi + IfPos(P, P, 0)) * (theta1 * grad(v) * n + theta2 / gamma * v)) * ds_C
    H = ng.BilinearForm(grad(u) * grad(v) * dx).Assemble()

    # starts as 0, but g in the nodes on Γ_D, where the steps are 0
    uh, step, residual = ng.GridFunction(V), ng.GridFunction(V), L.vec.CreateVector()
    free = np.array(V.FreeDofs())
    x = uh.vec.FV().NumPy()
    nodes.interpolate(job.values(case["data"]["g"], nodes.points), x)
    x[free] = 0

    increments, converged = [], False
    while len(increments) < stop["max_iterations"] and not converged:
        A.Apply(uh.vec, residual)
        A.AssembleLinearization(uh.vec)
        residual.data -= L.vec
        step.vec.data = A.mat.Inverse(V.FreeDofs(), inverse="umfpack") * residual
        uh.vec.data -= step.vec
        norms = [math.sqrt(max(ng.InnerProduct(w.vec, H.mat * w.vec), 0)) for w in (step, uh)]
        increments.append(norms[0] / max(norms[1], 1e-300))
        job.progress(case, len(increments), increments[-1])
        if not math.isfinite(increments[-1]):
            break
        converged = increments[-1] < stop["increment"]
    return job.write_dofs(case, nodes.values(x), converged, increments, time.perf_counter() - start)


def main():
    todo = job.read_job()
    ng.ngsglobals.msg_level = 0
    done = [solve(case, todo["stop"], todo["quadrature"]) for case in todo["cases"]]
    job.write_status(ng.__version__, done)


if __name__ == "__main__":
    main()
