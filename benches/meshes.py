"""Measures a program on files: meshes.py (gmsh|meshio|vtk) FILE…; prints seconds as JSON.

Each file that the program reads is read, and what was read is written again in the form that the
file's name tells, where no file is; each the best of those of a second, three at least, or fewer if
they take long.
"""

import json
import sys
import tempfile
import time
from pathlib import Path


def best(work, folder):
    begin, seconds = time.perf_counter(), []
    while (spent := time.perf_counter() - begin) < 1 or (len(seconds) < 3 and spent < 20):
        for old in folder.iterdir():
            old.unlink()
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return min(seconds)


def with_gmsh(path, out):
    if path.suffix not in (".msh", ".med", ".cgns"):
        return None
    import gmsh

    if not gmsh.isInitialized():
        gmsh.initialize()
        gmsh.option.setNumber("General.Terminal", 0)

    def read():
        gmsh.clear()
        gmsh.open(str(path))

    def write():
        gmsh.option.setNumber("Mesh.MshFileVersion", 2.2 if "-22-" in path.name else 4.1)
        gmsh.option.setNumber("Mesh.Binary", int("binary" in path.name))
        gmsh.write(str(out))

    return read, write


def with_meshio(path, out):
    if path.suffix in (".vtp", ".vtkhdf", ".cgns"):
        return None
    import meshio

    held = {}

    def read():
        held["mesh"] = meshio.read(path)

    def write():
        mesh = held["mesh"]
        if path.suffix == ".vtu":
            meshio.vtu.write(out, mesh, binary=True, compression="zlib" if "zlib" in path.name else None)
        elif path.suffix == ".vtk":
            meshio.vtk.write(out, mesh, fmt_version="4.2", binary="binary" in path.name)
        elif path.suffix == ".xdmf":
            meshio.xdmf.write(out, mesh, compression=None)
        elif path.suffix != ".msh":
            mesh.write(out)
        else:
            version = "2.2" if "-22-" in path.name else "4.1"
            meshio.gmsh.write(out, mesh, fmt_version=version, binary="binary" in path.name)

    return read, write


def with_vtk(path, out):
    if path.suffix in (".e", ".xdmf", ".vtkhdf", ".cgns"):
        return with_vtk_readers(path, out)
    name = {".vtu": "XMLUnstructuredGrid", ".vtp": "XMLPolyData", ".vtk": "UnstructuredGrid"}.get(path.suffix)
    if name is None:
        return None
    import vtk

    held = {}

    def read():
        reader = getattr(vtk, f"vtk{name}Reader")()
        reader.SetFileName(str(path))
        reader.Update()
        held["grid"] = reader.GetOutput()

    def write():
        writer = getattr(vtk, f"vtk{name}Writer")()
        if path.suffix == ".vtk":
            writer.SetFileType(2 if "binary" in path.name else 1)
        else:
            writer.SetDataModeToAppended()
            writer.EncodeAppendedDataOff()
            if "zlib" in path.name:
                writer.SetCompressorTypeToZLib()
            else:
                writer.SetCompressorTypeToNone()
        writer.SetFileName(str(out))
        writer.SetInputData(held["grid"])
        writer.Write()

    return read, write


def with_vtk_readers(path, out):
    import vtk

    kind = {".e": "ExodusII", ".xdmf": "Xdmf", ".vtkhdf": "HDF", ".cgns": "CGNS"}[path.suffix]
    held = {}

    def read():
        reader = getattr(vtk, f"vtk{kind}Reader")()
        reader.SetFileName(str(path))
        reader.UpdateInformation()
        for k in range(reader.GetNumberOfSideSetArrays() if kind == "ExodusII" else 0):
            reader.SetObjectStatus(reader.SIDE_SET, k, 1)
        reader.Update()
        held["grid"] = reader.GetOutputDataObject(0)

    def write():
        writer = vtk.vtkHDFWriter()
        writer.SetFileName(str(out))
        writer.SetInputData(held["grid"])
        writer.Write()

    return (read, write) if kind == "HDF" else (read,)


if __name__ == "__main__":
    of = globals()[f"with_{sys.argv[1]}"]
    times = {}
    with tempfile.TemporaryDirectory() as folder:
        for path in map(Path, sys.argv[2:]):
            out = Path(folder) / path.name
            for name, work in zip(("read", "write"), of(path, out) or (), strict=False):
                times[f"{name} {path.name}"] = best(work, Path(folder))
    print("\n" + json.dumps(times))
