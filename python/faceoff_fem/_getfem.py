"""GetFEM: a MeshFem and its dofs."""

import re

import numpy as np

from ._arrays import faces_of_cells, functions, merged, nodes_to_try, on_faces, partners, represents
from .errors import usage

SIMPLICES = {1: "line", 2: "triangle", 3: "tetrahedron"}
BOXES = {1: "line", 2: "quadrangle", 3: "hexahedron"}


def _all(found):
    """What GetFEM returns as one, several, or several with their places."""
    found = found[0] if isinstance(found, tuple) else found
    return list(found) if isinstance(found, (list, tuple, np.ndarray)) else [found]


def arrays(pair, name=None):
    import getfem as gf

    space, dofs = pair
    dofs = np.asarray(dofs).reshape(-1)
    mesh, element = space.linked_mesh(), _all(space.fem())[0]
    source = f"GetFEM {element.char()}"
    if len(dofs) != space.nbdof():
        raise usage(f"{len(dofs)} values for {space.nbdof()} dofs", "give all dofs of the MeshFem", source)
    kinds = {kind.char(): kind for kind in _all(mesh.geotrans())}
    (char, kind), *others = kinds.items()
    dim = int(kind.dim())
    is_simplex = char.startswith(f"GT_PK({dim},")
    # A product of segments, whatever it is called.
    is_box = re.fullmatch(r"(GT_QK\(\d,\d\)|GT(_LINEAR)?_PRODUCT\(|GT_PK\(1,\d+\)|[,)])+", char) is not None
    if others or not (is_simplex or is_box):
        raise usage(f"cells of {', '.join(sorted(kinds))} are not known", "compare files", source)
    shape = (SIMPLICES if is_simplex else BOXES)[dim]
    name, components = name or "u", space.qdim()
    scalar = () if components == 1 else (components,)
    curve = int(char.split(",")[1].rstrip(")")) if is_simplex else round(int(kind.nbpts()) ** (1 / dim)) - 1

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
        return _all(target.fem())[0].pts().T, places, values

    # Of a box GetFEM has the total degree.
    degree = -(-int(element.estimated_degree()) // (1 if is_simplex else dim))
    order = max(degree, curve) if degree else 0
    # A degree is not believed: the function is held against its values at the nodes of a higher one.
    probes, _, expected = nodal(max(order, 1) + 3)
    while True:
        nodes = nodes_to_try(source, shape, order)
        theirs, places, values = nodal(max(order, 1))
        at = partners(theirs, nodes)
        places, values = places[:, at], values[:, at]
        if represents(shape, order, nodes, values, probes, expected):
            break
        order = max(order + 1, curve)
    if all("NONCONFORMING" in of.char() for of in _all(space.fem())):
        width = places.shape[1]
        # From the values at its corners, the mean on the face opposite each.
        means = np.stack([np.delete(values, i, axis=1).mean(axis=1) for i in range(width)], axis=1)
        corners = places.reshape(-1, places.shape[2])
        points, numbers = merged(corners)
        faces, means = faces_of_cells(numbers.reshape(places.shape[:2]), means)
        return on_faces(source, name, points, faces, means)
    return functions(source, name, shape, order, places, values)
