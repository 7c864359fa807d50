"""The formats on HDF5 and netCDF as other programs write and read them, as JSON: hdf5_family.py write FOLDER | read FILE…

`write` writes files with meshio, Gmsh, netCDF4 and VTK, and prints of each the number of points, of cells by their number of
nodes, the sizes of groups by name, and the sum of `u`. `read` prints the same of files as each program that reads them sees it.
"""

import json
import os
import pathlib
import sys

import numpy as np

POINTS = np.array([[x, y, z] for z in (0.0, 1) for y in (0.0, 1) for x in (0.0, 1, 2)])
HEXES = np.array([[0, 1, 4, 3, 6, 7, 10, 9], [1, 2, 5, 4, 7, 8, 11, 10]])
U = np.arange(12.0) ** 2


def told(points, cells, groups=None, total=None):
    counts = {}
    for nodes, count in cells:
        if count:
            counts[str(nodes)] = counts.get(str(nodes), 0) + int(count)
    return {"points": int(points), "cells": counts, "groups": groups, "u": None if total is None else float(total)}


def write_meshio(folder):
    import meshio

    mesh = meshio.Mesh(POINTS, [("hexahedron", HEXES)], point_data={"u": U})
    seen = told(12, [(8, 2)], None, U.sum())
    for name, options in (
        ("xml.xdmf", {"data_format": "XML"}),
        ("hdf.xdmf", {"data_format": "HDF"}),
        ("bytes.xdmf", {"data_format": "Binary"}),
        ("a.e", {}),
        ("a.med", {}),
    ):
        meshio.write(folder / name, mesh, **options)
        yield name, seen
    # Its data go to the folder that one is in.
    os.chdir(folder)
    with meshio.xdmf.TimeSeriesWriter("series.xdmf") as series:
        series.write_points_cells(POINTS, mesh.cells)
        for time in (0.0, 1.0, 2.5):
            series.write_data(time, point_data={"u": U * time})
    yield "series.xdmf", told(12, [(8, 2)], None, 3.5 * U.sum())


def write_netcdf(folder):
    import netCDF4

    for kind in ("NETCDF3_CLASSIC", "NETCDF3_64BIT_OFFSET", "NETCDF3_64BIT_DATA", "NETCDF4"):
        name = f"{kind}.e"
        with netCDF4.Dataset(folder / name, "w", format=kind) as file:
            sizes = {"len_name": 9, "num_dim": 3, "num_nodes": 12, "num_el_blk": 1, "num_el_in_blk1": 2, "num_nod_per_el1": 8}
            sizes |= {"time_step": None, "num_nod_var": 1, "num_side_sets": 1, "num_side_ss1": 2, "num_node_sets": 1, "num_nod_ns1": 3}
            for dimension, size in sizes.items():
                file.createDimension(dimension, size)
            for axis, key in enumerate(("coordx", "coordy", "coordz")):
                file.createVariable(key, "f8", ("num_nodes",))[:] = POINTS[:, axis]
            file.createVariable("connect1", "i4", ("num_el_in_blk1", "num_nod_per_el1"))[:] = HEXES + 1
            file["connect1"].elem_type = "HEX8"
            for word, count, names in (("eb", "num_el_blk", "wood"), ("ss", "num_side_sets", "ends"), ("ns", "num_node_sets", "pins")):
                file.createVariable(f"{word}_prop1", "i4", (count,))[:] = [7]
                text = file.createVariable(f"{word}_names", "S1", (count, "len_name"))
                text[0, : len(names)] = np.array(list(names), dtype="S1")
            file.createVariable("elem_ss1", "i4", ("num_side_ss1",))[:] = [1, 2]
            file.createVariable("side_ss1", "i4", ("num_side_ss1",))[:] = [4, 2]
            file.createVariable("node_ns1", "i4", ("num_nod_ns1",))[:] = [1, 5, 12]
            file.createVariable("time_whole", "f8", ("time_step",))
            file.createVariable("vals_nod_var1", "f8", ("time_step", "num_nodes"))
            text = file.createVariable("name_nod_var", "S1", ("num_nod_var", "len_name"))
            text[0, :1] = np.array(["u"], dtype="S1")
            for step, time in enumerate((0.5, 2.0)):
                file["time_whole"][step] = time
                file["vals_nod_var1"][step] = U * time
        yield name, told(12, [(8, 2), (4, 2), (1, 3)], {"wood": 2, "ends": 2, "pins": 3}, 2.5 * U.sum())


def write_gmsh(folder):
    import gmsh

    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    for order in (1, 2):
        gmsh.clear()
        gmsh.option.setNumber("Mesh.ElementOrder", order)
        square = gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
        disk = gmsh.model.occ.addDisk(3, 0, 0, 1, 1)
        gmsh.model.occ.addBox(5, 0, 0, 1, 1, 1)
        gmsh.model.occ.synchronize()
        gmsh.model.mesh.setTransfiniteSurface(square)
        gmsh.model.mesh.setRecombine(2, square)
        for surface in (square, disk):
            gmsh.model.occ.extrude([(2, surface)], 0, 0, 1, [2], recombine=True)
        gmsh.model.occ.synchronize()
        for _, volume in gmsh.model.getEntities(3):
            gmsh.model.addPhysicalGroup(3, [volume], name=f"volume {volume}")
        gmsh.model.addPhysicalGroup(2, [square], name="bottom")
        gmsh.model.mesh.generate(3)
        sizes, cells = {}, []
        for dim, tag in gmsh.model.getPhysicalGroups():
            sizes[gmsh.model.getPhysicalName(dim, tag)] = 0
            for entity in gmsh.model.getEntitiesForPhysicalGroup(dim, tag):
                for kind, tags, _ in zip(*gmsh.model.mesh.getElements(dim, entity), strict=True):
                    sizes[gmsh.model.getPhysicalName(dim, tag)] += len(tags)
                    cells.append((gmsh.model.mesh.getElementProperties(kind)[3], len(tags)))
        gmsh.option.setNumber("Mesh.SaveAll", 0)
        for suffix in ("msh", "med", "cgns"):
            gmsh.write(str(folder / f"order{order}.{suffix}"))
        gmsh.open(str(folder / f"order{order}.msh"))
        count = len(gmsh.model.mesh.getNodes()[0])
        for suffix in ("med", "cgns"):
            yield f"order{order}.{suffix}", told(count, cells, sizes)


