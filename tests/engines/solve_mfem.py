"""The Signorini problem by Nitsche's method, in MFEM (https://mfem.org) by PyMFEM, for `mfem.toml`.

In the notation of fenicsx/nitsche.py, where the scheme is explained: find u in V_h, u = g on Γ_D, with

    (∇u, ∇v) - <λ, v>_C + <u - ψ + [P]₊, θ₁ ∂ₙv + θ₂/γ v>_C = (f, v) + <t, v>_N = L(v),   P = γ λ - (u - ψ),

where λ = ∂ₙu or, corrected by the load, ∂ₙu - L(φ_F)/|F|. MFEM assembles (∇u, ∇v) and (f, v); what is done on the
boundary is put together here from its shape functions. In space it has no Crouzeix-Raviart.

To install, in the repository:  python3 -m venv target/python && target/python/bin/pip install mfem scipy
"""

import math
import time
from importlib.metadata import version

import job
import mfem.ser as mfem
import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, diags
from scipy.sparse.linalg import splu

CONTACT, DIRICHLET, NEUMANN = 1, 2, 3


class Formula(mfem.PyCoefficient):
    def __init__(self, text):
        super().__init__()
        self.text = text

    def EvalValue(self, x):
        return float(job.values(self.text, np.append(x, np.zeros(3 - len(x)))[:, None])[0])


def make_mesh(d, points, cells, boundary, labels):
    mesh = mfem.Mesh(d, len(points), len(cells), len(boundary), d)
    for point in points:
        mesh.AddVertex(point.tolist())
    for cell in cells.tolist():
        (mesh.AddTriangle if d == 2 else mesh.AddTet)(cell, 1)
    for face, label in zip(boundary.tolist(), labels.tolist(), strict=True):
        (mesh.AddBdrSegment if d == 2 else mesh.AddBdrTriangle)(face, label)
    # Without refinement, so that no vertex of a cell is moved but for its orientation.
    (mesh.FinalizeTriMesh if d == 2 else mesh.FinalizeTetMesh)(1, 0, True)
    return mesh


def make_rule(of_job):
    points, weights = job.rule(of_job)
    rule = mfem.IntegrationRule(len(weights))
    for i, (point, weight) in enumerate(zip(points, weights, strict=True)):
        ip = rule.IntPoint(i)
        ip.x, ip.y, ip.z = np.append(point, np.zeros(3 - len(point)))
        ip.weight = weight
    return rule


def scipy_matrix(A):
    return csr_matrix((A.GetDataArray().copy(), A.GetJArray().copy(), A.GetIArray().copy()), shape=(A.Height(), A.Width()))


class Faces:
    """All quadrature points of a part of the boundary: dofs (Q, k), values and normal derivatives of all basis functions of the

    cell, weights, places. MFEM's own integrals on the boundary know the dofs on a face only, and of Crouzeix-Raviart all three are there.
    """

    def __init__(self, mesh, V, rule, label, gamma):
        d = mesh.Dimension()
        rows = []
        for be in range(mesh.GetNBE()):
            if mesh.GetBdrAttribute(be) != label:
                continue
            T = mesh.GetBdrFaceTransformations(be)
            fe = V.GetFE(T.Elem1No)
            shape, dshape, normal = mfem.Vector(fe.GetDof()), mfem.DenseMatrix(fe.GetDof(), d), mfem.Vector(d)
            for q in range(rule.GetNPoints()):
                T.SetAllIntPoints(rule.IntPoint(q))
                mfem.CalcOrtho(T.Jacobian(), normal)
                n = normal.GetDataArray().copy()
                fe.CalcShape(T.GetElement1IntPoint(), shape)
                fe.CalcPhysDShape(T.Elem1, dshape)
                area = np.linalg.norm(n)
                slopes = dshape.GetDataArray().copy() @ (n / area)
                weight = rule.IntPoint(q).weight * area
                dofs = list(V.GetElementDofs(T.Elem1No))
                rows.append((be, dofs, shape.GetDataArray().copy(), slopes, weight, gamma[T.Elem1No], T.Elem1.Transform(T.GetElement1IntPoint()).copy()))
        columns = zip(*rows, strict=True) if rows else [[]] * 7
        self.face, self.dofs, self.phi, self.dn, self.weight, self.gamma, self.x = map(np.array, columns)

    def correct(self, load):
        """-L(φ_F)/|F| at each point, φ_F of Crouzeix-Raviart: the one basis function that is 1 on all of F."""
        flux = np.zeros(len(self.weight))
        for face in np.unique(self.face):
            here = self.face == face
            mean = np.average(self.phi[here], axis=0, weights=self.weight[here])
            flux[here] = -load[self.dofs[here][0][np.argmax(mean)]] / self.weight[here].sum()
        return flux


