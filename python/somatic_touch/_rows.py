"""Arrays of structures that are tables, too."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

_COMPONENTS = {"position": "xyz", "normal": "xyz", "place": "xyz", "velocity": "xyz", "direction": "xyz", "tangent": "xyz"} | {
    "force": "xyz",
    "torque": "xyz",
    "principal_axis": "xyz",
    "shear": "xyz",
    "shear_uv": "uv",
    "uv": "uv",
    "velocity_uv": "uv",
}


def _columns(name: str) -> list[str]:
    """The columns of the vector called `name`."""
    stem = {"uv": "", "velocity_uv": "velocity_", "shear_uv": "shear_"}.get(name, f"{name}_")
    return [stem + component for component in _COMPONENTS[name]]


def _is_vector(name: object, dtype: np.dtype[Any]) -> bool:
    known = isinstance(name, str) and name in _COMPONENTS and name not in (dtype.names or ())
    return known and set(_columns(str(name))) <= set(dtype.names or ())


def _vector(rows: Any, name: str) -> npt.NDArray[Any]:
    return np.stack([rows[column] for column in _columns(name)], axis=-1)


class Row(np.void):  # type: ignore[misc,unused-ignore]
    """One row; a vector by its name, such as `row["position"]`, is an array."""

    def __getitem__(self, key: Any) -> Any:
        return _vector(self, key) if _is_vector(key, self.dtype) else super().__getitem__(key)


class Rows(np.ndarray[Any, np.dtype[Any]]):
    """An array of structures whose vectors are columns, such as `position_x`, `position_y` and `position_z`, so that it is a table.

    `rows["position"]` is all three, [rows, 3].
    """

    def __getitem__(self, key: Any) -> Any:
        if not isinstance(key, str):
            return super().__getitem__(key)
        plain = self.view(np.ndarray)
        return _vector(plain, key) if _is_vector(key, self.dtype) else plain[key]


def rows(length: int, fields: list[tuple[str, str, int, Any]]) -> Rows:
    """The rows of fields that are given by name, with their type, how many numbers each has, and their values."""
    parts: list[tuple[str, str]] = []
    for name, kind, width, _ in fields:
        parts += [(column, kind) for column in (_columns(name) if width > 1 else [name])]
    made = np.empty(length, np.dtype((Row, parts))).view(Rows)
    for name, _, width, values in fields:
        if width == 1:
            made.view(np.ndarray)[name] = values
        else:
            for index, column in enumerate(_columns(name)):
                made.view(np.ndarray)[column] = values[:, index]
    made.setflags(write=False)
    return made
