"""LeRobot datasets, v2.1 and v3.0, as recordings, and copies of them with percepts. Needs `pip install pyarrow`."""

from __future__ import annotations

import contextlib
import dataclasses
import os
import pathlib
import shutil
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from . import Body, Calibration, Recording, Scene, UsageError
from ._channels import called, in_frames
from ._lerobot import PERCEPTS, Dataset, Numbers, Stats, copy_rest, stats, with_features, write_about

__all__ = ["Episode", "add_percepts", "read"]

_STATE = "observation.state"
_COMPONENTS = {1: [""], 2: [".u", ".v"], 3: [".x", ".y", ".z"]}


@dataclasses.dataclass(frozen=True, eq=False)
class Episode:
    """An episode of a dataset."""

    index: int
    """Its number in the dataset."""

    feature: str
    """The feature that its values are of."""

    recording: Recording
    """Its frames; times are seconds since its beginning."""

    joints: dict[str, npt.NDArray[np.float64]]
    """By name the numbers of `observation.state`, [frames], in the units of the dataset; none if that has no names."""

    tasks: list[str]
    """What it shows."""

    def __repr__(self) -> str:
        named = f", {len(self.joints)} joints" if self.joints else ""
        return f"<Episode {self.index}: {len(self.recording)} frames of {len(self.recording.taxels)} values of {self.feature}{named}>"


def _body(body: Body | str | os.PathLike[str] | None) -> Body | None:
    if body is None or isinstance(body, Body):
        return body
    names: list[Any] = ["hand", "sensing-hand", "mat", "humanoid"]
    return Body.bundled(body) if body in names else Body.load(body)  # type: ignore[arg-type]


def _channels(dataset: Dataset, feature: str, body: Body | None) -> list[str]:
    """The channel of each value: the body's, ascending."""
    names = in_frames(tuple(dataset.features[feature]["shape"]), body)
    if names is None:
        assert body is not None
        what = f"`{feature}` has {dataset.width(feature)} values a frame, and body `{body.name}` has {called(body)}; give the body of this sensor"
        raise UsageError(f"{dataset.root}: {what}", str(dataset.root))
    return names


def _recording(name: str, channels: list[str], t: npt.NDArray[np.float64], values: Numbers, body: Body | None) -> Recording:
    made: Recording = Recording._of_parts(name, channels, t, np.ascontiguousarray(values), {}, body, None, False, [])  # type: ignore[attr-defined]
    return made


def read(
    path: str | os.PathLike[str],
    feature: str | None = None,
    episodes: int | Iterable[int] | None = None,
    *,
    body: Body | str | os.PathLike[str] | None = None,
) -> list[Episode]:
    """The episodes of the dataset in the folder `path`, each as a recording; all of them, or those with the numbers `episodes`.

    `feature` is that of touch, such as "observation.tactile"; without it, the only one that looks like touch. A feature of several
    dimensions is read row by row; `body` has a taxel for each value, in ascending order of ids, or a taxel with three axes for each three
    of the last dimension. An engine of a recording begins anew, so
    that identities of touches end with their episode.

    >>> import somatic_touch.lerobot
    >>> somatic_touch.lerobot.read("no-such-dataset")
    Traceback (most recent call last):
        ...
    somatic_touch.InputError: no-such-dataset: it has no meta/info.json; name the folder of a LeRobot dataset, which has `meta` and `data`
    """
    dataset = Dataset(path)
    name, skin = dataset.feature(feature), _body(body)
    channels, about = _channels(dataset, name, skin), dataset.about_episodes()
    wanted = None if episodes is None else [episodes] if isinstance(episodes, int) else sorted(set(episodes))
    joints = dataset.names(_STATE) if _STATE in dataset.features and _STATE != name else None
    columns = [name, "timestamp", "episode_index", *([_STATE] if joints else [])]
    found: list[Episode] = []
    for file in dataset.files():
        # Before v3 the name of a file is its episode's.
        if wanted is not None and not dataset.is_v3 and file.stem not in {f"episode_{index:06}" for index in wanted}:
            continue
        table = dataset.table(file, columns, wanted)
        values, t = dataset.numbers(file, table, name), dataset.times(file, table)
        states = dataset.numbers(file, table, _STATE).astype(np.float64) if joints else None
        for index, rows in dataset.parts(file, table):
            recording = _recording(f"{dataset.root}#{index}", channels, t[rows], values[rows], skin)
            placed = {} if states is None or joints is None else {joint: states[rows, at] for at, joint in enumerate(joints)}
            found.append(Episode(index, name, recording, placed, list(about.get(index, {}).get("tasks") or [])))
    missing = set(wanted or ()) - {episode.index for episode in found}
    if missing:
        raise UsageError(f"{path}: there is no episode {min(missing)}; meta/info.json counts {dataset.info.get('total_episodes')}", str(path))
    return found


