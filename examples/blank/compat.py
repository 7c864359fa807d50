"""Reads MSH 2.2 without Gmsh's Python, and hides what releases of dolfinx from 0.5 on call differently."""

import basix
import dolfinx
import numpy as np
import ufl
from dolfinx import fem, graph, io

old = not hasattr(fem, "functionspace")  # before 0.7


def function_space(mesh, family, degree, size=None):
    """Functions with values in R, or in R^size."""
    if old:
        kind = fem.FunctionSpace if size is None else fem.VectorFunctionSpace
        return kind(mesh, (family, degree))
    return fem.functionspace(mesh, (family, degree) if size is None else (family, degree, (size,)))


def read_msh(path, comm):
    """Mesh, and tags of the boundary by physical groups; `gmshio.read_from_msh` does the same where gmsh is installed."""
    words = iter(open(path).read().split("\n"))
    rows = {}
    for line in words:
        if line in ("$Nodes", "$Elements"):
            rows[line] = [next(words).split() for _ in range(int(next(words)))]
    number = {row[0]: i for i, row in enumerate(rows["$Nodes"])}
    x = np.array([row[1:4] for row in rows["$Nodes"]], float)

    d = 3 if any(row[1] == "4" for row in rows["$Elements"]) else 2
    cell, facet = {2: ("2", "1"), 3: ("4", "2")}[d]  # Gmsh's types: 1 line, 2 triangle, 4 tetrahedron

    def elements(kind):
        found = [row for row in rows["$Elements"] if row[1] == kind]
        nodes = np.array([[number[i] for i in row[3 + int(row[2]) :]] for row in found], np.int64)
        return nodes, np.array([row[3] for row in found], np.int32)

    shape = {2: "triangle", 3: "tetrahedron"}[d]
    cells, x = elements(cell)[0], np.ascontiguousarray(x[:, :d])
    if old:
        mesh = dolfinx.mesh.create_mesh(comm, cells, x, ufl.Mesh(ufl.VectorElement("Lagrange", shape, 1)))
    else:
        element = basix.ufl.element("Lagrange", shape, 1, shape=(d,))
        mesh = dolfinx.mesh.create_mesh(comm, cells=cells, x=x, e=element)
    mesh.topology.create_connectivity(d - 1, 0)
    mesh.topology.create_connectivity(d - 1, d)
    facets, tags = io.distribute_entity_data(getattr(mesh, "_mesh", mesh), d - 1, *elements(facet))
    adjacency = getattr(graph, "adjacencylist", None) or graph.create_adjacencylist
    return mesh, dolfinx.mesh.meshtags_from_entities(mesh, d - 1, adjacency(facets), tags.astype(np.int32))
