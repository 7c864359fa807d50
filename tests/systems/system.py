"""Writes a linear system as Matrix Market files, and the table of its dofs from the interpolants of constant and linear fields."""

import numpy as np
import scipy.io
import scipy.sparse


def write_system(out, A, b):
    scipy.io.mmwrite(f"{out}/A.mtx", scipy.sparse.coo_matrix(A), precision=17, symmetry="general")
    scipy.io.mmwrite(f"{out}/b.mtx", np.asarray(b)[:, None], precision=17)


def dofs(interpolate, size, dim=2):
    """The places and directions of dofs; `interpolate` gets a function of x with `size` components and returns an array."""

    def along(axis, f):
        field = lambda x: np.array([f(x) if k == axis else 0 * x[0] for k in range(size)])
        return np.array(interpolate(field if size > 1 else lambda x: field(x)[0]))

    d = np.array([along(axis, lambda x: 1 + 0 * x[0]) for axis in range(size)])
    x = [sum(d[i] * along(i, lambda x, k=k: x[k]) for i in range(size)) / (d**2).sum(0) for k in range(dim)]
    return np.array(x).T, np.pad(d.T, ((0, 0), (0, 2)))[:, :2]


def write_dofs(out, fields, order):
    """`fields` has for each name the places, the directions and the rows of its dofs."""
    rows = [None] * order
    for name, (x, d, numbers) in fields.items():
        for place, direction, number in zip(x, d, numbers):
            rows[number] = ",".join([name, *(repr(float(v)) for v in [*place, *direction])])
    with open(f"{out}/dofs.csv", "w") as file:
        file.write("field,x,y,dx,dy\n" + "\n".join(rows) + "\n")