def solve(case, stop, quadrature):
    start = time.perf_counter()
    d = case["dimension"]
    if d == 3 and case["element"] == "CR":
        raise SystemExit("error MFEM has Crouzeix-Raviart for triangles only")
    points, cells, boundary, labels = job.read_mesh(case)
    mesh = make_mesh(d, points, cells, boundary, labels)
    collection = mfem.CrouzeixRaviartFECollection() if case["element"] == "CR" else mfem.H1_FECollection(int(case["element"][1]), d)
    V = mfem.FiniteElementSpace(mesh, collection)
    gamma, rule = job.read_gamma(case, len(cells)), make_rule(quadrature["face"])
    contact, neumann = (Faces(mesh, V, rule, label, gamma) for label in (CONTACT, NEUMANN))

    a = mfem.BilinearForm(V)
    a.AddDomainIntegrator(mfem.DiffusionIntegrator())
    a.Assemble()
    a.Finalize()
    L, f = mfem.LinearForm(V), Formula(case["data"]["f"])
    in_cells, of_cells = mfem.DomainLFIntegrator(f), make_rule(quadrature["cell"])
    in_cells.SetIntRule(of_cells)
    L.AddDomainIntegrator(in_cells)
    L.Assemble()
    A, b = scipy_matrix(a.SpMat()), L.GetDataArray().copy()
    if len(neumann.weight):
        t = np.broadcast_to(job.values(case["data"]["t"], neumann.x.T), neumann.weight.shape)
        np.add.at(b, neumann.dofs, (neumann.weight * t)[:, None] * neumann.phi)

    # The protocol's nodes in each cell, by its own vertices.
    barycentric = job.nodes(case["element"], d)
    dofs, shapes = [], []
    for k, cell in enumerate(cells.tolist()):
        fe, here = V.GetFE(k), list(mesh.GetElementVertices(k))
        shape, ip = mfem.Vector(fe.GetDof()), mfem.IntegrationPoint()
        values = []
        for node in barycentric:
            ip.x, ip.y, ip.z = np.append([node[cell.index(vertex)] for vertex in here[1:]], np.zeros(3 - d))
            fe.CalcShape(ip, shape)
            values.append(shape.GetDataArray().copy())
        shapes.append(values)
        dofs.append(list(V.GetElementDofs(k)))
    dofs, shapes = np.array(dofs), np.array(shapes)

    held = mfem.intArray()
    V.GetEssentialTrueDofs(mfem.intArray([int(k + 1 == DIRICHLET) for k in range(mesh.bdr_attributes.Max())]), held)
    held = np.array(held.ToList(), dtype=int)
    x = np.zeros(V.GetNDofs())
    places = np.einsum("ni,cid->dcn", barycentric, points[cells])
    at_nodes = np.broadcast_to(job.values(case["data"]["g"], places), places.shape[1:])
    g = np.zeros(len(x))
    g[dofs] = np.linalg.solve(shapes, at_nodes[:, :, None])[:, :, 0]
    x[held] = g[held]
    free = np.ones(len(x))
    free[held] = 0

    theta1, theta2 = case["theta1"], case["theta2"]
    gamma, weight = contact.gamma, contact.weight
    if len(weight):
        psi = np.broadcast_to(job.values(case["data"]["psi"], contact.x.T), weight.shape)
        rest = contact.correct(b) if case["flux_corrected"] else np.zeros(len(weight))
        test = theta1 * contact.dn + (theta2 / gamma)[:, None] * contact.phi

    def contact_terms(x):
        """<u - ψ + [P]₊, θ₁ ∂ₙv + θ₂/γ v>_C - <λ, v>_C, and its derivative."""
        if not len(weight):
            return 0, csr_matrix(A.shape)
        u, slope = (np.einsum("qi,qi->q", basis, x[contact.dofs]) for basis in (contact.phi, contact.dn))
        flux = slope + rest
        P = gamma * flux - (u - psi)
        law = np.where(P > 0, gamma * flux, u - psi)
        change = np.where((P > 0)[:, None], gamma[:, None] * contact.dn, contact.phi)
        vector = np.zeros(len(x))
        np.add.at(vector, contact.dofs, weight[:, None] * (law[:, None] * test - flux[:, None] * contact.phi))
        local = weight[:, None, None] * (test[:, :, None] * change[:, None, :] - contact.phi[:, :, None] * contact.dn[:, None, :])
        rows, columns = np.broadcast_arrays(contact.dofs[:, :, None], contact.dofs[:, None, :])
        return vector, coo_matrix((local.ravel(), (rows.ravel(), columns.ravel())), shape=A.shape).tocsr()

    increments, converged = [], False
    while len(increments) < stop["max_iterations"] and not converged:
        vector, N = contact_terms(x)
        residual = free * (A @ x + vector - b)
        J = diags(free) @ (A + N) + diags(1 - free)
        step = splu(J.tocsc()).solve(residual)
        x -= step
        norms = [math.sqrt(max(w @ (A @ w), 0)) for w in (step, x)]
        increments.append(norms[0] / max(norms[1], 1e-300))
        job.progress(case, len(increments), increments[-1])
        if not math.isfinite(increments[-1]):
            break
        converged = increments[-1] < stop["increment"]
    values = np.einsum("cni,ci->cn", shapes, x[dofs])
    return job.write_dofs(case, values, converged, increments, time.perf_counter() - start)


def main():
    todo = job.read_job()
    done = [solve(case, todo["stop"], todo["quadrature"]) for case in todo["cases"]]
    job.write_status(version("mfem"), done)


if __name__ == "__main__":
    main()
