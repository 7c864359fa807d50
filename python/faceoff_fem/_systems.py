"""Linear systems of two codes, row by row."""

import json
import os
from dataclasses import dataclass

import numpy as np

from . import _core
from ._adapters import _family
from .errors import usage

AXES = ("x", "y", "z")


@dataclass
class Arrays:
    """What the extension takes."""

    name: str
    rows: np.ndarray
    columns: np.ndarray
    values: np.ndarray
    load: np.ndarray
    names: list
    field: np.ndarray
    at: np.ndarray
    direction: np.ndarray
    answer: object = None


class Systems:
    """Which equations of two systems differ: prints as a sentence, and is true where they are the same."""

    def __init__(self, agree, sentence, text):
        #: Are all equations the same?
        self.agree = agree
        #: What differs, in words.
        self.sentence = sentence
        self._json = text

    def __bool__(self):
        return self.agree

    def __str__(self):
        return self.sentence

    def __repr__(self):
        return f"<Systems: {self.sentence}>"

    def to_dict(self):
        """Everything that was found, as the program has it in its JSON."""
        return json.loads(self._json)


def compare_systems(a, b, *, rtol=1e-12, volume=None):
    """Compare two linear systems, each ``(A, b, dofs)``.

    A is a matrix of SciPy, PETSc, dolfinx or NGSolve; b an array or a vector of these; dofs a dictionary of columns as in a table of dofs
    (``x``, ``y``, ``z``, ``field``, ``component``, ``dx``, ``dy``, ``dz``, ``value``), or a space of dolfinx, a basis of scikit-fem or a space of
    NGSolve, also a mixed one, of which the columns are made by interpolation. With the volume of the domain the constants of materials are found.

    >>> import numpy as np
    >>> import scipy.sparse
    >>> A = scipy.sparse.csr_matrix([[2.0, -1.0], [-1.0, 2.0]])
    >>> dofs = {"x": np.array([0.0, 1.0])}
    >>> found = compare_systems((A, np.ones(2), dofs), (A, np.ones(2), dofs))
    >>> found.agree
    True
    """
    first, second = _system("a", a), _system("b", b)
    return Systems(*_core.compare_systems(first, second, rtol, volume))


def write_system(folder, A, b, dofs):
    """Write a linear system as ``A.mtx``, ``b.mtx`` and ``dofs.csv``, which a face-off compares with those of other codes.

    A, b and dofs are those of :func:`compare_systems`.

    >>> import os, tempfile
    >>> import numpy as np
    >>> import scipy.sparse
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_system(folder, scipy.sparse.eye(2, format="csr"), np.ones(2), {"x": np.array([0.0, 1.0])})
    ...     sorted(os.listdir(folder))
    ['A.mtx', 'b.mtx', 'dofs.csv']
    """
    system = _system("the system", (A, b, dofs))
    count, head = len(system.load), "%%MatrixMarket matrix"
    columns = system.rows + 1, system.columns + 1, system.values
    path = lambda name: os.path.join(folder, name)
    shape = f"{head} coordinate real general\n{count} {count} {len(system.values)}"
    np.savetxt(path("A.mtx"), np.column_stack(columns), "%d %d %.17g", header=shape, comments="")
    np.savetxt(path("b.mtx"), system.load, "%.17g", header=f"{head} array real general\n{count} 1", comments="")
    values = [] if system.answer is None else [system.answer]
    table = np.column_stack([system.at, system.direction, *values]).tolist()
    with open(path("dofs.csv"), "w") as file:
        file.write("field,x,y,z,dx,dy,dz" + ",value" * len(values) + "\n")
        file.writelines(",".join([system.names[k], *map(repr, row)]) + "\n" for k, row in zip(system.field, table))


def _system(name, given):
    if not (isinstance(given, tuple) and len(given) == 3):
        raise usage("a system is (A, b, dofs)", "give the matrix, the right-hand side and the dofs", name)
    A, b, dofs = given
    rows, columns, values = _matrix(A, name)
    load = np.ascontiguousarray(_vector(b), np.float64)
    columns_of = dofs if hasattr(dofs, "keys") else _columns(dofs, name)
    return Arrays(
        name,
        np.ascontiguousarray(rows, np.uint32),
        np.ascontiguousarray(columns, np.uint32),
        np.ascontiguousarray(values, np.float64),
        load,
        *_table(dict(columns_of), name),
    )


def _matrix(A, name):
    if hasattr(A, "getValuesCSR"):
        start, columns, values = A.getValuesCSR()
        return np.repeat(np.arange(len(start) - 1), np.diff(start)), columns, values
    if hasattr(A, "to_scipy"):
        A = A.to_scipy()
    if hasattr(A, "COO"):
        rows, columns, values = A.COO()
        return np.asarray(rows), np.asarray(columns), np.asarray(values)
    if hasattr(A, "tocoo"):
        A = A.tocoo()
        return A.row, A.col, A.data
    if isinstance(A, np.ndarray) and A.ndim == 2:
        rows, columns = np.nonzero(A)
        return rows, columns, A[rows, columns]
    raise usage(f"a {type(A).__qualname__} is no sparse matrix", "give one of SciPy, PETSc, dolfinx or NGSolve", name)


def _vector(b):
    if hasattr(b, "FV"):
        return b.FV().NumPy()
    return np.asarray(b.array if hasattr(b, "array") else b)