def write_vtk(folder):
    import vtk

    grid, points = vtk.vtkUnstructuredGrid(), vtk.vtkPoints()
    for point in POINTS:
        points.InsertNextPoint(point)
    grid.SetPoints(points)
    # A tetrahedron before the two cubes, which are polyhedra.
    grid.InsertNextCell(vtk.VTK_TETRA, 4, (0, 1, 3, 6))
    for a, b, c, d, e, f, g, h in HEXES.tolist():
        faces = vtk.vtkIdList()
        for number in (6, 4, a, b, c, d, 4, e, f, g, h, 4, a, b, f, e, 4, b, c, g, f, 4, c, d, h, g, 4, d, a, e, h):
            faces.InsertNextId(number)
        grid.InsertNextCell(vtk.VTK_POLYHEDRON, faces)
    writer = vtk.vtkHDFWriter()
    writer.SetFileName(str(folder / "polyhedra.vtkhdf"))
    writer.SetInputData(grid)
    writer.Write()
    yield "polyhedra.vtkhdf", told(12, [(4, 1), (8, 2)])


def write(folder):
    folder = pathlib.Path(folder)
    files = (*write_meshio(folder), *write_netcdf(folder), *write_gmsh(folder), *write_vtk(folder))
    return {str(folder / name): seen for name, seen in files}


def with_vtk(path):
    import vtk
    from vtk.util.numpy_support import vtk_to_numpy

    kinds = {".e": vtk.vtkExodusIIReader, ".vtkhdf": vtk.vtkHDFReader, ".xdmf": vtk.vtkXdmfReader, ".cgns": vtk.vtkCGNSReader}
    if path.suffix not in kinds:
        return None
    reader = kinds[path.suffix]()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    if path.suffix == ".e":
        reader.SetAllArrayStatus(reader.NODAL, 1)
    if path.suffix == ".cgns":
        reader.EnableAllBases()
        reader.GetPointDataArraySelection().EnableAllArrays()
    reader.Update()
    data = reader.GetOutputDataObject(0)
    parts = [data]
    if data.IsA("vtkCompositeDataSet"):
        walk, parts = data.NewIterator(), []
        walk.InitTraversal()
        while not walk.IsDoneWithTraversal():
            parts.append(walk.GetCurrentDataObject())
            walk.GoToNextItem()
    cells = [(part.GetCell(k).GetNumberOfPoints(), 1) for part in parts for k in range(part.GetNumberOfCells())]
    u = {}
    for part in parts:
        array = part.GetPointData().GetArray("u")
        if array:
            u.update({part.GetPoint(k): value for k, value in enumerate(vtk_to_numpy(array))})
    points = {part.GetPoint(k) for part in parts for k in range(part.GetNumberOfPoints())}
    return told(len(points), cells, None, sum(u.values()) if u else None)


def with_meshio(path):
    import meshio

    if path.suffix in (".vtkhdf", ".cgns"):
        return None
    mesh = meshio.read(path)
    cells = [(block.data.shape[1], len(block.data)) for block in mesh.cells]
    return told(len(mesh.points), cells, None, mesh.point_data["u"].sum() if "u" in mesh.point_data else None)


def with_gmsh(path):
    import gmsh

    if path.suffix not in (".med", ".cgns"):
        return None
    if not gmsh.isInitialized():
        gmsh.initialize(interruptible=False)
        gmsh.option.setNumber("General.Terminal", 0)
    gmsh.clear()
    gmsh.open(str(path))
    sizes = {}
    for dim, tag in gmsh.model.getPhysicalGroups():
        entities = gmsh.model.getEntitiesForPhysicalGroup(dim, tag)
        tags = [gmsh.model.mesh.getElements(dim, entity)[1] for entity in entities]
        sizes[gmsh.model.getPhysicalName(dim, tag)] = sum(len(some) for all in tags for some in all)
    kinds, tags, _ = gmsh.model.mesh.getElements()
    cells = [(gmsh.model.mesh.getElementProperties(kind)[3], len(some)) for kind, some in zip(kinds, tags, strict=True)]
    return told(len(gmsh.model.mesh.getNodes()[0]), cells, sizes)


def read(*paths):
    programs = {"vtk": with_vtk, "meshio": with_meshio, "gmsh": with_gmsh}
    seen = {}
    for path in map(pathlib.Path, paths):
        found = {name: see(path) for name, see in programs.items()}
        seen[str(path)] = {name: one for name, one in found.items() if one}
    return seen


if __name__ == "__main__":
    print("\n" + json.dumps({"write": write, "read": read}[sys.argv[1]](*sys.argv[2:])))
