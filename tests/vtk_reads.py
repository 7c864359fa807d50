"""Prints as JSON what VTK's own reader makes of each file on the command line."""

import json
import sys

from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkStringArray
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader


def array(values):
    """Type, components and bits of an array, or its texts."""
    if isinstance(values, vtkStringArray):
        return [values.GetValue(i) for i in range(values.GetNumberOfValues())]
    numbers = vtk_to_numpy(values)
    return [numbers.dtype.name, values.GetNumberOfComponents(), numbers.tobytes().hex()]


def arrays(data):
    """All arrays of points, cells or the whole, by name."""
    found = (data.GetAbstractArray(i) for i in range(data.GetNumberOfArrays()))
    return {values.GetName(): array(values) for values in found}


def nodes(cell):
    """The points of a cell; VTK hands out one and the same object for each."""
    return [cell.GetPointId(i) for i in range(cell.GetNumberOfPoints())]


def look(path):
    """The grid in a file; None where VTK reports an error."""
    reader = vtkXMLUnstructuredGridReader()
    errors = []
    reader.AddObserver("ErrorEvent", lambda *_: errors.append(path))
    reader.SetFileName(path)
    reader.Update()
    if errors or reader.GetErrorCode():
        return None
    grid = reader.GetOutput()
    cells = range(grid.GetNumberOfCells())
    points = grid.GetPoints()
    return {
        "points": array(points.GetData()) if points and points.GetNumberOfPoints() else None,
        "cells": [nodes(grid.GetCell(i)) for i in cells],
        "types": [grid.GetCellType(i) for i in cells],
        "point_data": arrays(grid.GetPointData()),
        "cell_data": arrays(grid.GetCellData()),
        "field_data": arrays(grid.GetFieldData()),
    }


json.dump([look(path) for path in sys.argv[1:]], sys.stdout)
