"""Everything that differs between releases of dolfinx, so that nothing else has to ask which one runs.

Tested with 0.5.2 (Debian 12) and 0.9.0 (Debian 13). The other branches follow the documented interfaces of 0.6 to 0.10.
"""

import inspect
import logging
import sys

import dolfinx

VERSION = dolfinx.__version__
OLDEST = (0, 5)

if tuple(int(number) for number in VERSION.split(".")[:2]) < OLDEST:  # before names are missed that it does not have
    print(f"error dolfinx {VERSION} is too old: the companion needs {OLDEST[0]}.{OLDEST[1]} or later", flush=True)
    sys.exit(2)

import basix
import numpy as np
import ufl
from dolfinx import fem, graph, io
from dolfinx import mesh as dmesh

logging.disable(logging.INFO)  # the C compiler's command lines

# UFL renamed it in 2023.
atan2 = getattr(ufl, "atan2", None) or ufl.atan_2


def simplex_mesh(comm, points, cells):
    """The mesh of `points` (N, d) and `cells` (M, d+1), which rank 0 gives and all share."""
    d = points.shape[1]
    shape = {2: "triangle", 3: "tetrahedron"}[d]
    if comm.rank > 0:
        points, cells = points[:0], cells[:0]
    # The order of the last two arguments changed twice, their names once.
    if "domain" in inspect.signature(dmesh.create_mesh).parameters:
        return dmesh.create_mesh(comm, cells=cells, x=points, domain=ufl.Mesh(ufl.VectorElement("Lagrange", shape, 1)))
    import basix.ufl

    element = basix.ufl.element("Lagrange", shape, 1, shape=(d,))
    return dmesh.create_mesh(comm, cells=cells, x=points, e=element)


def facet_tags(mesh, facets, labels):
    """The tags of `facets` (K, d), given on rank 0 by their input vertices; `labels` (K,)."""
    d = mesh.topology.dim
    if mesh.comm.rank > 0:
        facets, labels = facets[:0], labels[:0]
    mesh.topology.create_connectivity(d - 1, 0)
    mesh.topology.create_connectivity(d - 1, d)
    owner = getattr(mesh, "_mesh", mesh)  # 0.5 wants the C++ mesh here
    entities, values = io.distribute_entity_data(owner, d - 1, facets, labels.astype(np.int32))
    adjacency = getattr(graph, "adjacencylist", None) or graph.create_adjacencylist
    return dmesh.meshtags_from_entities(mesh, d - 1, adjacency(entities), values.astype(np.int32))


def function_space(mesh, family, degree):
    create = getattr(fem, "functionspace", None) or fem.FunctionSpace
    return create(mesh, (family, degree))


def degree(V):
    of = V.ufl_element().degree  # a method up to 0.6
    return of() if callable(of) else of


def compiled(*forms):
    """The forms, ready to assemble.

    Signatures first: to compile a form, FFCx 0.5 adds to the metadata that it shares with the others, which would then be
    called, and compiled, differently depending on what the cache held.
    """
    for form in forms:
        form.signature()
    return [fem.form(form) for form in forms]


def interpolation_points(V):
    points = V.element.interpolation_points  # a method up to 0.9
    return points() if callable(points) else points


def petsc_vector(u):
    """The PETSc vector that shares the dofs of the function `u`."""
    return u.x.petsc_vec if hasattr(u.x, "petsc_vec") else u.vector


def rows(table):
    """A table of numbers a cell, (cells, k): an adjacency list in older releases."""
    return table if isinstance(table, np.ndarray) else table.array.reshape(table.num_nodes, -1)


def geometry_dofs(mesh):
    """The numbers in `mesh.geometry.x` of each local cell's vertices, (cells, d+1)."""
    return rows(mesh.geometry.dofmap)


def diameters(mesh):
    """The longest edge of each local cell."""
    corners = mesh.geometry.x[geometry_dofs(mesh)]
    return np.linalg.norm(corners[:, :, None] - corners[:, None], axis=3).max(axis=(1, 2), initial=0.0)


def mesh_of_gmsh(model, comm):
    """A triangulation in the plane and its facet tags, from the physical groups of a model of Gmsh."""
    from dolfinx.io import gmshio

    data = gmshio.model_to_mesh(model, comm, 0, gdim=2)
    return data[0], data[2]


def cell_vertices(mesh):
    """The input numbers of each local cell's vertices, (cells, d+1), in dolfinx's order."""
    return np.asarray(mesh.geometry.input_global_indices)[rows(mesh.geometry.dofmap)]


def cell_dofs(V):
    return rows(V.dofmap.list)


def simplex_entities(d):
    """The vertices of every sub-entity of the reference simplex, by dimension; facet i is opposite vertex i."""
    return basix.topology({2: basix.CellType.triangle, 3: basix.CellType.tetrahedron}[d])
