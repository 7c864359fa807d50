from collections.abc import Callable, Iterator, Mapping, Sequence
from os import PathLike
from typing import Any, NamedTuple, Optional, Union, overload

import numpy as np
from typing_extensions import TypeAlias

__version__: str

# A path, an object of a library, a Mesh, or a dictionary of arrays.
_Given: TypeAlias = Any
_Path: TypeAlias = Union[str, PathLike[str]]

class Error(Exception):
    what: str
    where: str
    remedy: str
    def __init__(self, message: str, what: str = "", where: str = "", remedy: str = "") -> None: ...

class FileError(Error, OSError): ...
class UsageError(Error, ValueError): ...

class Field(NamedTuple):
    name: str
    on: str
    values: np.ndarray
    at: Optional[np.ndarray]
    time: Optional[float]

class Group(NamedTuple):
    name: Optional[str]
    dim: int
    tag: int
    cells: np.ndarray

class Mesh:
    def __init__(self, of: _Given) -> None: ...
    @property
    def source(self) -> str: ...
    @property
    def points(self) -> np.ndarray: ...
    @property
    def cells(self) -> list[tuple[str, np.ndarray]]: ...
    @property
    def fields(self) -> list[Field]: ...
    @property
    def groups(self) -> list[Group]: ...
    @property
    def whole(self) -> dict[str, Any]: ...
    def __getitem__(self, name: str) -> np.ndarray: ...
    def to_meshio(self) -> Any: ...

class Comparison:
    notes: list[str]
    def __init__(self, found: Any, notes: list[str]) -> None: ...
    @property
    def agree(self) -> bool: ...
    def __bool__(self) -> bool: ...
    @property
    def verdict(self) -> str: ...
    @property
    def fields(self) -> list[dict[str, Any]]: ...
    @property
    def worst(self) -> Optional[dict[str, Any]]: ...
    def to_dict(self) -> dict[str, Any]: ...
    def to_pandas(self) -> Any: ...
    def to_polars(self) -> Any: ...
    def differences(self) -> dict[str, tuple[np.ndarray, dict[str, np.ndarray]]]: ...
    def report(self, folder: _Path) -> None: ...

class Systems:
    agree: bool
    sentence: str
    def __init__(self, agree: bool, sentence: str, text: str) -> None: ...
    def __bool__(self) -> bool: ...
    def to_dict(self) -> dict[str, Any]: ...

class Result(Mapping[str, Any]):
    code: int
    text: str
    page: Optional[str]
    notes: list[str]
    mesh: Optional[Mesh]
    def __init__(
        self,
        code: int,
        text: str,
        found: dict[str, Any],
        page: Optional[str] = None,
        mesh: Optional[Mesh] = None,
        notes: Sequence[str] = (),
    ) -> None: ...
    def __getitem__(self, key: str) -> Any: ...
    def __iter__(self) -> Iterator[str]: ...
    def __len__(self) -> int: ...
    def __bool__(self) -> bool: ...
    @property
    def verdict(self) -> Optional[str]: ...
    @property
    def agree(self) -> bool: ...
    def to_dict(self) -> dict[str, Any]: ...

class Case:
    id: str
    dimension: int
    element: str
    theta1: float
    theta2: float
    flux_corrected: bool
    stop: dict[str, Any]
    points: np.ndarray
    cells: np.ndarray
    boundary: np.ndarray
    labels: np.ndarray
    gamma: np.ndarray
    def __init__(self, folder: _Path, case: dict[str, Any], job: dict[str, Any]) -> None: ...
    def data(self, name: str, x: Any) -> np.ndarray: ...
    def rule(self, which: str) -> tuple[np.ndarray, np.ndarray]: ...
    def nodes(self) -> np.ndarray: ...

class Engine:
    name: str
    version: str
    solve: Callable[[Case], Any]
    def __init__(self, solve: Callable[[Case], Any], name: Optional[str] = None, version: str = "0") -> None: ...
    def __call__(self, case: Case) -> Any: ...

@overload
def engine(solve: Callable[[Case], Any], *, name: Optional[str] = None, version: str = "0") -> Engine: ...
@overload
def engine(solve: None = None, *, name: Optional[str] = None, version: str = "0") -> Callable[[Callable[[Case], Any]], Engine]: ...
def compare_systems(
    a: tuple[Any, Any, Any],
    b: tuple[Any, Any, Any],
    *,
    rtol: float = 1e-12,
    volume: Optional[float] = None,
) -> Systems: ...
def write_system(folder: _Path, A: Any, b: Any, dofs: Any) -> None: ...
def compare(
    a: _Given,
    b: _Given,
    *,
    rtol: Optional[float] = None,
    atol: Optional[float] = None,
    fields: Optional[Mapping[str, Mapping[str, Union[float, str, Sequence[str]]]]] = None,
    name: Optional[str] = None,
    **options: Any,
) -> Comparison: ...
def assert_agree(a: _Given, b: _Given, **options: Any) -> None: ...
def read(path: _Path) -> Mesh: ...
def write(path: _Path, mesh: _Given, **options: Any) -> None: ...
def convert(source: _Path, target: _Path, **options: Any) -> Result: ...
def solve(scene: _Path, *, out: Optional[_Path] = None, report: Optional[_Path] = None, **options: Any) -> Result: ...
def verify(
    *scenes: _Path,
    engines: Optional[Sequence[Any]] = None,
    report: Optional[_Path] = None,
    **options: Any,
) -> Result: ...
def judge(result: _Given, scene: _Path, *, report: Optional[_Path] = None, name: Optional[str] = None, **options: Any) -> Result: ...
def certify(result: _Given, scene: _Path, *, report: Optional[_Path] = None, name: Optional[str] = None, **options: Any) -> Result: ...
def orders(
    results: Optional[Sequence[_Given]] = None,
    *,
    scenes: Sequence[_Path] = (),
    reference: Optional[_Given] = None,
    exact: Union[str, Sequence[str], None] = None,
    report: Optional[_Path] = None,
    name: Optional[str] = None,
    **options: Any,
) -> Result: ...

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
    "UsageError",
    "__version__",
    "assert_agree",
    "certify",
    "compare",
    "convert",
    "engine",
    "judge",
    "orders",
    "read",
    "solve",
    "verify",
    "write",
]
