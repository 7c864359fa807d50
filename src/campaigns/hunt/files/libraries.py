"""Writes a mesh with each library, and reads each file with every other one; each task is a process, since a library may crash."""

import functools
import importlib
import json
import os
import select
import signal
import sys
import tempfile
import time
import warnings

import numpy as np

warnings.simplefilter("ignore")
# An exception of these types is an error in the library rather than a refusal with a message.
INTERNAL = (
    AttributeError,
    AssertionError,
    IndexError,
    KeyError,
    TypeError,
    UnboundLocalError,
    ZeroDivisionError,
)
# Cell types of VTK by those of Gmsh, where the nodes have one order in both.
VTK = {15: 1, 1: 3, 2: 5, 3: 9, 4: 10, 5: 12, 6: 13, 7: 14, 8: 21, 9: 22, 16: 23, 10: 28}
# Of these the order differs: for each node of VTK, that of Gmsh.
VTK |= {11: 24}
ORDER = {11: [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]}
COUNT = {15: 1, 1: 2, 2: 3, 3: 4, 4: 4, 5: 8, 6: 6, 7: 5, 8: 3, 9: 6, 16: 8, 10: 9, 11: 10}
DIM = {15: 0, 1: 1, 2: 2, 3: 2, 4: 3, 5: 3, 6: 3, 7: 3, 8: 1, 9: 2, 16: 2, 10: 2, 11: 3}


class Refused(Exception):
    """The library, or this script, has no way to store this."""


def array(field):
    values = np.array([np.nan if v is None else v for v in field["values"]], field["type"])
    return values if field["components"] == 1 else values.reshape(-1, field["components"])


def back(name, on, values):
    values = np.asarray(values)
    if values.dtype.kind not in "fiub":
        return None
    rows = len(values)
    numbers = [None if np.isnan(v) else v for v in values.ravel().tolist()]
    components = values.size // rows if rows else 1
    kind = "f8" if values.dtype.kind == "f" else "i8"
    return {"name": str(name), "on": on, "components": components, "type": kind, "values": numbers}


def meshio_write(case, path, kind):
    import meshio

    names = meshio._vtk_common.vtk_to_meshio_type
    blocks = []
    for k, (of, nodes) in enumerate(case["cells"]):
        if blocks and case["cells"][k - 1][0] == of:
            blocks[-1][2].append(k)
        else:
            blocks.append([names[VTK[of]], of, [k]])
    cells = [
        (name, [[case["cells"][k][1][i] for i in ORDER.get(of, range(COUNT[of]))] for k in ks])
        for name, of, ks in blocks
    ]
    data = {"points": {}, "cells": {}}
    for field in case["fields"]:
        values = array(field)
        data[field["on"]][field["name"]] = (
            values if field["on"] == "points" else [values[ks] for _, _, ks in blocks]
        )
    named = {}
    if case["groups"]:
        tags = np.zeros(len(case["cells"]), dtype=int)
        for group in case["groups"]:
            if tags[group["cells"]].any():
                raise Refused("one tag for each cell")
            tags[group["cells"]] = group["tag"]
            named[group["name"]] = np.array([group["tag"], group["dim"]])
        for key in ["gmsh:physical", "gmsh:geometrical"]:
            data["cells"][key] = [tags[ks] for _, _, ks in blocks]
    mesh = meshio.Mesh(
        np.array(case["points"], dtype=float).reshape(-1, 3),
        cells,
        point_data=data["points"],
        cell_data=data["cells"],
        field_data=named,
    )
    mesh.write(path, file_format=kind)


def meshio_read(path, kind):
    import meshio

    mesh = meshio.read(path, file_format=kind)
    of_vtk = {meshio._vtk_common.vtk_to_meshio_type[v]: g for g, v in VTK.items()}
    cells = []
    for block in mesh.cells:
        if block.type not in of_vtk:
            raise Refused(block.type)
        of = of_vtk[block.type]
        order = np.argsort(ORDER.get(of, range(COUNT[of])))
        cells += [[of, row] for row in np.asarray(block.data)[:, order].tolist()]
    points = np.zeros((len(mesh.points), 3))
    points[:, : mesh.points.shape[1]] = mesh.points
    fields = [back(name, "points", values) for name, values in mesh.point_data.items()]
    joined = {name: np.concatenate([np.asarray(p) for p in parts]) for name, parts in mesh.cell_data.items()}
    fields += [back(name, "cells", values) for name, values in joined.items()]
    groups = []
    tags = joined.get("gmsh:physical", np.zeros(len(cells)))
    for name, (tag, dim) in mesh.field_data.items() if "gmsh:physical" in joined else []:
        chosen = [k for k in np.flatnonzero(tags == tag).tolist() if DIM[cells[k][0]] == dim]
        groups.append({"name": name, "tag": int(tag), "dim": int(dim), "cells": chosen})
    return {"points": points.tolist(), "cells": cells, "fields": [f for f in fields if f], "groups": groups}


