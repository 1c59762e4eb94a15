"""One recording as one piece of work, for `batch` and `ray`."""

from __future__ import annotations

import dataclasses
import glob
import hashlib
import os
import pathlib
from collections.abc import Iterable
from typing import Any

from . import _native
from ._errors import SomaticError, UsageError


@dataclasses.dataclass(frozen=True)
class Job:
    """What is done to every recording; it is sent to other processes."""

    body: _native.Body | None
    scene: _native.Scene
    calibration: str | None
    backend: str | None
    all_fields: bool

    @staticmethod
    def of(
        scene: _native.Scene | dict[str, Any] | str | None,
        body: _native.Body | str | None,
        calibration: _native.Calibration | str | None,
        backend: str | None,
        all_fields: bool,
    ) -> Job:
        """What the keywords of `percepts` say."""
        if isinstance(body, str):
            names: list[Any] = ["hand", "sensing-hand", "mat", "humanoid"]
            body = _native.Body.bundled(body) if body in names else _native.Body.load(body)  # type: ignore[arg-type]
        if isinstance(calibration, _native.Calibration):
            calibration = calibration.text
        if calibration is not None and body is None:
            raise UsageError("a calibration is made for a body; give body= too")
        if not isinstance(scene, _native.Scene):
            scene = _native.Scene(scene) if scene is not None else _native.Scene()
        return Job(body, scene, calibration, backend, all_fields)

    def label(self, recording: pathlib.Path) -> str:
        """What a table is made from, so that it is made anew when the recording or the job changes."""
        about = recording.stat()
        wish = f"{self.scene.text}\0{self.calibration}\0{self.backend}\0{self.all_fields}\0{_body_sum(self.body)}"
        key = hashlib.sha256(wish.encode()).hexdigest()[:16]
        return f"{recording.resolve()}; {about.st_size} bytes; {about.st_mtime_ns}; {key}"

    def is_done(self, recording: pathlib.Path, out: pathlib.Path) -> bool:
        """Whether `out` is whole and what `run` would make."""
        try:
            told = _native.metadata(out)
        except SomaticError:
            return False
        return told.get("somatic.source") == self.label(recording) and told.get("somatic.version") == _native.__version__

    def run(self, recording: pathlib.Path, out: pathlib.Path) -> dict[str, Any]:
        """Makes the table; an error is a row, not the end of the job."""
        row: dict[str, Any] = {"recording": str(recording), "out": str(out), "frames": 0, "losses": [], "error": None}
        # What a killed process has left of this table, which nobody else writes.
        for name in (out.name, f"{out.stem}.touches.parquet"):
            for left in out.parent.glob(f"{glob.escape(name)}.*.part"):
                left.unlink(missing_ok=True)
        try:
            calibration = None
            if self.calibration is not None and self.body is not None:
                calibration = _native.Calibration(self.calibration, self.body)
            told = _native.run(
                recording,
                f"parquet:{out}",
                body=self.body,
                scene=self.scene,
                calibration=calibration,
                backend=self.backend,  # type: ignore[arg-type]
                force=True,
                all_fields=self.all_fields,
                label=self.label(recording) if recording.exists() else None,
            )
            row.update(frames=told["frames"], losses=told["losses"])
        except (SomaticError, OSError) as error:
            row["error"] = str(error)
        return row


def _body_sum(body: _native.Body | None) -> str:
    return "" if body is None else hashlib.sha256(body.__reduce__()[1][1]).hexdigest()


def outputs(recordings: Iterable[str | os.PathLike[str]], out: str | os.PathLike[str]) -> list[tuple[pathlib.Path, pathlib.Path]]:
    """The table of each recording: below `out`, as the recordings stand below what they have in common."""
    paths = [pathlib.Path(path) for path in recordings]
    if not paths:
        raise UsageError("there are no recordings")
    whole = [path.resolve() for path in paths]
    common = pathlib.Path(os.path.commonpath([path.parent for path in whole]))
    tables = [pathlib.Path(out) / path.relative_to(common).with_name(path.name + ".parquet") for path in whole]
    if len(set(tables)) < len(tables):
        raise UsageError("a recording appears twice")
    for table in tables:
        table.parent.mkdir(parents=True, exist_ok=True)
    return list(zip(paths, tables, strict=True))


@dataclasses.dataclass
class Report:
    """What came of a job: a dict for each recording that was read, and those that were done before.

    >>> import somatic_touch.batch
    >>> somatic_touch.batch.Report([{"recording": "a.csv", "error": "a.csv: row 3: bad value"}], ["b.csv"])
    <Report: 0 done, 1 done before, 1 failed>
    """

    rows: list[dict[str, Any]]
    """By recording `recording`, `out`, `frames`, `losses`, and `error`, None where it was read."""

    skipped: list[str]
    """Recordings whose tables were there, whole and made by the same job."""

    @property
    def errors(self) -> list[dict[str, Any]]:
        """The rows of the recordings that could not be read."""
        return [row for row in self.rows if row["error"] is not None]

    def __repr__(self) -> str:
        done = len(self.rows) - len(self.errors)
        return f"<Report: {done} done, {len(self.skipped)} done before, {len(self.errors)} failed>"
