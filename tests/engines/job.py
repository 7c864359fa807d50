"""The engine protocol, version 1, for any code in Python: see README.md beside this file. Needs NumPy only."""

import ast
import json
import math
import operator
import os
import re
from pathlib import Path

import numpy as np

PROTOCOL = 1


def read_job():
    job = json.loads(Path("job.json").read_text(encoding="utf-8"))
    if job["protocol"] != PROTOCOL:
        raise ValueError(f"job.json speaks protocol {job['protocol']}, this program speaks {PROTOCOL}")
    return job


def read_mesh(case):
    """points (N, d), cells (M, d+1), boundary faces (K, d), their labels (K,); vertices count from 0."""
    files, d = case["mesh"], case["dimension"]
    return (
        np.fromfile(files["points"], "<f8").reshape(-1, d),
        np.fromfile(files["cells"], "<i8").reshape(-1, d + 1),
        np.fromfile(files["boundary"], "<i8").reshape(-1, d),
        np.fromfile(files["labels"], "<i8"),
    )


def read_gamma(case, cells):
    """γ of each of the `cells` (their number); NaN where no contact face needs one."""
    gamma = np.full(cells, np.nan)
    gamma[np.fromfile(case["gamma"]["cells"], "<i8")] = np.fromfile(case["gamma"]["values"], "<f8")
    return gamma


def rule(of_job):
    """Points (Q, d) on the simplex of 0 and the unit vectors, and weights (Q,) that sum to its measure 1/d!."""
    points = np.array(of_job["points"])
    return points, np.array(of_job["weights"]) / math.factorial(points.shape[1])


def nodes(element, d):
    """The barycentric coordinates of the element's dofs, (dofs a cell, d+1), in the protocol's order."""
    vertices = np.eye(d + 1)
    if element == "CR":
        return (1 - vertices) / d  # the middle of the face opposite vertex i
    if element == "P1":
        return vertices
    edges = [(1, 2), (0, 2), (0, 1)] if d == 2 else [(2, 3), (1, 3), (1, 2), (0, 3), (0, 2), (0, 1)]
    return np.vstack([vertices, [(vertices[i] + vertices[j]) / 2 for i, j in edges]])


_OPERATORS = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}


def expression(text, names):
    """The value of a formula of the job. `names` has x, y, z, the functions, and what stands for comparisons, which

    not every code can do by < and <=: lt(a, b), le(a, b), and where(comparison, a, b) for `if`.
    """

    def value(node):
        match node:
            case ast.Constant(number):
                return float(number)
            case ast.Name("pi"):
                return math.pi
            case ast.Name(name):
                return names[name]
            case ast.UnaryOp(sign, a):
                return _OPERATORS[type(sign)](value(a))
            case ast.BinOp(a, ast.Pow(), b):
                return names["pow"](value(a), value(b))
            case ast.BinOp(a, sign, b):
                return _OPERATORS[type(sign)](value(a), value(b))
            case ast.Call(ast.Name(name), arguments):
                return names[name](*map(value, arguments))
            case ast.Compare(a, [ast.Lt() | ast.LtE() as sign], [b]):
                return names["lt" if isinstance(sign, ast.Lt) else "le"](value(a), value(b))
            case ast.Compare(a, [ast.Gt() | ast.GtE() as sign], [b]):
                return names["lt" if isinstance(sign, ast.Gt) else "le"](value(b), value(a))
        raise ValueError(f"{ast.unparse(node)!r} in the formula {text!r} is not known")

    # Python's own grammar but for two words, and with the same precedence.
    return value(ast.parse(re.sub(r"\bif\b", "where", text.replace("^", "**")).strip(), mode="eval").body)


_NUMPY = {
    **{name: getattr(np, name) for name in ["sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "log", "sqrt", "abs", "where"]},
    **{name: getattr(np, "arc" + name[1:]) for name in ("asin", "acos", "atan", "atan2")},
    "min": np.minimum,
    "max": np.maximum,
    "pow": np.power,
    "lt": np.less,
    "le": np.less_equal,
}


def values(text, x):
    """The formula at the points `x`, an array whose first axis has the coordinates."""
    return np.broadcast_to(expression(text, {**_NUMPY, "x": x[0], "y": x[1], "z": x[-1]}), x.shape[1:])


def progress(case, step, increment):
    print("progress", case["id"], step, increment, flush=True)


def write_dofs(case, dofs, converged, increments, seconds, folder="."):
    """Writes `dofs` (M, dofs a cell), in the protocol's order; the case's entry in the status."""
    name = f"out/{case['id']}.dofs.f64"
    np.ascontiguousarray(dofs, dtype="<f8").tofile(Path(folder, name))
    return {
        "id": case["id"],
        "converged": bool(converged),
        "iterations": len(increments),
        "increments": [float(i) if math.isfinite(i) else None for i in increments],
        "rows": int(np.size(dofs)),
        "dofs": name,
        "seconds": {"solve": seconds},
    }


def write_status(version, cases, folder="."):
    """Last of all, and whole or not at all."""
    part = Path(folder, "out/status.json.part")
    part.write_text(json.dumps({"protocol": PROTOCOL, "version": version, "cases": cases}), encoding="utf-8")
    os.replace(part, Path(folder, "out/status.json"))
