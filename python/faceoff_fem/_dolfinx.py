"""dolfinx: a Function."""

import numpy as np

from ._arrays import faces_of_cells, functions, nodes_of, on_faces, partners, proved
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
    try:
        theirs = np.asarray(_of(space.element, "interpolation_points"))
    except RuntimeError as error:
        raise usage(f"{element} has no values between its points", "interpolate it into a Lagrange space", source) from error
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

    def places_of(nodes):
        # The map of a cell is linear in its nodes: what it makes of each of them alone.
        each = np.eye(corners.shape[1])
        phi = [cmap.push_forward(nodes, np.ascontiguousarray(each[:, [k, k]]))[:, 0] for k in range(len(each))]
        return np.einsum("nk,ckx->cnx", np.column_stack(phi), mesh.geometry.x[corners])

    def at(nodes):
        """Places and values, cell by cell, at points of the unit cell."""
        places = places_of(nodes)
        found = uh.eval(places.reshape(-1, 3), np.repeat(np.arange(cells, dtype=np.int32), len(nodes)))
        return places, found.reshape(cells, len(nodes), *vector)

    # The dofs of Lagrange spaces are values at nodes, and numbers of dofs those of points.
    if getattr(space.element, "interpolation_ident", False):
        order = max(degree, cmap.degree) if degree else 0
        _, nodes = nodes_of(shape, max(order, 1))
        if degree == 0:
            return functions(source, name, shape, 0, places_of(nodes), values[dofs].reshape(cells, 1, *vector))
        of_nodes = partners(theirs, nodes)
        if of_nodes is not None:
            found = values[dofs[:, of_nodes]].reshape(cells, len(nodes), *vector)
            return functions(source, name, shape, order, places_of(nodes), found, dofs[:, of_nodes])
    order, places, found = proved(source, shape, degree, cmap.degree, at, values)
    return functions(source, name, shape, order, places, found)


def _degree(element):
    for known in ("embedded_superdegree", "embedded_degree", "degree"):
        if hasattr(element, known):
            return int(_of(element, known))
    raise usage("the degree of its element is not known", "interpolate it into a Lagrange space")