# All of VTK takes four times as long to load as what reads and writes.
PARTS = {"vtk": ["vtkmodules.vtkIOXML", "vtkmodules.vtkIOLegacy", "vtkmodules.util.numpy_support"]}


def vtk_grid(case):
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkUnstructuredGrid

    grid = vtkUnstructuredGrid()
    points = vtkPoints()
    points.SetDataTypeToDouble()
    for point in case["points"]:
        points.InsertNextPoint(point)
    grid.SetPoints(points)
    grid.Allocate(max(len(case["cells"]), 1))
    for of, nodes in case["cells"]:
        order = ORDER.get(of, range(COUNT[of]))
        grid.InsertNextCell(VTK[of], COUNT[of], [nodes[i] for i in order])
    for field in case["fields"]:
        values = numpy_to_vtk(np.ascontiguousarray(array(field)), deep=True)
        values.SetName(field["name"])
        (grid.GetPointData() if field["on"] == "points" else grid.GetCellData()).AddArray(values)
    return grid


def vtk_write(case, path, kind):
    from vtkmodules.vtkIOLegacy import vtkUnstructuredGridWriter
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    writer = {"vtu": vtkXMLUnstructuredGridWriter, "vtk": vtkUnstructuredGridWriter}[kind]()
    writer.SetFileName(path)
    writer.SetInputData(vtk_grid(case))
    if writer.Write() != 1:
        raise Refused("VTK does not write it")


def vtk_read(path, kind):
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOLegacy import vtkUnstructuredGridReader
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

    reader = {"vtu": vtkXMLUnstructuredGridReader, "vtk": vtkUnstructuredGridReader}[kind]()
    reader.SetFileName(path)
    if kind == "vtk":
        reader.ReadAllScalarsOn()
        reader.ReadAllVectorsOn()
        reader.ReadAllTensorsOn()
        reader.ReadAllFieldsOn()
    reader.Update()
    if reader.GetErrorCode():
        raise Refused(f"error {reader.GetErrorCode()}")
    grid = reader.GetOutput()
    gmsh = {v: g for g, v in VTK.items()}
    cells = []
    for k in range(grid.GetNumberOfCells()):
        if grid.GetCellType(k) not in gmsh:
            raise Refused(f"cells of type {grid.GetCellType(k)}")
        of, ids = gmsh[grid.GetCellType(k)], grid.GetCell(k).GetPointIds()
        nodes = [ids.GetId(i) for i in range(ids.GetNumberOfIds())]
        cells.append([of, [nodes[i] for i in np.argsort(ORDER.get(of, range(COUNT[of])))]])
    fields = []
    for on, data in [("points", grid.GetPointData()), ("cells", grid.GetCellData())]:
        for k in range(data.GetNumberOfArrays()):
            if data.GetArray(k) is not None:
                fields.append(back(data.GetArrayName(k), on, vtk_to_numpy(data.GetArray(k))))
    points = [list(grid.GetPoint(k)) for k in range(grid.GetNumberOfPoints())]
    return {"points": points, "cells": cells, "fields": [f for f in fields if f], "groups": []}


def gmsh_start():
    import gmsh

    gmsh.initialize(interruptible=False)
    # Only warnings and errors, which are what it says of losses.
    gmsh.option.setNumber("General.Verbosity", 2)
    return gmsh


