"""`faceoff` settles whether finite element codes agree, face by face.

>>> import faceoff_fem as fo
>>> r = fo.compare({"u": [1.0, 2.0]}, {"u": [1.0, 2.5]}, rtol=1e-8)
>>> r.agree
False
"""

from ._compare import Comparison, assert_agree, compare
from ._core import __version__
from ._engine import Case, Engine, engine
from ._mesh import Field, Group, Mesh, read, write
from ._program import Result, certify, convert, judge, orders, solve, verify
from ._systems import Systems, compare_systems, write_system
from .errors import Error, FileError, UsageError

__all__ = [
    "Case",
    "Comparison",
    "Engine",
    "Error",
    "Field",
    "FileError",
    "Group",
    "Mesh",
    "Result",
    "Systems",
    "UsageError",
    "__version__",
    "assert_agree",
    "certify",
    "compare",
    "compare_systems",
    "convert",
    "engine",
    "judge",
    "orders",
    "read",
    "solve",
    "verify",
    "write",
    "write_system",
]
