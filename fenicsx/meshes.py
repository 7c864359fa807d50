"""Meshes of paper.py, as arrays: points (N, 2), cells (M, 3), boundary faces (K, 2), their labels (K,)."""

from pathlib import Path

import compat

# isort: split
import numpy as np
from dolfinx import io
from dolfinx import mesh as dmesh
from mpi4py import MPI

COMM = MPI.COMM_SELF


def square(n):
    """Union Jack on the unit square, labelled as FreeFEM's `square`: 1 bottom, 2 right, 3 top, 4 left."""
    corners = [np.zeros(2), np.ones(2)]
    mesh = dmesh.create_rectangle(
        COMM, corners, [n, n], dmesh.CellType.triangle, diagonal=dmesh.DiagonalType.right_left
    )
    mesh.topology.create_connectivity(1, 2)
    sides = [lambda x: x[1] < 1e-9, lambda x: x[0] > 1 - 1e-9, lambda x: x[1] > 1 - 1e-9, lambda x: x[0] < 1e-9]
    facets = [dmesh.locate_entities_boundary(mesh, 1, side) for side in sides]
    return _arrays(mesh, np.concatenate(facets), np.repeat([1, 2, 3, 4], [len(of) for of in facets]))


def read(name):
    """Gmsh's .msh with physical groups by gmsh (pip install gmsh), or .xdmf with a grid `mesh` and tags `facets`: dolfinx's readers."""
    if Path(name).suffix == ".xdmf":
        with io.XDMFFile(COMM, name, "r") as file:
            mesh = file.read_mesh(name="mesh")
            mesh.topology.create_connectivity(1, 2)
            tags = file.read_meshtags(mesh, name="facets")
    else:
        import gmsh

        gmsh.initialize()
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(name)
        mesh, tags = compat.mesh_of_gmsh(gmsh.model, COMM)
        gmsh.finalize()
    return _arrays(mesh, tags.indices, tags.values)


def _arrays(mesh, facets, labels):
    for dim in (1, 2):
        mesh.topology.create_connectivity(dim, 0)
    cells = compat.geometry_dofs(mesh)
    of_vertex = np.zeros(mesh.topology.index_map(0).size_local, dtype=np.int64)
    of_vertex[compat.rows(mesh.topology.connectivity(2, 0))] = cells
    boundary = of_vertex[compat.rows(mesh.topology.connectivity(1, 0))[facets]]
    return mesh.geometry.x[:, :2].copy(), cells.astype(np.int64), boundary, np.asarray(labels, dtype=np.int64)


def cut(points, cells, boundary, labels, m):
    """Every cell cut into m × m, those of cell c being c m² … (c+1) m² - 1."""
    lattice = [(i, j) for j in range(m + 1) for i in range(m + 1 - j)]
    at = {place: k for k, place in enumerate(lattice)}
    up = [(at[i, j], at[i + 1, j], at[i, j + 1]) for i, j in lattice if i + j < m]
    down = [(at[i + 1, j], at[i + 1, j + 1], at[i, j + 1]) for i, j in lattice if i + j < m - 1]
    weights = np.array([(m - i - j, i, j) for i, j in lattice]) / m
    along = np.array([(m - i, i) for i in range(m + 1)]) / m
    of_cells = np.einsum("kv,cvd->ckd", weights, points[cells])
    of_faces = np.einsum("kv,fvd->fkd", along, points[boundary])
    everywhere = np.concatenate([of_cells.reshape(-1, 2), of_faces.reshape(-1, 2)])
    _, first, number = np.unique(
        np.round(everywhere / np.ptp(points), 10), axis=0, return_index=True, return_inverse=True
    )
    number = number.ravel()
    in_cells = number[: len(cells) * len(lattice)].reshape(len(cells), -1)
    on_faces = number[len(cells) * len(lattice) :].reshape(len(boundary), -1)
    fine_cells = in_cells[:, np.array(up + down)].reshape(-1, 3)
    fine_faces = np.stack([on_faces[:, :-1], on_faces[:, 1:]], axis=2).reshape(-1, 2)
    return everywhere[first], fine_cells, fine_faces, np.repeat(labels, m)
