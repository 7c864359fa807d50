"""The measures of cells by VTK's vtkMeshQuality, which is Verdict: quality.py FILE.vtu

Prints as JSON, for each cell, what it has of smallest angle, largest angle, aspect ratio, scaled Jacobian."""

import json
import sys

import vtk

MEASURES = {"smallest angle": "MinAngle", "largest angle": "MaxAngle", "aspect ratio": "AspectRatio", "scaled Jacobian": "ScaledJacobian"}
SHAPES = {5: "Triangle", 9: "Quad", 10: "Tet", 12: "Hex", 13: "Wedge"}
reader = vtk.vtkXMLUnstructuredGridReader()
reader.SetFileName(sys.argv[1])
reader.Update()
grid = reader.GetOutput()
told = []
for k in range(grid.GetNumberOfCells()):
    cell, found = grid.GetCell(k), {}
    for name, word in MEASURES.items():
        of = getattr(vtk.vtkMeshQuality, f"{SHAPES[cell.GetCellType()]}{word}", None)
        if of:
            found[name] = of(cell)
    told.append(found)
print(json.dumps(told))
