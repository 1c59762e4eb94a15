"""The files of LeRobot datasets, v2.1 and v3.0: what they hold, and copies of them with more features."""

from __future__ import annotations

import importlib
import json
import os
import pathlib
import re
import shutil
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ._errors import InputError, SomaticError, UsageError

Numbers = npt.NDArray[np.float32]

# What features of touch are called. Features of percepts are not touch again.
_TOUCH = re.compile("tactile|touch|taxel|pressure|fsr|haptic|skin", re.IGNORECASE)
PERCEPTS = "observation.percepts"

_NUMERIC = re.compile("u?int[0-9]+|float[0-9]+")
# Counters that every dataset has.
_COUNTERS = {"timestamp", "frame_index", "episode_index", "index", "task_index"}
# Where a dataset has its videos and pictures, which are never changed in place.
_LINKED = {"videos", "images"}
_LEFT_OUT = {".cache", ".git"}
# The bits of a missing value, as `Recording.values` has them.
_MISSING = 0xFFFF_FFFF


def pyarrow_of(path: pathlib.Path) -> tuple[Any, Any]:
    """`pyarrow` and `pyarrow.parquet`."""
    try:
        return importlib.import_module("pyarrow"), importlib.import_module("pyarrow.parquet")
    except ImportError as error:
        raise SomaticError(f"{path}: a LeRobot dataset is in Parquet, which pyarrow reads; run `pip install pyarrow`", str(path)) from error


def _by_number(path: pathlib.Path) -> list[tuple[int, str]]:
    """Sorts `file-10` after `file-9`, and `chunk-1000` after `chunk-999`."""
    return [(int(digits or 0), word) for word, digits in re.findall(r"([^0-9]*)([0-9]*)", path.as_posix())]


