"""Tables of named columns, which pandas, polars and Arrow take as they are."""

from __future__ import annotations

import importlib
import json
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ._errors import UnknownNameError


def of_json(rows: str) -> Table:
    """The table of a list of objects."""
    return Table(json.loads(rows))


class Table:
    """Rows with named columns; it is a table of pandas, polars and Arrow, too.

    `table["gain"]` is a column, where numbers that are absent are NaN. A loop has a dict for each row, without what is absent.

    >>> from somatic_touch import Table
    >>> table = Table([{"taxel": 3, "gain": 0.5}, {"taxel": 4, "gain": None}])
    >>> table["gain"].tolist(), list(table)
    ([0.5, nan], [{'taxel': 3, 'gain': 0.5}, {'taxel': 4}])
    >>> table
    <Table: 2 rows of taxel, gain>
    """

    def __init__(self, rows: Sequence[dict[str, Any]]) -> None:
        self._rows = list(rows)
        names: dict[str, None] = {}
        for row in self._rows:
            names.update(dict.fromkeys(row))
        self._names = list(names)

    def keys(self) -> list[str]:
        """The names of its columns."""
        return list(self._names)

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        if name not in self._names:
            raise UnknownNameError(f"there is no column `{name}`; there are {', '.join(self._names)}")
        values = [row.get(name) for row in self._rows]
        if any(value is None for value in values) and all(value is None or isinstance(value, int | float) for value in values):
            return np.array([np.nan if value is None else value for value in values])
        return np.array(values)

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def __len__(self) -> int:
        return len(self._rows)

    def __iter__(self) -> Iterator[dict[str, Any]]:
        for row in self._rows:
            yield {name: value for name, value in row.items() if value is not None}

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and vars(self) == vars(other)

    __hash__ = None  # type: ignore[assignment]

    def to_arrow(self) -> Any:
        """It as a `pyarrow.Table`; what is absent is null."""
        pyarrow: Any = importlib.import_module("pyarrow")

        return pyarrow.table({name: [row.get(name) for row in self._rows] for name in self._names})

    def to_pandas(self) -> Any:
        """It as a `pandas.DataFrame`."""
        return self.to_arrow().to_pandas()

    def to_polars(self) -> Any:
        """It as a `polars.DataFrame`."""
        polars: Any = importlib.import_module("polars")

        return polars.DataFrame(self.to_arrow())

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> Any:
        return self.to_arrow().__arrow_c_stream__(requested_schema)

    def __repr__(self) -> str:
        rows = f"{len(self)} row" + ("" if len(self) == 1 else "s")
        return f"<{type(self).__name__}: {rows} of {', '.join(self._names)}>"

    def _repr_html_(self) -> str:
        from . import _html

        return _html.rows(self)
