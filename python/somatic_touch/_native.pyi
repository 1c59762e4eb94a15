import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, Literal, TypeAlias, TypedDict, final

import numpy as np
import numpy.typing as npt

__all__ = [
    "Body",
    "Calibration",
    "Engine",
    "EngineState",
    "Field",
    "Percepts",
    "Picture",
    "Recording",
    "Scene",
    "SelfContacts",
    "Simulation",
    "Touches",
    "View",
    "__version__",
    "author",
    "metadata",
    "read",
    "render",
    "run",
    "simulate",
    "write",
]

__version__: str

_Backend: TypeAlias = Literal["auto", "reference", "cpu", "gpu"]
_View: TypeAlias = Literal["front", "back", "left", "right", "top", "bottom", "three-quarter", "all"]
_Pose: TypeAlias = dict[str, npt.ArrayLike]
_Path: TypeAlias = str | os.PathLike[str]
_Bools: TypeAlias = npt.NDArray[np.bool_]
_Doubles: TypeAlias = npt.NDArray[np.float64]

class _Comparison(TypedDict):
    compared: int
    agreeing: int
    too_close: int
    worst_error: float
    worst_share: float

class _Verified(TypedDict):
    agrees: bool
    percepts: int
    touches: int
    failed: int
    failures: list[str]
    quantities: dict[str, _Comparison]

class _Ran(TypedDict):
    frames: int
    losses: list[str]

@final
class Body:
    @staticmethod
    def load(path: _Path) -> Body: ...
    @staticmethod
    def bundled(name: Literal["hand", "mat", "humanoid"]) -> Body: ...
    @staticmethod
    def grid(
        rows: int,
        columns: int,
        pitch_m: float | tuple[float, float],
        *,
        name: str = "grid",
        order: Literal["rows", "columns"] = "rows",
        regions: tuple[int, int] | None = None,
    ) -> Body: ...
    @staticmethod
    def _of_bytes(name: str, bytes: bytes) -> Body: ...
    def save(self, path: _Path, *, force: bool = False) -> None: ...
    @property
    def name(self) -> str: ...
    @property
    def links(self) -> list[str]: ...
    @property
    def findings(self) -> list[str]: ...
    @property
    def taxels(self) -> npt.NDArray[np.void]: ...
    @property
    def fields(self) -> dict[str, Field]: ...
    @property
    def triangles(self) -> _Doubles: ...
    def __reduce__(self) -> tuple[Any, tuple[str, bytes]]: ...

@final
class Field:
    @property
    def name(self) -> str: ...
    @property
    def parent(self) -> str | None: ...
    @property
    def anchor(self) -> str | None: ...
    @property
    def chart(self) -> str | None: ...
    @property
    def distortion(self) -> float | None: ...
    @property
    def taxels(self) -> npt.NDArray[np.uint32]: ...
    @property
    def weights(self) -> _Doubles: ...
    @property
    def uv(self) -> _Doubles | None: ...
    def __len__(self) -> int: ...

@final
class Calibration:
    def __new__(cls, text: str, body: Body) -> Calibration: ...
    @staticmethod
    def load(path: _Path, body: Body) -> Calibration: ...
    @property
    def quantity(self) -> Literal["Pa", "N", "count", "mixed"]: ...
    @property
    def text(self) -> str: ...

@final
class Scene:
    def __new__(cls, text: str | dict[str, Any] | None = None, **keys: Any) -> Scene: ...
    @staticmethod
    def load(path: _Path) -> Scene: ...
    @property
    def text(self) -> str: ...
    def __reduce__(self) -> tuple[Any, tuple[str]]: ...

@final
class Engine:
    def __new__(
        cls,
        body: Body,
        scene: Scene | dict[str, Any] | str | None = None,
        calibration: Calibration | None = None,
        backend: _Backend | None = None,
        *,
        taxels: Sequence[int] | None = None,
        batch: int = 256,
    ) -> Engine: ...
    def process(
        self,
        t: npt.ArrayLike,
        values: npt.ArrayLike,
        mask: npt.ArrayLike | None = None,
        pose: _Pose | None = None,
        *,
        progress: Callable[[int], object] | None = None,
    ) -> Percepts: ...
    def step(
        self,
        t: float,
        values: npt.ArrayLike,
        mask: npt.ArrayLike | None = None,
        pose: _Pose | None = None,
    ) -> Percepts: ...
    def verify(
        self,
        t: npt.ArrayLike,
        values: npt.ArrayLike,
        mask: npt.ArrayLike | None = None,
        pose: _Pose | None = None,
    ) -> _Verified: ...
    def view(self, listen: str | None = None, *, allow_hosts: Sequence[str] = ...) -> View: ...
    def _reads_at(self, values: npt.ArrayLike, mask: npt.ArrayLike | None = None) -> int: ...
    def state(self) -> EngineState: ...
    def restore(self, state: EngineState) -> None: ...
    def plan(self) -> dict[str, Any]: ...
    @property
    def fields(self) -> list[str]: ...
    @property
    def outputs(self) -> list[str]: ...
    @property
    def backend(self) -> str: ...

@final
class EngineState:
    @property
    def frames(self) -> int: ...

