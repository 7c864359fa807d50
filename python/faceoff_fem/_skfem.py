"""scikit-fem: a basis and its dofs."""

import numpy as np

from ._arrays import faces_of_cells, functions, on_faces, proved
from .errors import usage

SHAPES = {
    "RefLine": "line",
    "RefTri": "triangle",
    "RefQuad": "quadrangle",
    "RefTet": "tetrahedron",
    "RefHex": "hexahedron",
}


def arrays(pair, name=None):
    from skfem import Basis

    basis, x = pair
    mesh, element = basis.mesh, basis.elem
    source = f"scikit-fem {type(element).__name__}"
    if len(x) != basis.N:
        raise usage(f"{len(x)} values for {basis.N} dofs", "give all dofs of the basis", source)
    if hasattr(element, "elems"):
        raise usage("it is a function of a mixed element", "give its parts, as basis.split(x)[0]", source)
    shape = SHAPES.get(mesh.elem.refdom.__name__)
    if shape is None:
        raise usage(f"cells of {mesh.elem.refdom.__name__} are not known", "compare files", source)
    name = name or "u"

    def at(nodes):
        """Places and values, cell by cell, at points of the unit cell."""
        rule = (np.ascontiguousarray(nodes.T), np.ones(len(nodes)))
        here = Basis(mesh, element, mapping=basis.mapping, quadrature=rule)
        places = np.moveaxis(here.mapping.F(rule[0]), 0, 2)
        # (…, cells, nodes) becomes (cells, nodes, …).
        return places, np.moveaxis(np.asarray(here.interpolate(x)), (-2, -1), (0, 1))

    part = getattr(element, "elem", element)
    if type(part).__name__ in ("ElementTriCR", "ElementTetCR"):
        width = mesh.t.shape[0]
        unit = np.vstack([np.zeros(width - 1), np.eye(width - 1)])
        _, means = at(np.array([np.delete(unit, i, axis=0).mean(axis=0) for i in range(width)]))
        faces, means = faces_of_cells(mesh.t.T, means)
        return on_faces(source, name, mesh.p.T, faces, means)

    order, places, values = proved(source, shape, _order(part, shape), _order(mesh.elem(), shape), at, x)
    return functions(source, name, shape, order, places, values)


def _order(element, shape):
    """The degree in each coordinate; of boxes scikit-fem has the total one."""
    return -(-element.maxdeg // {"quadrangle": 2, "hexahedron": 3}.get(shape, 1))
