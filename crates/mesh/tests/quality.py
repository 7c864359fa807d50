"""The shape of single cells by VTK's vtkMeshQuality, which is Verdict: quality.py FILE.vtu…

Prints as JSON, for the cell of each file, what it has of smallest angle, largest angle, aspect ratio, scaled Jacobian. VTK's
smallest angle between the faces of a tetrahedron is not always the smallest: those are taken from the edges here."""

import itertools
import json
import sys

import numpy as np
import vtk

MEASURES = {"smallest angle": "MinAngle", "largest angle": "MaxAngle", "aspect ratio": "AspectRatio", "scaled Jacobian": "ScaledJacobian"}
SHAPES = {5: "Triangle", 9: "Quad", 10: "Tet", 12: "Hex", 13: "Wedge"}


def between_faces(p):
    for i, j in itertools.combinations(range(4), 2):
        edge = (p[j] - p[i]) / np.linalg.norm(p[j] - p[i])
        a, b = (x - (x @ edge) * edge for x in (p[k] - p[i] for k in range(4) if k not in (i, j)))
        yield float(np.degrees(np.arccos(a @ b / np.linalg.norm(a) / np.linalg.norm(b))))


told = []
for path in sys.argv[1:]:
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    cell = reader.GetOutput().GetCell(0)
    shape = SHAPES[cell.GetCellType()]
    found = {name: getattr(vtk.vtkMeshQuality, f"{shape}{word}", None) for name, word in MEASURES.items()}
    found = {name: of(cell) for name, of in found.items() if of}
    if shape == "Tet":
        angles = list(between_faces([np.array(cell.GetPoints().GetPoint(k)) for k in range(4)]))
        found |= {"smallest angle": min(angles), "largest angle": max(angles)}
    told.append(found)
print(json.dumps(told))
