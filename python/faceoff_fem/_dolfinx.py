"""dolfinx: a Function."""

import numpy as np

from ._arrays import faces_of_cells, functions, nodes_of, on_faces, partners
from .errors import usage


def _of(thing, name):
    """An attribute that is a method in some versions."""
    found = getattr(thing, name)
    return found() if callable(found) else found


def _table(dofmap, cells):
    """Rows of numbers, cell by cell; 0.5 has an adjacency list."""
    return np.asarray(getattr(dofmap, "array", dofmap)).reshape(cells, -1)


def arrays(uh, name=None):
    space, mesh = uh.function_space, uh.function_space.mesh
    source = f"dolfinx Function {uh.name!r}"
    if mesh.comm.size > 1:
        raise usage("the function is spread over several processes", "compare files, or run on one process", source)
    if len(_of(space, "component")):
        uh = uh.collapse()
        space = uh.function_space
    bs = space.dofmap.bs
    if bs == 1 and space.element.num_sub_elements > 1:
        raise usage("it is a function of a mixed space", "give its parts, as uh.sub(0).collapse()", source)
    dim = mesh.topology.dim
    cells = mesh.topology.index_map(dim).size_local
    shape = _of(mesh.topology, "cell_name") if hasattr(mesh.topology, "cell_name") else _of(mesh.ufl_cell(), "cellname")
    cmap = _of(mesh.geometry, "cmap") if hasattr(mesh.geometry, "cmap") else mesh.geometry.cmaps[0]
    corners = _table(mesh.geometry.dofmap, cells)
    dofs = _table(space.dofmap.list, cells)
    element = space.ufl_element()
    degree = _degree(element)
    theirs = np.asarray(_of(space.element, "interpolation_points"))
    values = uh.x.array.reshape(-1, bs)
    vector = (-1,) if len(uh.ufl_shape) else ()
    name = name or uh.name

    if "CR" in str(element) or "Crouzeix" in str(element):
        # A face is opposite its corner.
        width = dim + 1
        unit = np.vstack([np.zeros(dim), np.eye(dim)])
        middles = np.array([np.delete(unit, i, axis=0).mean(axis=0) for i in range(width)])
        means = values[dofs[:, partners(theirs, middles)]]
        faces, means = faces_of_cells(corners[:, :width], means)
        return on_faces(source, name, mesh.geometry.x, faces, means.reshape(len(means), *vector))

    order = max(degree, cmap.degree) if degree else 0
    _, nodes = nodes_of(shape, max(order, 1))
    # The map of a cell is linear in its nodes: what it makes of each of them alone.
    each = np.eye(corners.shape[1])
    phi = np.column_stack([cmap.push_forward(nodes, np.ascontiguousarray(each[:, [k, k]]))[:, 0] for k in range(len(each))])
    places = np.einsum("nk,ckx->cnx", phi, mesh.geometry.x[corners])
    if degree == 0:
        return functions(source, name, shape, 0, places, values[dofs].reshape(cells, 1, *vector))
    at = partners(theirs, nodes) if getattr(space.element, "interpolation_ident", False) else None
    if at is not None:
        found = values[dofs[:, at]].reshape(cells, len(nodes), *vector)
        return functions(source, name, shape, order, places, found, dofs[:, at])
    found = uh.eval(places.reshape(-1, 3), np.repeat(np.arange(cells, dtype=np.int32), len(nodes)))
    return functions(source, name, shape, order, places, found.reshape(cells, len(nodes), *vector))


def _degree(element):
    for known in ("embedded_superdegree", "embedded_degree", "degree"):
        if hasattr(element, known):
            return int(_of(element, known))
    raise usage("the degree of its element is not known", "interpolate it into a Lagrange space")