def add_percepts(
    path: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    body: Body | str | os.PathLike[str],
    outputs: str | Sequence[str] = ("total", "peak", "centroid"),
    fields: str | Sequence[str] | None = None,
    feature: str | None = None,
    calibration: Calibration | None = None,
    backend: Literal["auto", "reference", "cpu", "gpu"] = "cpu",
    absent: float = float("nan"),
) -> dict[str, Any]:
    """Writes the dataset in `path` to the new folder `out`, with percepts of `body` as features: how many episodes and frames, and which.

    Each of `outputs` is a float32 feature, such as `observation.percepts.total`, with a number for each field, or for each of its
    components; its `names` are in meta/info.json. `observation.percepts.contact` is 1 where a field is touched. `fields` are patterns of
    names. A quantity that is absent is `absent`. Statistics of the new features are added; videos and pictures are linked or copied. The
    folder appears when it is whole.
    """
    dataset, target = Dataset(path), pathlib.Path(out)
    name, skin = dataset.feature(feature), _body(body)
    channels = _channels(dataset, name, skin)
    asked = [outputs] if isinstance(outputs, str) else list(outputs)
    if any(output.split(".")[0] in ("touches", "self_contacts") for output in asked):
        raise UsageError("outputs: touches come and go, and a feature has a value in every frame; name outputs of fields, such as `total`")
    scene = Scene({"outputs": asked, **({} if fields is None else {"fields": [fields] if isinstance(fields, str) else list(fields)})})
    with _appearing(target, dataset.root) as part:
        copy_rest(dataset, part)
        made = _Percepts(dataset, name, absent)
        engine, start = None, None
        for file in dataset.files():
            table = dataset.table(file, None, None)
            values, t = dataset.numbers(file, table, name), dataset.times(file, table)
            columns: dict[str, list[Numbers]] = {}
            for index, rows in dataset.parts(file, table):
                recording = _recording(f"{dataset.root}#{index}", channels, t[rows], values[rows], skin)
                if engine is None or start is None:
                    engine = recording.engine(scene, calibration, backend)
                    start = engine.state()
                # Nothing is kept of the episode before.
                engine.restore(start)
                for key, column in made.of(index, engine.process(recording.t, recording.values)).items():
                    columns.setdefault(key, []).append(column)
            whole = {key: np.concatenate(all_of) for key, all_of in columns.items()}
            if whole:
                dataset.parquet.write_table(with_features(dataset, table, whole), part / file.relative_to(dataset.root))
        write_about(dataset, part, made.features, made.stats, made.whole())
    return {"episodes": len(made.stats), "frames": made.frames, "features": list(made.features)}


class _Percepts:
    """Features of percepts, with what is known of their numbers so far."""

    def __init__(self, dataset: Dataset, feature: str, absent: float) -> None:
        self.dataset, self.absent = dataset, absent
        self.fps = dataset.features[feature].get("fps")
        self.features: dict[str, Any] = {}
        self.stats: dict[int, dict[str, Stats]] = {}
        self.frames = 0

    def of(self, episode: int, p: Any) -> dict[str, Numbers]:
        """The columns of an episode, [frames, width]."""
        columns = {"contact": p.contact.astype(np.float32)[:, :, None]}
        for output in p.keys():
            values = np.array(p[output], np.float32).reshape(*p.flags.shape, -1)
            values[~p.present(output)] = self.absent
            columns[output] = values
        named = {f"{PERCEPTS}.{output}": values for output, values in columns.items()}
        if not self.features:
            for key, values in named.items():
                if key in self.dataset.features:
                    raise UsageError(f"{self.dataset.root}: it has a feature `{key}` already; name the dataset without percepts", str(self.dataset.root))
                names = [f"{field}{component}" for field in p.fields for component in _COMPONENTS[values.shape[2]]]
                fps = {} if self.fps is None else {"fps": self.fps}
                self.features[key] = {"dtype": "float32", "shape": [len(names)], "names": names, **fps}
        flat = {key: values.reshape(len(values), -1) for key, values in named.items()}
        if episode in self.stats:
            raise UsageError(f"{self.dataset.root}: the rows of episode {episode} are not together; write the dataset again", str(self.dataset.root))
        self.stats[episode] = {key: stats(values) for key, values in flat.items()}
        self.frames += len(p.t)
        return flat

    def whole(self) -> dict[str, Stats]:
        """The statistics of all episodes together."""
        return {key: _together([of[key] for of in self.stats.values()]) for key in self.features}


def _together(parts: list[Stats]) -> Stats:
    """The statistics of all frames, by those of parts of them, as LeRobot weights them: by frames."""
    count = np.array([part["count"] for part in parts], np.float64)
    mean, spread = np.array([part["mean"] for part in parts]), np.array([part["std"] for part in parts])
    whole = (mean * count).sum(axis=0) / count.sum()
    deviation = np.sqrt(((spread**2 + (mean - whole) ** 2) * count).sum(axis=0) / count.sum())
    least, most = np.array([part["min"] for part in parts]).min(axis=0), np.array([part["max"] for part in parts]).max(axis=0)
    return {
        "min": least.tolist(),
        "max": most.tolist(),
        "mean": whole.tolist(),
        "std": deviation.tolist(),
        "count": [int(count.sum())],
    }


@contextlib.contextmanager
def _appearing(out: pathlib.Path, source: pathlib.Path) -> Iterator[pathlib.Path]:
    """A folder that is called `out` when all is in it, and is gone if that fails."""
    whole = out.resolve()
    if out.exists() or out.is_symlink():
        raise UsageError(f"{out}: it exists; name a new folder", str(out))
    if whole.is_relative_to(source.resolve()):
        raise UsageError(f"{out}: it is inside the dataset that is read; name a folder elsewhere", str(out))
    if not whole.parent.is_dir():
        raise UsageError(f"{out}: there is no folder {whole.parent}; make it first", str(out))
    part = whole.with_name(f"{whole.name}.{os.getpid()}.part")
    part.mkdir()
    try:
        yield part
        part.rename(whole)
    except BaseException:
        shutil.rmtree(part, ignore_errors=True)
        raise