class Dataset:
    """A LeRobot dataset in the folder `path`."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.root = pathlib.Path(path)
        self.arrow, self.parquet = pyarrow_of(self.root)
        about = self.root / "meta" / "info.json"
        try:
            self.info: dict[str, Any] = json.loads(about.read_text(encoding="utf-8"))
            self.version = str(self.info["codebase_version"])
            self.features: dict[str, dict[str, Any]] = dict(self.info["features"])
            shapes = [feature["shape"] for feature in self.features.values()]
            fits = all(isinstance(size, int) and size > 0 for shape in shapes for size in shape)
        except FileNotFoundError as error:
            what = "it has no meta/info.json; name the folder of a LeRobot dataset, which has `meta` and `data`"
            raise InputError(f"{self.root}: {what}", str(self.root)) from error
        except OSError as error:
            raise InputError(f"{about}: {error.strerror}", str(about)) from error
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            what = "it is not the info.json of a LeRobot dataset, which has `codebase_version` and `features`; copy the file again"
            raise InputError(f"{about}: {what}", str(about)) from error
        if not fits:
            raise InputError(f"{about}: features: a shape should be a list of numbers over 0; copy the file again", str(about))
        if not self.version.startswith(("v2.", "v3.")):
            what = f"codebase_version is `{self.version}`; v2.1 and v3.0 are read: convert the dataset with LeRobot's scripts"
            raise InputError(f"{about}: {what}", str(about), "codebase_version")

    @property
    def is_v3(self) -> bool:
        """Whether a file may have several episodes."""
        return self.version.startswith("v3.")

    def files(self) -> list[pathlib.Path]:
        """The tables of frames, in their order."""
        found = sorted((self.root / "data").glob("chunk-*/*.parquet"), key=_by_number)
        if not found:
            raise InputError(f"{self.root}: it has no data/chunk-*/*.parquet; copy the dataset again", str(self.root))
        return found

    def feature(self, wanted: str | None) -> str:
        """The feature of touch: `wanted`, or the only one that looks like it."""
        numeric = [name for name, about in self.features.items() if name not in _COUNTERS and _NUMERIC.fullmatch(str(about.get("dtype")))]
        listed = ", ".join(f"{name} {self.features[name]['shape']}" for name in numeric) or "none"
        if wanted is not None:
            if wanted in numeric:
                return wanted
            if wanted in self.features:
                kind = self.features[wanted].get("dtype")
                raise UsageError(f"{self.root}: feature `{wanted}` is of dtype {kind}; name one of numbers: {listed}", str(self.root))
            raise UsageError(f"{self.root}: there is no feature `{wanted}`; there are {listed}", str(self.root))
        looking = [name for name in numeric if _TOUCH.search(name) and not name.startswith(PERCEPTS)]
        if len(looking) != 1:
            many = "several features look like touch" if looking else "no feature looks like touch"
            raise UsageError(f"{self.root}: {many}; name one with feature=: {listed}", str(self.root))
        return looking[0]

    def width(self, feature: str) -> int:
        """How many numbers a frame has of it."""
        return int(np.prod(self.features[feature]["shape"], dtype=np.int64))

    def names(self, feature: str) -> list[str] | None:
        """What its numbers are called, if the dataset says it."""
        names = self.features.get(feature, {}).get("names")
        if isinstance(names, dict):
            names = [name for group in names.values() if isinstance(group, list) for name in group]
        if not isinstance(names, list) or len(names) != self.width(feature) or len(set(map(str, names))) < len(names):
            return None
        return [str(name) for name in names]

    def table(self, file: pathlib.Path, columns: Sequence[str] | None, episodes: Sequence[int] | None) -> Any:
        """The rows of `file`: all, or those of `episodes`."""
        filters = None if episodes is None else [("episode_index", "in", list(episodes))]
        try:
            return self.parquet.read_table(file, columns=columns, filters=filters, partitioning=None)
        except (self.arrow.ArrowException, OSError) as error:
            text = str(error).splitlines() or [type(error).__name__]
            raise InputError(f"{file}: {text[0]}; copy the file again", str(file)) from error

    def numbers(self, file: pathlib.Path, table: Any, feature: str) -> Numbers:
        """The numbers of `feature` in `table`, [frames, width]; an empty one is missing."""
        if feature not in table.column_names:
            raise InputError(f"{file}: it has no column `{feature}`; meta/info.json names it: copy the file again", str(file), feature)
        column, width = table[feature].combine_chunks(), self.width(feature)
        while True:
            if isinstance(column, self.arrow.ExtensionArray):
                column = column.storage
            if not hasattr(column, "flatten") or not self.arrow.types.is_nested(column.type):
                break
            column = column.flatten()
        kind = column.type
        if not (self.arrow.types.is_integer(kind) or self.arrow.types.is_floating(kind)):
            raise InputError(f"{file}: column `{feature}` has {kind}, not numbers; name another feature", str(file), feature)
        if len(column) != table.num_rows * width:
            shape = self.features[feature]["shape"]
            what = f"column `{feature}` has {len(column)} numbers in {table.num_rows} rows, and meta/info.json says {shape} a row"
            raise InputError(f"{file}: {what}; write the dataset again", str(file), feature)
        values = np.array(column.to_numpy(zero_copy_only=False), np.float32)
        if column.null_count:
            values.view(np.uint32)[np.asarray(column.is_null())] = _MISSING
        return values.reshape(table.num_rows, width)

    def times(self, file: pathlib.Path, table: Any) -> npt.NDArray[np.float64]:
        """Seconds since the beginning of each row's episode."""
        if "timestamp" not in table.column_names:
            raise InputError(f"{file}: it has no column `timestamp`; write the dataset again", str(file), "timestamp")
        return np.array(table["timestamp"].to_numpy(), np.float64).reshape(-1)

    def parts(self, file: pathlib.Path, table: Any) -> Iterator[tuple[int, slice]]:
        """The rows of each episode in `table`."""
        if "episode_index" not in table.column_names:
            raise InputError(f"{file}: it has no column `episode_index`; write the dataset again", str(file), "episode_index")
        index = np.array(table["episode_index"].to_numpy(), np.int64).reshape(-1)
        borders = [0, *(np.flatnonzero(np.diff(index)) + 1), len(index)]
        for begin, end in zip(borders, borders[1:], strict=False):
            if begin < end:
                yield int(index[begin]), slice(int(begin), int(end))

    def about_episodes(self) -> dict[int, dict[str, Any]]:
        """By episode what `meta` says of it."""
        if self.is_v3:
            files = sorted((self.root / "meta" / "episodes").glob("chunk-*/*.parquet"), key=_by_number)
            rows = [row for file in files for row in self._rows(file)]
        else:
            rows = lines(self.root / "meta" / "episodes.jsonl")
        return {int(row["episode_index"]): row for row in rows if "episode_index" in row}

    def _rows(self, file: pathlib.Path) -> list[dict[str, Any]]:
        schema = self.parquet.read_schema(file).names
        found: list[dict[str, Any]] = self.table(file, [name for name in ("episode_index", "tasks", "length") if name in schema], None).to_pylist()
        return found


def lines(file: pathlib.Path) -> list[dict[str, Any]]:
    """The objects of a file of JSON lines; none if it is not there."""
    if not file.is_file():
        return []
    try:
        return [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines() if line.strip()]
    except ValueError as error:
        raise InputError(f"{file}: a line is not JSON; copy the file again", str(file)) from error


