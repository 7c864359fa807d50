"""Every dof of every space is seen: where one of them changes, so does what is compared. Or the space is refused in words."""

import os
from importlib.util import find_spec

import numpy as np
import pytest

import faceoff_fem as fo
from faceoff_fem._adapters import side


def skfem_spaces():
    import skfem

    meshes = {"Tri": skfem.MeshTri(), "Quad": skfem.MeshQuad(), "Tet": skfem.MeshTet(), "Hex": skfem.MeshHex()}
    names = {
        "Tri": "P0 P1 P2 P3 P4 CR RT0 RT1 RT2 BDM1 N1 N2 N3 Mini P1B P2B P2G P1G CCR Morley Argyris Hermite 15ParamPlate HHJ0 HHJ1"
        " SkeletonP0",
        "Quad": "0 1 2 S2 RT0 RT1 N1 BFS",
        "Tet": "P0 P1 P2 CR RT0 N0 Mini CCR",
        "Hex": "0 1 2 S2 RT1 C1",
    }
    for shape, mesh in meshes.items():
        for name in names[shape].split():
            element = getattr(skfem, f"Element{shape}{name}", None)
            if element is not None:
                basis = skfem.Basis(mesh, element())
                yield f"skfem {shape}{name}", basis.N, lambda x, basis=basis: (basis, x)


def ngsolve_spaces():
    import ngsolve as ng
    from netgen.csg import unit_cube
    from netgen.geom2d import unit_square

    for mesh in (ng.Mesh(unit_square.GenerateMesh(maxh=2)), ng.Mesh(unit_cube.GenerateMesh(maxh=1))):
        kinds = [("H1", {"order": k}) for k in (1, 2, 3)] + [("L2", {"order": k}) for k in (0, 1, 2)]
        kinds += [("HCurl", {"order": k}) for k in (0, 1)] + [("HCurl", {"order": 2, "type1": True})]
        kinds += [("HDiv", {"order": k}) for k in (0, 1)] + [("HDiv", {"order": k, "RT": True}) for k in (0, 1)]
        kinds += [("VectorH1", {"order": 2}), ("VectorL2", {"order": 1}), ("FacetFESpace", {"order": 1})]
        kinds += [(name, {"order": k}) for name in ("HDivDiv", "HCurlCurl") for k in (0, 1)]
        spaces = [(f"{name} {options}", getattr(ng, name)(mesh, **options)) for name, options in kinds]
        for name, space in [*spaces, ("nonconforming", ng.FESpace("nonconforming", mesh, order=1))]:

            def make(x, space=space):
                function = ng.GridFunction(space, "u")
                function.vec.FV().NumPy()[:] = x
                return function

            yield f"ngsolve {mesh.dim}D {name}", space.ndof, make


def getfem_spaces():
    import getfem as gf

    mesh = gf.Mesh("triangles grid", [0, 1], [0, 1])
    names = "PK(2,0) PK(2,1) PK(2,2) PK(2,3) P1_NONCONFORMING RT0(2) NEDELEC(2) PK_DISCONTINUOUS(2,1) HERMITE(2) ARGYRIS MORLEY"
    for name in [*names.split(), "PK_WITH_CUBIC_BUBBLE(2,1)", "P1_BUBBLE_FACE(2)", "HCT_TRIANGLE"]:
        space = gf.MeshFem(mesh, 2 if name.startswith(("RT0", "NEDELEC")) else 1)
        space.set_fem(gf.Fem(f"FEM_{name}"))
        # A mesh ends with its last name, whatever refers to it.
        yield f"getfem {name}", space.nbdof(), lambda x, space=space, mesh=mesh: (space, x)


def dolfinx_spaces():
    from dolfinx import fem, mesh
    from mpi4py import MPI

    families = [("Lagrange", k) for k in (1, 2, 3)] + [("DG", k) for k in (0, 1, 2)] + [("CR", 1), ("RT", 1), ("RT", 2), ("BDM", 1)]
    families += [("N1curl", 1), ("N1curl", 2), ("N2curl", 1), ("Bubble", 3), ("Regge", 1), ("HHJ", 1)]
    boxes = [("Lagrange", 1), ("Lagrange", 2), ("DG", 0), ("DG", 1), ("RTCF", 1), ("RTCE", 1), ("DPC", 1), ("S", 2)]
    for cell, names in ((mesh.CellType.triangle, families), (mesh.CellType.quadrilateral, boxes)):
        square = mesh.create_unit_square(MPI.COMM_WORLD, 1, 1, cell)
        for name in names:
            space = fem.FunctionSpace(square, name)

            def make(x, space=space):
                function = fem.Function(space)
                function.x.array[:] = x
                function.name = "u"
                return function

            yield f"dolfinx {cell.name} {name}", space.dofmap.index_map.size_local * space.dofmap.index_map_bs, make


LIBRARIES = {"skfem": skfem_spaces, "ngsolve": ngsolve_spaces, "getfem": getfem_spaces, "dolfinx": dolfinx_spaces}
SPACES = [space for library, spaces in LIBRARIES.items() if find_spec(library) for space in spaces()]
#: Those without values inside cells, or with values that no file holds.
REFUSED = ("SkeletonP0", "FacetFESpace")
#: The dofs to change where not all are. A hexahedron with eight dofs at each vertex takes scikit-fem seconds a dof: three of them change, of
#: three kinds and at three vertices, in `tests/run --all`.
CHANGED = {"skfem HexC1": (0, 27, 54)}


def fields(thing):
    """What is compared: by name and carrier, values with the places of their points."""
    of = side(thing)
    return [np.concatenate([of.points.ravel(), np.asarray(values).ravel()]) for _, _, _, values in of.fields]


@pytest.mark.parametrize("name, count, make", SPACES, ids=[name for name, *_ in SPACES])
def test_a_change_of_any_dof_is_seen(name, count, make):
    if name in CHANGED and "FACEOFF_SCENES" not in os.environ:
        pytest.skip("tests/run --all changes its dofs")
    x = np.random.default_rng(0).random(count)
    try:
        base = fields(make(x))
    except fo.UsageError as refused:
        assert any(known in name for known in REFUSED) or "no polynomial" in str(refused), refused
        return
    assert not any(known in name for known in REFUSED), "it was not refused"
    for dof in CHANGED.get(name, range(count)):
        y = x.copy()
        y[dof] += 100.0
        other = fields(make(y))
        is_seen = any(a.shape != b.shape or np.abs(a - b).max() > 1e-6 * np.abs(b).max() for a, b in zip(base, other))
        assert is_seen, f"dof {dof} of {count}"
    y = x.copy()
    y[count // 2] += 100.0
    assert not fo.compare(make(x), make(y), rtol=1e-9)
    assert fo.compare(make(x), make(x.copy()), rtol=1e-9)
