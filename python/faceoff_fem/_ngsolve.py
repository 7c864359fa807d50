"""NGSolve: a GridFunction."""

import numpy as np

from ._arrays import faces_of_cells, functions, on_faces, proved
from .errors import usage


def arrays(uh, name=None):
    import ngsolve as ng

    space, mesh = uh.space, uh.space.mesh
    source = f"NGSolve GridFunction {uh.name!r}"
    if len(getattr(uh, "components", ())) and not space.type.startswith("Vector"):
        raise usage("it is a function of a product space", "give its parts, as gf.components[0]", source)
    shapes = {ng.ET.SEGM: "line", ng.ET.TRIG: "triangle", ng.ET.QUAD: "quadrangle", ng.ET.TET: "tetrahedron", ng.ET.HEX: "hexahedron"}
    kinds = {element.type for element in mesh.Elements(ng.VOL)}
    if len(kinds) != 1 or not kinds <= shapes.keys():
        raise usage("its cells are not of one known type", "compare files", source)
    (kind,) = kinds
    shape, dim = shapes[kind], mesh.dim
    name = name or "u"

    def at(nodes):
        """Places and values, cell by cell, at points of the unit cell."""
        rule = ng.IntegrationRule([tuple(node) for node in nodes.tolist()], [1.0] * len(nodes))
        points = mesh.MapToAllElements({kind: rule}, ng.VOL)
        places = np.column_stack([np.asarray(of(points)).reshape(-1) for of in (ng.x, ng.y, ng.z)[:dim]])
        try:
            values = np.asarray(uh(points))
        except Exception as error:
            raise usage(
                f"NGSolve does not evaluate it inside cells ({error})", "compare what lives on faces as rows of values", source
            ) from error
        scalar = () if uh.dim == 1 else (uh.dim,)
        return places.reshape(-1, len(nodes), dim), values.reshape(-1, len(nodes), *scalar)

    if "nonconforming" in space.type.lower():
        width = dim + 1
        unit = np.vstack([np.zeros(dim), np.eye(dim)])
        _, means = at(np.array([np.delete(unit, i, axis=0).mean(axis=0) for i in range(width)]))
        corners, _ = at(unit)
        places = np.array([vertex.point for vertex in mesh.vertices])
        cells = np.array([[v.nr for v in element.vertices] for element in mesh.Elements(ng.VOL)])
        # The corners in the order of the unit cell, found by their places.
        far = np.abs(places[cells][:, None, :, :] - corners[:, :, None, :]).max(axis=3)
        cells = np.take_along_axis(cells, far.argmin(axis=2), axis=1)
        faces, means = faces_of_cells(cells, means)
        return on_faces(source, name, places, faces, means)

    # An order of 0 of H(div) and H(curl) has linear functions.
    order, places, values = proved(source, shape, space.globalorder, mesh.GetCurveOrder(), at, uh.vec.FV().NumPy())
    return functions(source, name, shape, order, places, values)