def copy_rest(dataset: Dataset, out: pathlib.Path) -> None:
    """Copies into `out` all of the dataset but its tables of frames; videos and pictures are linked where the disk allows it."""
    for folder, folders, names in os.walk(dataset.root):
        folders[:] = [name for name in folders if name not in _LEFT_OUT]
        within = pathlib.Path(folder).relative_to(dataset.root)
        (out / within).mkdir(parents=True, exist_ok=True)
        for name in names:
            if within.parts[:1] == ("data",) and name.endswith(".parquet"):
                continue
            # A cache of the Hugging Face Hub has symbolic links.
            source = (pathlib.Path(folder) / name).resolve()
            if within.parts[:1] and within.parts[0] in _LINKED:
                try:
                    os.link(source, out / within / name)
                    continue
                except OSError:
                    pass
            shutil.copyfile(source, out / within / name)


def with_features(dataset: Dataset, table: Any, columns: dict[str, Numbers]) -> Any:
    """`table` with a column for each of `columns`, [frames, width]; also in what Hugging Face's `datasets` reads of the schema."""
    arrow = dataset.arrow
    about = dict(table.schema.metadata or {})
    kinds: dict[str, Any] = {}
    for name, values in columns.items():
        width = values.shape[1]
        column = arrow.array(values.reshape(-1), arrow.float32())
        kinds[name] = {"dtype": "float32", "_type": "Value"}
        if width != 1:
            column = arrow.FixedSizeListArray.from_arrays(column, width)
            kinds[name] = {"feature": kinds[name], "length": width, "_type": "Sequence"}
        table = table.append_column(name, column)
    if b"huggingface" in about:
        told = json.loads(about[b"huggingface"])
        if isinstance(told.get("info", {}).get("features"), dict):
            told["info"]["features"].update(kinds)
            about[b"huggingface"] = json.dumps(told).encode()
    # `pandas` lists columns, and would miss the new ones.
    about.pop(b"pandas", None)
    return table.replace_schema_metadata(about)


Stats = dict[str, list[float]]


def stats(values: Numbers) -> Stats:
    """What LeRobot's normalisation needs of the numbers that are there; 0 where there are none."""
    there = np.isfinite(values)
    count = np.maximum(there.sum(axis=0), 1)
    held = np.where(there, values, 0).astype(np.float64)
    mean = held.sum(axis=0) / count
    spread = np.sqrt(np.where(there, (held - mean) ** 2, 0).sum(axis=0) / count)
    any_there = there.any(axis=0)
    least = np.where(any_there, np.where(there, held, np.inf).min(axis=0, initial=np.inf), 0)
    most = np.where(any_there, np.where(there, held, -np.inf).max(axis=0, initial=-np.inf), 0)
    return {
        "min": least.tolist(),
        "max": most.tolist(),
        "mean": mean.tolist(),
        "std": spread.tolist(),
        "count": [len(values)],
    }


def write_about(dataset: Dataset, out: pathlib.Path, features: dict[str, Any], by_episode: dict[int, dict[str, Stats]], whole: dict[str, Stats]) -> None:
    """Adds `features` and their statistics to the files of `out / "meta"`, which are copies."""
    info = {**dataset.info, "features": {**dataset.features, **features}}
    (out / "meta" / "info.json").write_text(json.dumps(info, indent=4, ensure_ascii=False), encoding="utf-8")
    told = out / "meta" / "stats.json"
    if told.is_file():
        told.write_text(json.dumps({**json.loads(told.read_text(encoding="utf-8")), **whole}, indent=4, ensure_ascii=False), encoding="utf-8")
    per_line = out / "meta" / "episodes_stats.jsonl"
    if per_line.is_file():
        rows = lines(per_line)
        for row in rows:
            row["stats"] = {**row.get("stats", {}), **by_episode.get(int(row["episode_index"]), {})}
        per_line.write_text("".join(json.dumps(row, ensure_ascii=False) + "\n" for row in rows), encoding="utf-8")
    for file in sorted((out / "meta" / "episodes").glob("chunk-*/*.parquet")):
        table = dataset.table(file, None, None)
        about = dict(table.schema.metadata or {})
        about.pop(b"pandas", None)
        index = table["episode_index"].to_pylist()
        for name in whole:
            for figure in ("min", "max", "mean", "std", "count"):
                kind = dataset.arrow.list_(dataset.arrow.int64() if figure == "count" else dataset.arrow.float64())
                cells = [by_episode.get(episode, {}).get(name, {}).get(figure) for episode in index]
                table = table.append_column(f"stats/{name}/{figure}", dataset.arrow.array(cells, kind))
        dataset.parquet.write_table(table.replace_schema_metadata(about), file)
