"""meshio, VTK and PyVista."""

import meshio
import numpy as np
import pytest
import pyvista
from common import cubes, quadratic, sampled

import faceoff_fem as fo


def as_meshio(kind, given, permutation):
    (nodes,) = given["cells"].values()
    points = np.zeros((len(given["points"]), 3))
    points[:, : given["points"].shape[1]] = given["points"]
    return meshio.Mesh(points, [(kind, nodes[:, permutation])], point_data={name: of.copy() for name, of in given["point_data"].items()})


def test_meshio_both_ways():
    given = sampled(quadratic, 4, 2)
    made = as_meshio("triangle6", given, range(6))
    made.cell_data["c"] = [np.arange(32.0)]
    made.cell_sets["left"] = [np.arange(5)]
    assert fo.compare(made, given, only=["u"])
    mesh = fo.Mesh(made)
    assert mesh.groups[0].name == "left" and list(mesh.groups[0].cells) == [0, 1, 2, 3, 4]
    back = mesh.to_meshio()
    assert fo.compare(back, made) and np.array_equal(back.cells[0].data, made.cells[0].data)
    assert np.array_equal(back.cell_sets["left"][0], np.arange(5))


def test_orders_of_nodes_are_those_of_the_library():
    """meshio has two nodes of a tetrahedron of order 2 in another order than Gmsh."""
    given = cubes(quadratic, 2)
    theirs = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]
    assert fo.compare(as_meshio("tetra10", given, theirs), cubes(quadratic), rtol=1e-12)
    # In a wrong order cells are folded.
    with pytest.raises(fo.Error, match="folded"):
        fo.compare(as_meshio("tetra10", given, range(10)), cubes(quadratic), rtol=1e-3)
    (nodes,) = given["cells"].values()
    grid = pyvista.UnstructuredGrid({pyvista.CellType.QUADRATIC_TETRA: nodes[:, theirs]}, given["points"])
    grid.point_data["u"] = given["point_data"]["u"]
    assert fo.compare(grid, cubes(quadratic), rtol=1e-12)
    grid = pyvista.UnstructuredGrid({pyvista.CellType.QUADRATIC_TETRA: nodes}, given["points"])
    grid.point_data["u"] = given["point_data"]["u"]
    with pytest.raises(fo.Error, match="folded"):
        fo.compare(grid, cubes(quadratic), rtol=1e-3)


def test_grids_of_all_kinds(tmp_path):
    image = pyvista.ImageData(dimensions=(4, 5, 1), spacing=(0.5, 0.25, 1))
    image.point_data["u"] = quadratic(*image.points[:, :2].T)
    for grid in (image, image.cast_to_structured_grid(), image.cast_to_unstructured_grid(), image.extract_geometry()):
        grid.save(
            str(tmp_path / ("grid." + {"ImageData": "vti", "StructuredGrid": "vts", "PolyData": "vtp"}.get(type(grid).__name__, "vtu")))
        )
        assert fo.compare(grid, image.copy())
        other = grid.copy()
        other.point_data["u"][3] += 1
        assert not fo.compare(other, image)
    for file in tmp_path.iterdir():
        assert fo.compare(image, file), file
    with pytest.raises(fo.UsageError, match="blocks"):
        fo.compare(pyvista.MultiBlock([image]), image)