@final
class Percepts:
    def __getitem__(self, name: str, /) -> npt.NDArray[Any]: ...
    def __contains__(self, name: str, /) -> bool: ...
    def __iter__(self) -> Iterator[str]: ...
    def __len__(self) -> int: ...
    def keys(self) -> list[str]: ...
    def present(self, name: str) -> _Bools: ...
    def unit(self, name: str) -> str: ...
    def index(self, name: str) -> int: ...
    @property
    def flags(self) -> npt.NDArray[np.uint32]: ...
    @property
    def contact(self) -> _Bools: ...
    @property
    def in_world(self) -> _Bools: ...
    @property
    def t(self) -> _Doubles: ...
    @property
    def first_frame(self) -> int: ...
    @property
    def fields(self) -> list[str]: ...
    @property
    def touches(self) -> Touches: ...
    @property
    def self_contacts(self) -> SelfContacts: ...
    def __arrow_c_stream__(self, requested_schema: object | None = None) -> Any: ...
    def to_arrow(self, *, all_fields: bool = False) -> Any: ...
    def to_pandas(self, *, all_fields: bool = False) -> Any: ...
    def to_polars(self, *, all_fields: bool = False) -> Any: ...

@final
class Touches:
    @property
    def frame(self) -> npt.NDArray[np.int64]: ...
    @property
    def t(self) -> _Doubles: ...
    @property
    def link(self) -> list[str]: ...
    @property
    def id(self) -> npt.NDArray[np.uint64]: ...
    @property
    def age(self) -> _Doubles: ...
    @property
    def total(self) -> _Doubles: ...
    @property
    def active(self) -> npt.NDArray[np.uint32]: ...
    @property
    def position(self) -> _Doubles: ...
    @property
    def flags(self) -> npt.NDArray[np.uint32]: ...
    def __getitem__(self, name: str, /) -> _Doubles: ...
    def __arrow_c_stream__(self, requested_schema: object | None = None) -> Any: ...
    def __len__(self) -> int: ...

@final
class SelfContacts:
    @property
    def frame(self) -> npt.NDArray[np.int64]: ...
    @property
    def t(self) -> _Doubles: ...
    @property
    def id(self) -> npt.NDArray[np.uint64]: ...
    @property
    def link(self) -> npt.NDArray[np.int64]: ...
    @property
    def touch(self) -> npt.NDArray[np.uint64]: ...
    @property
    def total(self) -> _Doubles: ...
    @property
    def position(self) -> _Doubles: ...
    @property
    def distance(self) -> _Doubles: ...
    @property
    def angle(self) -> _Doubles: ...
    def __arrow_c_stream__(self, requested_schema: object | None = None) -> Any: ...
    def __len__(self) -> int: ...

@final
class Picture:
    @property
    def pixels(self) -> npt.NDArray[np.uint8]: ...
    @property
    def size(self) -> tuple[int, int]: ...
    def save(self, path: _Path, *, force: bool = False) -> None: ...
    def __array__(self, dtype: npt.DTypeLike | None = None, copy: bool | None = None) -> npt.NDArray[Any]: ...
    def _repr_png_(self) -> bytes: ...

@final
class Recording:
    @property
    def t(self) -> _Doubles: ...
    @property
    def values(self) -> npt.NDArray[np.float32]: ...
    @property
    def mask(self) -> _Bools: ...
    @property
    def taxels(self) -> list[int]: ...
    @property
    def pose(self) -> dict[str, npt.ArrayLike]: ...
    @property
    def body(self) -> Body | None: ...
    @property
    def calibration(self) -> Calibration | None: ...
    @property
    def losses(self) -> list[str]: ...
    def engine(
        self,
        scene: Scene | dict[str, Any] | str | None = None,
        calibration: Calibration | None = None,
        backend: _Backend | None = None,
        *,
        batch: int = 256,
    ) -> Engine: ...
    def __len__(self) -> int: ...

@final
class Simulation:
    @property
    def recording(self) -> Recording: ...
    @property
    def truth(self) -> npt.NDArray[np.void]: ...
    @property
    def forces(self) -> _Doubles: ...
    def __len__(self) -> int: ...

@final
class View:
    @property
    def url(self) -> str: ...
    @property
    def viewers(self) -> int: ...
    def close(self) -> None: ...
    def __enter__(self) -> View: ...
    def __exit__(self, kind: object, raised: object, traceback: object, /) -> None: ...

def read(
    source: _Path,
    *,
    body: Body | str | None = None,
    from_s: float | None = None,
    to_s: float | None = None,
    rate_hz: float | None = None,
    format: str | None = None,
    grid: str | None = None,
    pitch: str | None = None,
    unit: str | None = None,
    layout: _Path | None = None,
) -> Recording: ...
def render(
    what: Body | Recording,
    *,
    at_s: float | None = None,
    from_s: float | None = None,
    to_s: float | None = None,
    rate_hz: float = 12.0,
    calibration: Calibration | None = None,
    views: Sequence[_View] = ...,
    fields: Sequence[str] = ...,
    uv: str | None = None,
    look_at: str | None = None,
    ids: bool = False,
    size: int | tuple[int, int] = ...,
) -> Picture: ...
def simulate(
    simulation: _Path, *, body: Body | None = None, seed: int | None = None
) -> Simulation: ...
def write(
    percepts: Percepts | Iterable[Percepts],
    sink: _Path,
    *,
    force: bool = False,
    all_fields: bool = False,
    header: bool = False,
    wide: bool = False,
) -> None: ...
def run(
    source: _Path,
    sink: _Path,
    *,
    body: Body | None = None,
    scene: Scene | dict[str, Any] | str | None = None,
    calibration: Calibration | None = None,
    backend: _Backend | None = None,
    force: bool = False,
    all_fields: bool = False,
    label: str | None = None,
    progress: Callable[[int], object] | None = None,
) -> _Ran: ...
def metadata(path: _Path) -> dict[str, str]: ...
def author(
    shape: _Path,
    recipe: _Path | None = None,
    *,
    taxels: int | None = None,
    spacing: str | None = None,
    regions: Sequence[str] = ...,
    seed: int | None = None,
    unit: str | None = None,
    even: bool | None = None,
    hidden: Literal["drop", "keep"] | None = None,
    clear: str | None = None,
    progress: Callable[[float], object] | None = None,
) -> Body: ...
