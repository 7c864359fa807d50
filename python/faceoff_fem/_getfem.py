"""GetFEM: a MeshFem and its dofs."""

import numpy as np

from ._arrays import faces_of_cells, functions, nodes_of, on_faces, partners
from .errors import usage

SHAPES = {"GT_PK(1": "line", "GT_PK(2": "triangle", "GT_PK(3": "tetrahedron", "GT_QK(2": "quadrangle", "GT_QK(3": "hexahedron"}


def arrays(pair, name=None):
    import getfem as gf

    space, dofs = pair
    dofs = np.asarray(dofs).reshape(-1)
    mesh, element = space.linked_mesh(), space.fem()[0][0] if isinstance(space.fem(), tuple) else space.fem()[0]
    source = f"GetFEM {element.char()}"
    if len(dofs) != space.nbdof():
        raise usage(f"{len(dofs)} values for {space.nbdof()} dofs", "give all dofs of the MeshFem", source)
    transformations = mesh.geotrans()
    kinds = {trans.char() for trans in (transformations[0] if isinstance(transformations, tuple) else transformations)}
    shape = next((shape for start, shape in SHAPES.items() if len(kinds) == 1 and min(kinds).startswith(start)), None)
    if shape is None:
        raise usage(f"cells of {', '.join(sorted(kinds))} are not known", "compare files", source)
    name, components = name or "u", space.qdim()
    scalar = () if components == 1 else (components,)
    (curve,) = (int(kind.split(",")[1].rstrip(")")) for kind in kinds)

    def nodal(order):
        """Places and values at the nodes of each cell, by GetFEM's own interpolation into a discontinuous space."""
        target = gf.MeshFem(mesh, components)
        target.set_classical_discontinuous_fem(order)
        values = gf.compute_interpolate_on(space, dofs, target)
        numbers, _ = target.basic_dof_from_cvid()
        cells = mesh.nbcvs()
        numbers = np.asarray(numbers).reshape(cells, -1)
        places = target.basic_dof_nodes().T[numbers[:, ::components]]
        values = np.asarray(values).reshape(-1)[numbers].reshape(cells, -1, *scalar)
        found = target.fem()
        theirs = (found[0] if isinstance(found, tuple) else found)[0].pts().T
        return theirs, places, values

    degree = int(element.estimated_degree())
    order = max(degree, curve) if degree else 0
    kind, nodes = nodes_of(shape, max(order, 1))
    theirs, places, values = nodal(max(order, 1))
    at = partners(theirs, nodes)
    places, values = places[:, at], values[:, at]
    if "NONCONFORMING" in element.char():
        width = places.shape[1]
        # From the values at its corners, the mean on the face opposite each.
        means = np.stack([np.delete(values, i, axis=1).mean(axis=1) for i in range(width)], axis=1)
        corners = places.reshape(-1, places.shape[2])
        from ._arrays import merged

        points, numbers = merged(corners)
        faces, means = faces_of_cells(numbers.reshape(places.shape[:2]), means)
        return on_faces(source, name, points, faces, means)
    return functions(source, name, shape, order, places, values)