def _table(columns, name):
    known = {"field", "component", "x", "y", "z", "dx", "dy", "dz", "value"}
    wrong = sorted(set(columns) - known)
    if wrong or "x" not in columns:
        what = f"the column {wrong[0]!r} of the dofs is not known" if wrong else "the dofs have no column 'x'"
        raise usage(what, f"the columns are {', '.join(sorted(known))}", name)
    count = len(columns["x"])
    three = lambda of: np.column_stack([np.asarray(columns.get(k, np.zeros(count)), np.float64) for k in of])
    direction = three(["dx", "dy", "dz"])
    if not {"dx", "dy", "dz"} & set(columns):
        direction = np.eye(3)[np.asarray(columns.get("component", np.zeros(count)), int)]
    names, field = np.unique(np.asarray(columns.get("field", ["u"] * count), str), return_inverse=True)
    answer = columns.get("value")
    answer = None if answer is None else np.ascontiguousarray(answer, np.float64)
    return [str(k) for k in names], field.astype(np.uint16), np.ascontiguousarray(three(AXES)), np.ascontiguousarray(direction), answer


def _columns(space, name):
    """The columns of the dofs of a space, by interpolation of constant and linear fields."""
    kinds = _family(space)
    if "dolfinx" in kinds:
        return _of_dolfinx(space)
    if "skfem" in kinds:
        return _of_skfem(space, name)
    if "ngsolve" in kinds:
        return _of_ngsolve(space)
    remedy = "give a dictionary of columns, a space of dolfinx or NGSolve, or a basis of scikit-fem"
    raise usage(f"a {type(space).__qualname__} has no dofs that are known here", remedy, name)


def _by_interpolation(interpolate, size, dim):
    """Columns of one field; `interpolate` gets, for a component, what is put there as a function of an axis (None: the constant 1)."""
    d = np.array([interpolate(i, None) for i in range(size)])
    square = np.maximum((d**2).sum(0), np.finfo(float).tiny)
    at = {AXES[k]: sum(d[i] * interpolate(i, k) for i in range(size)) / square for k in range(dim)}
    return {**at, **{f"d{AXES[i]}": d[i] for i in range(size)}}


def _joined(parts, count):
    """Columns of all fields, from (name, rows, columns of the field)."""
    names = sorted({key for _, _, columns in parts for key in columns})
    table = {key: np.zeros(count) for key in names}
    table["field"] = np.empty(count, object)
    for name, rows, columns in parts:
        table["field"][rows] = name
        for key, values in columns.items():
            table[key][rows] = values
    return table


def _of_dolfinx(V):
    from dolfinx import fem

    dim = V.mesh.geometry.dim
    mixed = V.element.num_sub_elements > 1 and V.dofmap.bs == 1
    parts = []
    for k in range(V.element.num_sub_elements if mixed else 1):
        own, rows = V.sub(k).collapse() if mixed else (V, slice(None))
        w = fem.Function(own)
        shape = w.ufl_shape

        def interpolate(component, axis, w=w, size=shape[0] if shape else 0):
            def field(x):
                values = np.ones(x.shape[1]) if axis is None else x[axis]
                return np.array([values if i == component else 0 * values for i in range(size)]) if size else values

            w.interpolate(field)
            return w.x.array.copy()

        columns = _by_interpolation(interpolate, shape[0] if shape else 1, dim)
        parts.append((f"u{k}" if mixed else "u", np.asarray(rows) if mixed else rows, columns))
    return _joined(parts, V.dofmap.index_map.size_local * V.dofmap.index_map_bs)


def _of_skfem(basis, name):
    mixed = hasattr(basis.elem, "elems")
    indices = basis.split_indices() if mixed else [np.arange(basis.N)]
    parts = []
    for k, (element, rows) in enumerate(zip(basis.elem.elems if mixed else [basis.elem], indices)):
        parts.append((f"u{k}" if mixed else "u", rows, _projected(basis.mesh, element, name)))
    return _joined(parts, basis.N)


def _projected(mesh, element, name):
    """The columns of an element of scikit-fem: constants by projection, which finds them wherever the space has them."""
    import skfem
    from scipy.sparse.linalg import splu

    basis = skfem.Basis(mesh, element)
    shape = np.asarray(basis.basis[0][0]).shape[:-2]
    size = shape[0] if shape else 1

    def component(u, i):
        return u[i] if shape else u

    M = skfem.BilinearForm(lambda u, v, w: sum(component(u, i) * component(v, i) for i in range(size))).assemble(basis)
    loads = [skfem.LinearForm(lambda v, w, i=i: component(v, i)).assemble(basis) for i in range(size)]
    d = splu(M.tocsc()).solve(np.column_stack(loads))
    found = component(np.asarray(basis.interpolate(d[:, 0])), 0)
    if len(shape) > 1 or abs(found - 1).max() > 1e-8:
        raise usage(f"{type(element).__name__} has no constant fields", "give the dofs as a dictionary of columns", name)
    d[abs(d) < 1e-12 * abs(d).max()] = 0
    return {**{AXES[i]: x for i, x in enumerate(basis.doflocs)}, **{f"d{AXES[i]}": d[:, i] for i in range(size)}}


def _of_ngsolve(space):
    import ngsolve as ng

    dim = space.mesh.dim
    parts, first = [], 0
    spaces = list(space.components) if space.type.startswith("product") else [space]
    for k, own in enumerate(spaces):
        w = ng.GridFunction(own)
        size = w.dim

        def interpolate(component, axis, w=w, size=size):
            value = ng.CF(1) if axis is None else (ng.x, ng.y, ng.z)[axis]
            each = tuple(value if i == component else ng.CF(0) for i in range(size))
            w.Set(value if size == 1 else ng.CF(each), dual=True)  # by the dofs themselves: a projection has other moments
            return w.vec.FV().NumPy().copy()

        columns = _by_interpolation(interpolate, size, dim)
        parts.append((f"u{k}" if len(spaces) > 1 else "u", slice(first, first + own.ndof), columns))
        first += own.ndof
    return _joined(parts, first)
