"""A bar that grows, for `progress=True`."""

from __future__ import annotations

from typing import Any

from ._errors import UsageError


class Bar:
    """A bar of tqdm, which is called with what is done."""

    def __init__(self, total: float | None, unit: str) -> None:
        try:
            from tqdm.auto import tqdm  # type: ignore[import-untyped,import-not-found,unused-ignore]
        except ImportError as error:
            what = "progress=True draws with tqdm; run `pip install tqdm`, or give a function, which is called with what is done"
            raise UsageError(what) from error
        shown: dict[str, Any] = {"unit": f" {unit}", "unit_scale": True} if unit else {"bar_format": "{l_bar}{bar}| {elapsed}<{remaining}"}
        self._bar: Any = tqdm(total=total, **shown)

    def __call__(self, done: float) -> None:
        self._bar.update(done - self._bar.n)

    def close(self) -> None:
        """Leaves the bar as it is."""
        self._bar.close()
