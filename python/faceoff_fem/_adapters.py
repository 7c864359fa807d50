"""What stands for one result: which adapter takes it, found without importing any library."""

import contextlib
import os
import tempfile
from pathlib import Path

import numpy as np

from . import _core
from .errors import usage

#: Of functions without a name of their own.
NAME = "u"


def _family(thing):
    """The library that a thing, or what it derives from, comes from."""
    return {kind.__module__.partition(".")[0] for kind in type(thing).__mro__}


def is_function(thing):
    """Is it a function, that has one field, whose name may be another one's?"""
    kinds = _family(thing[0] if isinstance(thing, tuple) and thing else thing)
    return bool(kinds & {"dolfinx", "skfem", "ngsolve", "getfem"})


def memory(thing):
    """The part of a function that counts, and the array of all its dofs; None of what is no function."""
    kinds = _family(thing[0] if isinstance(thing, tuple) and thing else thing)
    if isinstance(thing, tuple) and len(thing) == 2 and kinds & {"skfem", "getfem"}:
        return (), np.asarray(thing[1])
    if "dolfinx" in kinds:
        component = thing.function_space.component
        return tuple(component() if callable(component) else component), thing.x.array
    if "ngsolve" in kinds:
        return (), thing.vec.FV().NumPy()
    return None


def side(thing, name=None):
    """What the extension takes: a path, a `Mesh`, or `Arrays`. `name` is that of a function."""
    if isinstance(thing, (str, os.PathLike)):
        return Path(thing)
    if isinstance(thing, _core.Mesh):
        return thing
    core = getattr(thing, "_core", None)
    if isinstance(core, _core.Mesh):
        return core
    if isinstance(thing, tuple) and len(thing) == 2:
        kinds = _family(thing[0])
        if "skfem" in kinds:
            from ._skfem import arrays

            return arrays(thing, name)
        if "getfem" in kinds:
            from ._getfem import arrays

            return arrays(thing, name)
    kinds = _family(thing)
    if "dolfinx" in kinds:
        from ._dolfinx import arrays

        return arrays(thing, name)
    if "ngsolve" in kinds:
        from ._ngsolve import arrays

        return arrays(thing, name)
    from . import _meshes

    if "meshio" in kinds:
        return _meshes.of_meshio(thing)
    if hasattr(thing, "GetClassName") and hasattr(thing, "IsA"):
        return _meshes.of_vtk(thing)
    if hasattr(thing, "keys") and hasattr(thing, "__getitem__"):
        return _meshes.of_dict(thing)
    what = f"a {type(thing).__module__}.{type(thing).__qualname__} is no result"
    remedy = (
        "give a path, a dictionary of arrays, a meshio Mesh, a PyVista or VTK grid, a dolfinx Function, (basis, x) of"
        " scikit-fem, an NGSolve GridFunction, or (mf, U) of GetFEM"
    )
    raise usage(what, remedy)


def names(of):
    """The names of the fields of what `side` returned; None of a path."""
    if isinstance(of, _core.Mesh):
        # A file of faceoff's own with one engine: comparisons leave its name out.
        whole = dict(of.whole)
        engines = whole.get("engines", ()) if "faceoff" in whole else ()
        ending = " " + engines[0].rpartition(" ")[0] if len(engines) == 1 else ""
        return [name[: len(name) - len(ending)] if name.endswith(ending) else name for name, *_ in of.fields]
    return None if isinstance(of, Path) else [name for name, *_ in of.fields]


@contextlib.contextmanager
def written(things, called):
    """Paths of results, which are written to files that are gone afterwards unless they are files already."""
    with tempfile.TemporaryDirectory(prefix="faceoff-") as folder:
        paths = []
        for k, (thing, name) in enumerate(zip(things, called)):
            of = side(thing, name)
            if not isinstance(of, Path):
                mesh = of if isinstance(of, _core.Mesh) else _core.Mesh(of)
                of = Path(folder, f"{k}.vtu")
                _core.write(of, mesh, ["--encoding=raw"])
            paths.append(of)
        yield paths
