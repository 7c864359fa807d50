"""What VTK and Gmsh know of cells and files, as JSON: vtk_family.py places | write FOLDER | check FILE…

`places` prints the reference coordinates of the nodes of Gmsh's types by number. `write` writes one grid of each kind in
each form that VTK has, and prints what VTK reads again. `check` evaluates each cell whose nodes are at the reference
coordinates, where the map from parameters to space is the identity if the nodes are in the right order: the largest
deviation, and the number of cells that were checked.
"""

import json
import pathlib
import random
import sys

import vtk
from corpus import with_vtk

random.seed(5)


def places():
    import gmsh

    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    told = {}
    families = {"Line": 10, "Triangle": 10, "Quadrangle": 10, "Tetrahedron": 10, "Hexahedron": 9, "Prism": 2, "Pyramid": 1}
    numbers = [(family, order, False) for family, most in families.items() for order in range(1, most + 1)]
    numbers += [(family, 2, True) for family in ("Quadrangle", "Hexahedron", "Prism", "Pyramid")]
    for family, order, serendipity in numbers:
        number = gmsh.model.mesh.getElementType(family, order, serendipity)
        _, dim, _, count, found, _ = gmsh.model.mesh.getElementProperties(number)
        rows = [list(found[dim * k : dim * k + dim]) + [0] * (3 - dim) for k in range(count)]
        for row in rows:
            for axis in range(dim):
                if family in ("Line", "Quadrangle", "Hexahedron") or (family == "Prism" and axis == 2):
                    row[axis] = (row[axis] + 1) / 2
        told[number] = rows
    return told


def check(path):
    reader = vtk.vtkGenericDataObjectReader() if path.endswith(".vtk") else vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    grid = reader.GetOutput()
    worst, inside = 0.0, [[0.21, 0.17, 0.13], [0.1, 0.3, 0.4], [0.5, 0.2, 0.05]]
    for k in range(grid.GetNumberOfCells()):
        cell = grid.GetCell(k)
        dim = cell.GetCellDimension()
        # The pyramid of VTK has other parameters; its nodes are checked by where the base and the top are.
        for p in inside if cell.GetCellType() not in (14, 27) else [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.5, 0.5, 1.0]]:
            p = p[:dim] + [0.0] * (3 - dim)
            if cell.GetCellType() in (14, 27):
                want = [[-1, -1, 0], [1, 1, 0], [0, 0, 1]][[[0.0] * 3, [1.0, 1.0, 0.0], [0.5, 0.5, 1.0]].index(p)]
            else:
                want = p
            x, weights = [0.0] * 3, [0.0] * cell.GetNumberOfPoints()
            cell.EvaluateLocation(vtk.reference(0), p, x, weights)
            worst = max(worst, *(abs(a - b) for a, b in zip(x, want, strict=True)))
    return [worst, grid.GetNumberOfCells()]


def array(of, name, components, tuples, values):
    made = of()
    made.SetName(name)
    made.SetNumberOfComponents(components)
    made.SetNumberOfTuples(tuples)
    for k in range(components * tuples):
        made.SetValue(k, values(k))
    return made


def with_data(grid):
    points, cells = grid.GetNumberOfPoints(), grid.GetNumberOfCells()
    for data, count in ((grid.GetPointData(), points), (grid.GetCellData(), cells)):
        data.AddArray(array(vtk.vtkDoubleArray, "u and more", 1, count, lambda _: random.random()))
        data.AddArray(array(vtk.vtkFloatArray, "v", 3, count, lambda _: random.randrange(100)))
        data.AddArray(array(vtk.vtkLongLongArray, "whole", 1, count, lambda k: k**3))
        data.AddArray(array(vtk.vtkUnsignedCharArray, "bytes", 2, count, lambda k: k % 251))
        data.AddArray(array(vtk.vtkStringArray, "words", 1, count, lambda k: f"word {k}"))
    data = grid.GetPointData()
    data.SetScalars(array(vtk.vtkShortArray, "scalars", 2, points, lambda k: k - 50))
    data.SetVectors(array(vtk.vtkFloatArray, "vectors", 3, points, lambda k: k / 7))
    data.SetNormals(array(vtk.vtkDoubleArray, "normals", 3, points, lambda k: k / 9))
    data.SetTensors(array(vtk.vtkDoubleArray, "tensors", 9, points, lambda k: k / 11))
    data.SetTCoords(array(vtk.vtkFloatArray, "texture", 2, points, lambda k: k / 13))
    grid.GetCellData().SetGlobalIds(array(vtk.vtkIdTypeArray, "ids", 1, cells, lambda k: 3 * k))
    grid.GetCellData().SetPedigreeIds(array(vtk.vtkIdTypeArray, "names", 1, cells, lambda k: 5 * k))
    grid.GetFieldData().AddArray(array(vtk.vtkDoubleArray, "TIME", 1, 1, lambda _: 0.25))
    grid.GetFieldData().AddArray(array(vtk.vtkStringArray, "title", 1, 1, lambda _: "a title"))
    return grid


def some_points(count):
    points = vtk.vtkPoints()
    points.SetDataTypeToDouble()
    for _ in range(count):
        points.InsertNextPoint(*(random.random() for _ in range(3)))
    return points


