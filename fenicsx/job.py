"""The engine protocol, version 1: a job folder (the current one) in, `out/` with dofs and status back."""

import ast
import json
import math
import os
from pathlib import Path

import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI
from ufl.algorithms.analysis import extract_type

import compat

PROTOCOL = 1


def read_job():
    job = json.loads(Path("job.json").read_text(encoding="utf-8"))
    if job["protocol"] != PROTOCOL:
        raise ValueError(
            f"job.json speaks protocol {job['protocol']}, this program speaks {PROTOCOL}; use matching versions"
        )
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


def read_gamma(case, mesh, contact_facets):
    """γ as a function constant on each cell; every cell behind Γ_C must have a value."""
    numbers = np.fromfile(case["gamma"]["cells"], "<i8")
    values = np.fromfile(case["gamma"]["values"], "<f8")
    original = np.asarray(mesh.topology.original_cell_index)
    of_input = np.full(max(original.max(initial=-1), numbers.max(initial=-1)) + 1, np.nan)
    check_gamma(case, mesh, numbers, values)
    of_input[numbers] = values
    of_cell = of_input[original]

    d = mesh.topology.dim
    to_cells = mesh.topology.connectivity(d - 1, d)
    behind = np.array([to_cells.links(facet)[0] for facet in contact_facets], dtype=np.int32)
    missing = np.isnan(of_cell[behind])
    if missing.any():
        raise ValueError(f"no gamma for cell {original[behind[missing][0]]}, which lies behind a contact face")

    gamma = fem.Function(compat.function_space(mesh, "DG", 0))
    gamma.x.array[compat.cell_dofs(gamma.function_space)[:, 0]] = np.where(np.isnan(of_cell), 1.0, of_cell)
    return gamma


def check_gamma(case, mesh, numbers, values):
    """The job's γ must be γ₀ h, h the diameter of the cell or the largest of all."""
    h = compat.diameters(mesh)
    if case["h"] == "global":
        h[:] = mesh.comm.allreduce(h.max(initial=0.0), MPI.MAX)
    given = dict(zip(numbers.tolist(), values.tolist(), strict=True))
    for cell, size in zip(np.asarray(mesh.topology.original_cell_index).tolist(), h.tolist(), strict=True):
        if cell in given and not abs(given[cell] - case["gamma0"] * size) <= 1e-13 * given[cell]:
            raise ValueError(f"gamma of cell {cell} is {given[cell]}, and gamma0 h is {case['gamma0'] * size}")


def quadrature_rule(rule, dimension):
    """The job's rule as the metadata of a measure over simplices of this dimension.

    UFL's weights sum to the measure 1/dimension! of the reference simplex, the job's to 1. Plain floats, because the
    metadata enters a form's signature as text, and an array's text has 8 digits.
    """
    return {
        "quadrature_rule": "custom",
        "quadrature_points": tuple(tuple(map(float, point)) for point in rule["points"]),
        "quadrature_weights": tuple(float(weight) / math.factorial(dimension) for weight in rule["weights"]),
    }


def read_data(case, mesh):
    """θ₁, θ₂, f, t, ψ as UFL on `mesh`, and g as UFL or float, by name.

    Numbers are components of a `Constant`, so that cases with other numbers share a compiled form. It is one `Constant`
    because UFL sorts several by a running count's digits: a form would differ from itself when that passes 9, 99, …
    """
    values = {name: expression(text, mesh) for name, text in case["data"].items()}
    values |= {name: float(case[name]) for name in ("theta1", "theta2")}
    names = ("theta1", "theta2", "f", "t", "psi")
    constant = fem.Constant(mesh, [values[name] if isinstance(values[name], float) else 0.0 for name in names])
    return values | {name: constant[i] for i, name in enumerate(names) if isinstance(values[name], float)}


def expression(text, mesh):
    """A formula in x[0], x[1], x[2] as UFL on `mesh`, or as a float if it does not depend on x."""
    tree = ast.parse(text, mode="eval")
    if any(isinstance(node, ast.Attribute) for node in ast.walk(tree)):
        raise ValueError(f"the expression {text!r} has a dot after a name; only formulas are allowed")
    functions = "sin cos tan asin acos atan sinh cosh tanh exp ln sqrt min_value max_value conditional lt le gt ge"
    names = {name: getattr(ufl, name) for name in functions.split()}
    names |= {"x": ufl.SpatialCoordinate(mesh), "pi": math.pi, "abs": abs, "atan2": compat.atan2, "__builtins__": {}}
    value = ufl.as_ufl(eval(compile(tree, text, "eval"), names))
    return value if extract_type(value, ufl.classes.SpatialCoordinate) else float(value(()))


def gather_dofs(u, cells):
    """The dofs of `u` in the input's numbering, (M, dofs a cell) on rank 0, None elsewhere.

    Rows are input cells. Columns are the sub-entities that carry a dof, by dimension and then in the reference simplex's
    order, all told by the input cell's vertices: `cells` (M, d+1).
    """
    V = u.function_space
    mesh = V.mesh
    d = mesh.topology.dim
    owned = mesh.topology.index_map(d).size_local
    original = np.asarray(mesh.topology.original_cell_index)[:owned]
    values = u.x.array[compat.cell_dofs(V)[:owned]]

    # position[c, i]: where vertex i of the input cell stands among dolfinx's vertices of cell c
    here = compat.cell_vertices(mesh)[:owned]
    position = (here[:, None, :] == cells[original][:, :, None]).argmax(axis=2)

    # a sub-entity is the set of its vertices, one bit each
    entities = compat.simplex_entities(d)
    dof_of = {
        sum(1 << vertex for vertex in vertices): dof
        for dimension in range(d + 1)
        for i, vertices in enumerate(entities[dimension])
        for dof in V.dofmap.dof_layout.entity_dofs(dimension, i)
    }
    dof_at = np.zeros(1 << (d + 1), dtype=np.int64)
    dof_at[list(dof_of)] = list(dof_of.values())
    carriers = [v for entity in entities for v in entity if sum(1 << vertex for vertex in v) in dof_of]
    columns = [dof_at[(1 << position[:, list(vertices)]).sum(axis=1)] for vertices in carriers]
    rows = np.take_along_axis(values, np.stack(columns, axis=1), axis=1)

    parts = mesh.comm.gather((original, rows), root=0)
    if parts is None:
        return None
    gathered = np.full((len(cells), len(carriers)), np.nan)
    for numbers, part in parts:
        gathered[numbers] = part
    return gathered


def write_dofs(case, dofs):
    name = f"out/{case['id']}.dofs.f64"
    dofs.astype("<f8").tofile(name)
    return name


def finite_or_none(number):
    """JSON has no NaN and no infinity."""
    return number if math.isfinite(number) else None


def write_status(cases):
    """Last of all, and whole or not at all."""
    status = {"protocol": PROTOCOL, "engine": "fenicsx", "version": compat.VERSION, "cases": cases}
    part = Path("out/status.json.part")
    part.write_text(json.dumps(status, indent=1, allow_nan=False), encoding="utf-8")
    os.replace(part, "out/status.json")
