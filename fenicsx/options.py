"""The command line of paper.py, its mesh, and the parts of its boundary."""

import argparse
import sys

import meshes

# isort: split
import numpy as np

from nitsche import CONTACT, DIRICHLET, NEUMANN


def of_command_line(description):
    """The options, and the mesh as arrays with the labels of nitsche.py."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--example", choices=["6.1", "6.2"], default="6.1")
    parser.add_argument("-N", type=int, default=3, help="of 6.2: N + 1 zones of contact")
    parser.add_argument("-n", type=int, default=16, help="squares a side of dolfinx's own mesh")
    parser.add_argument("--method", choices=["cr", "p2", "chr"], default="cr")
    parser.add_argument("--iteration", choices=["newton", "fixed-point"], default="newton")
    parser.add_argument("--gamma0", type=float, default=100.0)
    parser.add_argument("--mesh", help=meshes.read.__doc__)
    parser.add_argument("--contact", type=int, action="append", help="label of faces on Γ_C (1, the bottom)")
    parser.add_argument(
        "--dirichlet", type=int, action="append", help="label of faces on Γ_D (3, the top); the rest is Γ_N"
    )
    parser.add_argument(
        "--fine", type=int, default=4, help="errors to P2 on every cell cut into so many squared; 1: none"
    )
    parser.add_argument("--out", default="paper")
    of = parser.parse_args()

    points, cells, boundary, labels = meshes.read(of.mesh) if of.mesh else meshes.square(of.n)
    on_C, on_D = np.isin(labels, of.contact or [1]), np.isin(labels, of.dirichlet or [3])
    if not on_C.any() or not on_D.any():
        sys.exit(
            f"no face has a label of --contact or none has one of --dirichlet: the labels are {sorted(set(labels.tolist()))}"
        )
    return of, (points, cells, boundary, np.where(on_C, CONTACT, np.where(on_D, DIRICHLET, NEUMANN)))