def gmsh_write(case, path, kind):
    if case["fields"]:
        raise Refused("fields are views, which are not part of a mesh")
    gmsh = gmsh_start()
    gmsh.model.add("drawn")
    of_cell = {}
    for k, group in enumerate(case["groups"]):
        for cell in group["cells"]:
            of_cell.setdefault(cell, []).append(k)
    entities = {}
    for k, (of, nodes) in enumerate(case["cells"]):
        key = (DIM[of], tuple(of_cell.get(k, [])))
        entities.setdefault(key, []).append(k)
    if not entities:
        raise Refused("no cells")
    saved = not case["groups"] or kind == "msh41"
    if not saved and any(not of for _, of in entities):
        raise Refused("cells of no group are not saved with groups")
    gmsh.option.setNumber("Mesh.SaveAll", int(saved))
    gmsh.option.setNumber("Mesh.MshFileVersion", {"msh22": 2.2}.get(kind, 4.1))
    tags = {}
    for key in sorted(entities, reverse=True):
        tags[key] = gmsh.model.addDiscreteEntity(key[0])
    first = max(entities)
    count = len(case["points"])
    gmsh.model.mesh.addNodes(first[0], tags[first], range(1, count + 1), np.ravel(case["points"]))
    for key, chosen in entities.items():
        for k in chosen:
            of, nodes = case["cells"][k]
            gmsh.model.mesh.addElementsByType(tags[key], of, [k + 1], [n + 1 for n in nodes])
    for k, group in enumerate(case["groups"]):
        chosen = [tags[key] for key in entities if k in key[1]]
        gmsh.model.addPhysicalGroup(group["dim"], chosen, group["tag"], name=group["name"])
    gmsh.write(path)


def gmsh_read(path, kind):
    gmsh = gmsh_start()
    gmsh.open(path)
    ids, places, _ = gmsh.model.mesh.getNodes()
    where = {int(tag): k for k, tag in enumerate(ids)}
    cells, of_entity = [], {}
    for dim, tag in gmsh.model.getEntities():
        for of, _, nodes in zip(*gmsh.model.mesh.getElements(dim, tag)):
            if of not in COUNT:
                raise Refused(f"cells of type {of}")
            for row in np.reshape(nodes, (-1, COUNT[of])).tolist():
                of_entity.setdefault((dim, tag), []).append(len(cells))
                cells.append([int(of), [where[n] for n in row]])
    groups = []
    for dim, tag in gmsh.model.getPhysicalGroups():
        chosen = [k for e in gmsh.model.getEntitiesForPhysicalGroup(dim, tag) for k in of_entity.get((dim, int(e)), [])]
        name = gmsh.model.getPhysicalName(dim, tag)
        groups.append({"name": name, "tag": tag, "dim": dim, "cells": chosen})
    points = np.reshape(places, (-1, 3)).tolist()
    return {"points": points, "cells": cells, "fields": [], "groups": groups}


def apart(task, limit):
    """What a task returns, or how it fails, in a process."""
    reads, writes = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reads)
        log = tempfile.TemporaryFile()  # noqa: SIM115 - it lives as long as the process
        os.dup2(log.fileno(), 1)
        os.dup2(log.fileno(), 2)
        try:
            came = {"done": task()}
            sys.stdout.flush()
            sys.stderr.flush()
            log.seek(0)
            said = log.read().decode(errors="replace")
            # What a library says that it changes is not changed silently.
            if "warning" in said.lower():
                came = {"refused": said[:200]}
        except Refused as error:
            came = {"refused": str(error)}
        except INTERNAL as error:
            came = {"crash": f"{type(error).__name__}: {error}"[:200]}
        except BaseException as error:  # noqa: BLE001 - whatever it is, it has words
            came = {"refused": f"{type(error).__name__}: {error}"[:200]}
        with os.fdopen(writes, "wb") as pipe:
            pipe.write(json.dumps(came).encode())
        os._exit(0)
    os.close(writes)
    text, end = b"", time.monotonic() + limit
    while True:
        ready, _, _ = select.select([reads], [], [], max(end - time.monotonic(), 0))
        if not ready:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            os.close(reads)
            return {"hang": f"it did not end within {limit:g} s"}
        part = os.read(reads, 1 << 16)
        if not part:
            break
        text += part
    os.close(reads)
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status):
        return {"crash": f"signal {os.WTERMSIG(status)}"}
    return json.loads(text) if text else {"crash": f"exit code {os.WEXITSTATUS(status)}"}


def main():
    with open(sys.argv[1]) as file:
        job = json.load(file)
    here = globals()
    # The time to load a library is not that of a task.
    for name in {task["library"] for task in job["tasks"]}:
        for module in PARTS.get(name, [name]):
            importlib.import_module(module)
    came, failed = [], set()
    for task in job["tasks"]:
        does = here[f"{task['library']}_{task['does']}"]
        of = (task["path"], task["format"])
        if task["does"] == "write":
            came.append(apart(functools.partial(does, job["case"], *of), job["limit"]))
            if "done" not in came[-1]:
                failed.add(task["path"])
        elif task["path"] in failed or not os.path.exists(task["path"]):
            came.append({"refused": "there is no file"})
        else:
            came.append(apart(functools.partial(does, *of), job["limit"]))
    with open(sys.argv[2], "w") as file:
        json.dump(came, file)


main()
