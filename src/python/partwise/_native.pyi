"""The native part of the package."""

from collections.abc import Mapping
from os import PathLike
from typing import Any, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str

class Error(RuntimeError):
    """Unusable input, or a computation that failed.

    The message says what was found, what was expected, and the remedy.
    """

@final
class Mesh:
    """A mesh in any unit and up axis, both of which are guessed where a drape does not name them.

    ``vertices`` has the shape (n, 3), of float64 or float32. ``faces`` has the shape (m, 3), or more corners, of integers from 0.
    """

    def __new__(cls, vertices: ArrayLike, faces: ArrayLike) -> Mesh: ...
    @property
    def path(self) -> str | None:
        """The file that was loaded; ``None`` for arrays."""
    @property
    def vertices(self) -> NDArray[np.float64]:
        """(n, 3): positions in the unit and axes of the input."""
    @property
    def faces(self) -> NDArray[np.uint32]:
        """(m, 3): vertices of each face, for faces of as many corners."""

@final
class Drape:
    """A draped garment: the result of every stage. Arrays are read-only.

    The garment's vertices are those of the input that a face uses, after the repairs that ``notes`` lists.
    """

    @property
    def name(self) -> str:
        """The name of the garment."""
    @property
    def positions(self) -> NDArray[np.float64]:
        """(n, 3): the draped vertices, m."""
    @property
    def faces(self) -> NDArray[np.uint32]:
        """(m, 3): the triangles of the garment."""
    @property
    def vertices(self) -> NDArray[np.float64]:
        """The draped garment as the input has it: its vertices in its order, unit and axes."""
    @property
    def undraped(self) -> NDArray[np.float64]:
        """(n, 3): the vertices before draping, m."""
    @property
    def preview(self) -> NDArray[np.float64]:
        """(n, 3): the vertices after the two stages, before any step at full resolution, m."""
    @property
    def body(self) -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
        """Vertices of the body, m, and its triangles."""
    @property
    def distance(self) -> NDArray[np.float64]:
        """(n,): distance of each vertex to the body before draping, m."""
    @property
    def parts(self) -> NDArray[np.int32]:
        """(n,): the PART of each vertex; -1 for a vertex in no level of the range table."""
    @property
    def levels(self) -> NDArray[np.uint32]:
        """(p,): the level of each PART, from 0."""
    @property
    def force(self) -> NDArray[np.float64]:
        """(p, 3): resultant force on each PART, N."""
    @property
    def displacement(self) -> NDArray[np.float64]:
        """(p, 3): displacement of each PART, m."""
    @property
    def contact(self) -> NDArray[np.bool_]:
        """(p,): whether the body carries the PART."""
    @property
    def strain(self) -> NDArray[np.float64] | None:
        """(n,): largest principal strain, %."""
    @property
    def pressure(self) -> NDArray[np.float64] | None:
        """(n,): contact pressure, kPa."""
    @property
    def residual(self) -> float | None:
        """Norm of the residual force over the garment's weight; ``None`` for the model ``paper`` without refinement."""
    @property
    def energy(self) -> float | None:
        """Energy, J."""
    @property
    def steps(self) -> int:
        """Newton steps at full resolution."""
    @property
    def converged(self) -> bool:
        """Whether the garment is at rest."""
    @property
    def times_ms(self) -> dict[str, float]:
        """Time of each stage, ms."""
    @property
    def result_hash(self) -> str:
        """Hash of the bits of ``positions``; the column ``result_hash`` of a sweep."""
    @property
    def warnings(self) -> list[str]:
        """Findings that the user should act on. ``partwise.drape`` issues them as warnings too."""
    @property
    def notes(self) -> list[str]:
        """Guesses, findings and repairs of the input."""
    @property
    def job(self) -> dict[str, Any]:
        """All inputs of the drape as plain data; ``partwise.drape(**job)`` repeats it."""
    @property
    def metrics(self) -> dict[str, Any]:
        """The metrics of ``partwise --format json``, measured at the first use."""
    def colours(self, quantity: str) -> NDArray[np.uint8]:
        """(n, 4): colours of the vertices, as in a recording.

        ``quantity`` is ``distance``, ``parts``, ``force``, ``strain``, ``pressure`` or ``folds``.
        """
    def export(self, path: str | PathLike[str]) -> None:
        """Writes the draped garment with its groups and texture coordinates: as OBJ or ``.ply`` with the input's faces, or as ``.glb`` or ``.usda``."""
    def _cells(
        self,
    ) -> tuple[tuple[NDArray[np.float64], NDArray[np.uint32]], NDArray[np.float64], NDArray[np.uint32]]: ...
    def _normals(self) -> list[NDArray[np.float64]]: ...

@final
class Plan:
    def __new__(cls, file: str | PathLike[str] | None, json: str | None, accuracy: str) -> Plan: ...
    @property
    def name(self) -> str: ...
    @property
    def notes(self) -> list[str]: ...
    @property
    def passes(self) -> tuple[int, int]: ...
    @property
    def columns(self) -> list[str]: ...
    def __len__(self) -> int: ...
    def point(self, index: int) -> str: ...
    def label(self, index: int) -> str: ...
    def failed(self, index: int, error: str) -> str: ...

@final
class Store:
    def __new__(cls, plan: Plan, folder: str | PathLike[str]) -> Store: ...
    def rows(self) -> list[str]: ...
    def append(self, row: str) -> None: ...
    def finish(self) -> None: ...

def load(path: str | PathLike[str]) -> Mesh:
    """Reads a mesh file (OBJ, PLY, STL, glTF, ``.npz``), with its groups and texture coordinates."""

def drape(keywords: str, meshes: Mapping[str, Mesh]) -> Drape: ...
def run_point(point: str, passes: tuple[int, int]) -> str: ...
def panics() -> None: ...