def unstructured():
    grid = vtk.vtkUnstructuredGrid()
    grid.SetPoints(some_points(130))
    types = [(1, 1), (2, 3), (3, 2), (4, 4), (5, 3), (6, 5), (7, 5), (7, 4), (8, 4), (9, 4), (10, 4), (11, 8), (12, 8), (13, 6),
             (14, 5), (15, 10), (16, 12), (21, 3), (22, 6), (23, 8), (24, 10), (25, 20), (26, 15), (27, 13), (28, 9), (29, 27),
             (30, 6), (31, 12), (32, 18), (33, 24), (34, 7), (35, 4), (36, 12), (37, 19), (41, 9), (68, 4), (69, 10), (69, 15), (70, 16),
             (70, 8), (71, 20), (72, 64), (72, 27), (73, 18), (73, 40), (75, 4), (76, 10), (77, 16), (78, 20), (79, 27), (80, 18)]
    for code, count in types:
        grid.InsertNextCell(code, count, random.sample(range(130), count))
    for faces in ([5, 4, 0, 1, 2, 3, 3, 0, 1, 4, 3, 1, 2, 4, 3, 2, 3, 4, 3, 3, 0, 4], [4, 3, 5, 6, 7, 3, 5, 6, 8, 3, 6, 7, 8, 3, 5, 7, 8]):
        stream = vtk.vtkIdList()
        for number in faces:
            stream.InsertNextId(number)
        grid.InsertNextCell(42, stream)
        grid.InsertNextCell(5, 3, [7, 8, 9])
    degrees = [[3, 1, 1] if code == 70 and count == 8 else [2, 2, 2] if count in (27, 18) else [3, 3, 3] for code, count in types]
    degrees = [row for row in degrees + [[1, 1, 1]] * 4 for row in row]
    grid.GetCellData().SetHigherOrderDegrees(array(vtk.vtkDoubleArray, "HigherOrderDegrees", 3, len(types) + 4, lambda k: degrees[k]))
    return grid


def poly():
    grid = vtk.vtkPolyData()
    grid.SetPoints(some_points(40))
    for set_cells, sizes in ((grid.SetStrips, (5, 4, 3)), (grid.SetPolys, (3, 4, 5, 6, 9)), (grid.SetLines, (2, 3, 7)), (grid.SetVerts, (1, 1, 3))):
        cells = vtk.vtkCellArray()
        for size in sizes:
            cells.InsertNextCell(size, random.sample(range(40), size))
        set_cells(cells)
    return grid


def image(dimensions):
    grid = vtk.vtkImageData()
    grid.SetExtent(*(end for count in dimensions for end in (2, 1 + count)))
    grid.SetOrigin(0.5, -1, 2)
    grid.SetSpacing(0.25, 0.5, 2)
    grid.SetDirectionMatrix(0, 1, 0, -1, 0, 0, 0, 0, 1)
    return grid


def flat_image():
    grid = vtk.vtkImageData()
    grid.SetDimensions(5, 1, 4)
    grid.SetOrigin(0.5, -1, 2)
    return grid


def rectilinear():
    grid = vtk.vtkRectilinearGrid()
    grid.SetDimensions(3, 4, 2)
    for axis, count in zip("XYZ", (3, 4, 2), strict=True):
        getattr(grid, f"Set{axis}Coordinates")(array(vtk.vtkFloatArray, axis, 1, count, lambda k: k * k / 2))
    return grid


def structured():
    grid = vtk.vtkStructuredGrid()
    grid.SetDimensions(3, 2, 4)
    grid.SetPoints(some_points(24))
    return grid


def write(folder):
    told = {}
    kinds = {"vtu": (unstructured(), "UnstructuredGrid"), "vtp": (poly(), "PolyData"), "vti": (image((3, 4, 2)), "ImageData"),
             "vtr": (rectilinear(), "RectilinearGrid"), "vts": (structured(), "StructuredGrid"), "line.vti": (image((5, 1, 1)), "ImageData"),
             "flat.vti": (flat_image(), "ImageData")}
    compressors = [None, vtk.vtkZLibDataCompressor, vtk.vtkLZ4DataCompressor, vtk.vtkLZMADataCompressor]
    for suffix, (grid, name) in kinds.items():
        with_data(grid)
        paths = []
        for mode in range(3):
            for squeeze, compressor in enumerate(compressors):
                for wide in range(2):
                    path = str(folder / f"{mode}{squeeze}{wide}.{suffix}")
                    writer = getattr(vtk, f"vtkXML{name}Writer")()
                    writer.SetDataMode(mode)
                    writer.SetCompressor(compressor and compressor())
                    writer.SetHeaderType(64 if wide else 32)
                    writer.SetByteOrder(0 if wide else 1)
                    writer.SetEncodeAppendedData(squeeze % 2)
                    writer.SetBlockSize(256)
                    paths.append((path, writer))
        if name != "ImageData" or suffix == "flat.vti":  # the legacy writer does not hold where an image begins
            for mode in (1, 2):
                for version in (42, 51):
                    path = str(folder / f"{mode}{version}.{suffix}.vtk")
                    writer = getattr(vtk, f"vtk{name}Writer" if name != "ImageData" else "vtkStructuredPointsWriter")()
                    writer.SetFileType(mode)
                    writer.SetFileVersion(version)
                    paths.append((path, writer))
        for path, writer in paths:
            writer.SetFileName(path)
            writer.SetInputData(grid)
            writer.Write()
            told[path] = with_vtk(path)
    return told


if __name__ == "__main__":
    tasks = {"places": lambda _: places(), "write": lambda words: write(pathlib.Path(words[0])), "check": lambda words: [check(p) for p in words]}
    json.dump(tasks[sys.argv[1]](sys.argv[2:]), sys.stdout, default=float)
