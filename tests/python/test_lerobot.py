"""LeRobot datasets of both versions, written here after their public description: read, and given percepts."""

from __future__ import annotations

import doctest
import json
import pathlib
import re
import shutil
import subprocess
import sys

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from conftest import ROOT, pressed

import somatic_touch as st
from somatic_touch import lerobot

# Files, not numbers: another Python makes no difference.
pytestmark = pytest.mark.once

TOUCH, STATE = "observation.tactile", "observation.state"
LENGTHS = [30, 50, 20]
DATA_PATHS = {
    "v2.1": "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet",
    "v3.0": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
}
JOINTS = ["shoulder.pos", "elbow.pos"]


def listed(values: np.ndarray) -> pa.Array:
    """A column of lists of one length, as `datasets` writes it."""
    column = pa.array(values.reshape(-1))
    for size in values.shape[:0:-1]:
        column = pa.FixedSizeListArray.from_arrays(column, size)
    return column


def frames_of(episode: int, shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    t, values = pressed(st.Body.bundled("hand"), LENGTHS[episode], seed=episode)
    return (np.arange(len(t)) / 30).astype(np.float32), values.reshape(-1, *shape)


def rows(episode: int, shape: tuple[int, ...]) -> dict[str, pa.Array]:
    t, values = frames_of(episode, shape)
    count, before = len(t), sum(LENGTHS[:episode])
    state = np.stack([0.01 * np.arange(count), np.full(count, episode)], axis=1).astype(np.float32)
    return {
        TOUCH: listed(values),
        STATE: listed(state),
        "timestamp": pa.array(t),
        "frame_index": pa.array(np.arange(count)),
        "episode_index": pa.array(np.full(count, episode)),
        "index": pa.array(before + np.arange(count)),
        "task_index": pa.array(np.zeros(count, np.int64)),
    }


def write(root: pathlib.Path, version: str, shape: tuple[int, ...] = (40,), **features: object) -> pathlib.Path:
    """A dataset of three episodes, with a picture of each as what is not a table."""
    meta = root / "meta"
    meta.mkdir(parents=True)
    scalar = {"shape": [1], "names": None}
    info = {
        "codebase_version": version,
        "robot_type": "hand",
        "total_episodes": len(LENGTHS),
        "total_frames": sum(LENGTHS),
        "total_tasks": 1,
        "total_videos": 0,
        "total_chunks": 1,
        "chunks_size": 1000,
        "fps": 30,
        "splits": {"train": f"0:{len(LENGTHS)}"},
        "data_path": DATA_PATHS[version],
        "video_path": None,
        "features": {
            TOUCH: {"dtype": "float32", "shape": list(shape), "names": None},
            STATE: {"dtype": "float32", "shape": [2], "names": {"motors": JOINTS}},
            "timestamp": {"dtype": "float32", **scalar},
            **{name: {"dtype": "int64", **scalar} for name in ("frame_index", "episode_index", "index", "task_index")},
            **features,
        },
    }
    (meta / "info.json").write_text(json.dumps(info))
    tables = [pa.table(rows(episode, shape)) for episode in range(len(LENGTHS))]
    about = {"info": {"features": {"timestamp": {"dtype": "float32", "_type": "Value"}}}}
    tables = [table.replace_schema_metadata({"huggingface": json.dumps(about)}) for table in tables]
    videos = root / "videos" / "chunk-000"
    videos.mkdir(parents=True)
    if version == "v3.0":
        (root / "data" / "chunk-000").mkdir(parents=True)
        pq.write_table(pa.concat_tables(tables[:2]), root / "data" / "chunk-000" / "file-000.parquet")
        pq.write_table(tables[2], root / "data" / "chunk-000" / "file-001.parquet")
        (meta / "episodes" / "chunk-000").mkdir(parents=True)
        ends = np.cumsum(LENGTHS)
        episodes = {
            "episode_index": [0, 1, 2],
            "tasks": [["press"]] * 3,
            "length": LENGTHS,
            "data/chunk_index": [0, 0, 0],
            "data/file_index": [0, 0, 1],
            "dataset_from_index": ends - LENGTHS,
            "dataset_to_index": ends,
            "meta/episodes/chunk_index": [0, 0, 0],
            "meta/episodes/file_index": [0, 0, 0],
            "stats/timestamp/min": [[0.0]] * 3,
        }
        pq.write_table(pa.table(episodes), meta / "episodes" / "chunk-000" / "file-000.parquet")
        pd.DataFrame({"task_index": [0]}, index=["press"]).to_parquet(meta / "tasks.parquet")
        (meta / "stats.json").write_text(json.dumps({"timestamp": {"min": [0.0]}}))
    else:
        (root / "data" / "chunk-000").mkdir(parents=True)
        for episode, table in enumerate(tables):
            pq.write_table(table, root / "data" / "chunk-000" / f"episode_{episode:06}.parquet")
        told = [{"episode_index": episode, "tasks": ["press"], "length": length} for episode, length in enumerate(LENGTHS)]
        (meta / "tasks.jsonl").write_text(json.dumps({"task_index": 0, "task": "press"}) + "\n")
        (meta / "episodes.jsonl").write_text("".join(json.dumps(row) + "\n" for row in told))
        told = [{"episode_index": episode, "stats": {"timestamp": {"min": [0.0]}}} for episode in range(len(LENGTHS))]
        (meta / "episodes_stats.jsonl").write_text("".join(json.dumps(row) + "\n" for row in told))
    (videos / "scene.mp4").write_bytes(b"not a table")
    return root


@pytest.fixture(params=["v2.1", "v3.0"])
def dataset(request, tmp_path) -> pathlib.Path:
    return write(tmp_path / "dataset", request.param)


def test_an_episode_is_a_recording(dataset: pathlib.Path) -> None:
    episodes = lerobot.read(dataset, body="hand")
    assert [episode.index for episode in episodes] == [0, 1, 2]
    for episode in episodes:
        t, values = frames_of(episode.index, (40,))
        assert np.array_equal(episode.recording.t, t.astype(np.float64)) and np.array_equal(episode.recording.values, values)
        assert episode.recording.taxels == sorted(st.Body.bundled("hand").taxels["id"].tolist())
        assert list(episode.joints) == JOINTS and episode.tasks == ["press"]
        assert np.array_equal(episode.joints["elbow.pos"], np.full(len(t), episode.index))
    assert repr(episodes[0]) == f"<Episode 0: 30 frames of 40 values of {TOUCH}, 2 joints>"
    some = lerobot.read(dataset, TOUCH, [2, 0])
    assert [episode.index for episode in some] == [0, 2] and some[0].recording.body is None
    assert np.array_equal(some[1].recording.values, episodes[2].recording.values)
    with pytest.raises(st.UsageError, match="there is no episode 7; meta/info.json counts 3"):
        lerobot.read(dataset, episodes=7)


def test_a_feature_of_two_dimensions_is_read_row_by_row_and_an_empty_value_is_missing(tmp_path: pathlib.Path) -> None:
    root = write(tmp_path / "mat", "v2.1", (8, 5))
    assert np.array_equal(lerobot.read(root)[1].recording.values, frames_of(1, (40,))[1])
    file = root / "data" / "chunk-000" / "episode_000000.parquet"
    table = pq.read_table(file)
    cells = table[TOUCH].to_pylist()
    cells[3][7][4] = None
    kind = pa.list_(pa.list_(pa.float32(), 5), 8)
    pq.write_table(table.set_column(0, TOUCH, pa.array(cells, kind)), file)
    recording = lerobot.read(root, episodes=0)[0].recording
    assert recording.mask.sum() == 1 and recording.mask[3, 39]


def test_the_feature_is_found_or_listed(tmp_path: pathlib.Path) -> None:
    other = {"dtype": "uint16", "shape": [2, 3], "names": None}
    several = write(tmp_path / "several", "v2.1", **{"observation.fsr": other})
    with pytest.raises(st.UsageError, match=r"several features look like touch; name one with feature=: observation\.tactile \[40\], .*fsr \[2, 3\]$"):
        lerobot.read(several)
    with pytest.raises(st.UsageError, match="there is no feature `tactile`; there are observation.tactile"):
        lerobot.read(several, "tactile")
    assert len(lerobot.read(several, TOUCH)) == 3
    video = {"dtype": "video", "shape": [3, 8, 8], "names": None}
    filmed = write(tmp_path / "filmed", "v2.1", **{"observation.images.tactile": video})
    assert lerobot.read(filmed)[0].feature == TOUCH
    with pytest.raises(st.UsageError, match="is of dtype video; name one of numbers"):
        lerobot.read(filmed, "observation.images.tactile")
    with pytest.raises(st.UsageError, match="has 40 values a frame, and body `grid` has 6 taxels"):
        lerobot.read(filmed, body=st.Body.grid(2, 3, 0.01))


def test_what_is_wrong_is_told_in_one_line(dataset: pathlib.Path) -> None:
    about = dataset / "meta" / "info.json"
    info = json.loads(about.read_text())
    info["features"][TOUCH]["shape"] = [41]
    about.write_text(json.dumps(info))
    with pytest.raises(st.InputError, match=r"has .* numbers in .* rows, and meta/info.json says \[41\] a row"):
        lerobot.read(dataset)
    about.write_text(json.dumps({**info, "codebase_version": "v1.6"}))
    with pytest.raises(st.InputError, match="codebase_version is `v1.6`; v2.1 and v3.0 are read"):
        lerobot.read(dataset)
    about.write_text("{")
    with pytest.raises(st.InputError, match="it is not the info.json of a LeRobot dataset"):
        lerobot.read(dataset)


def test_a_damaged_table_is_told_in_one_line(dataset: pathlib.Path) -> None:
    file = sorted(dataset.glob("data/*/*"))[0]
    file.write_bytes(file.read_bytes()[:-9])
    with pytest.raises(st.InputError) as raised:
        lerobot.read(dataset)
    assert raised.value.file == str(file) and "\n" not in str(raised.value)
    shutil.rmtree(dataset / "data")
    with pytest.raises(st.InputError, match="it has no data/chunk-"):
        lerobot.read(dataset)


def test_percepts_become_features(dataset: pathlib.Path, tmp_path: pathlib.Path) -> None:
    out = tmp_path / "out"
    told = lerobot.add_percepts(dataset, out, body="hand", outputs=["total", "centroid"], fields=["hand/palm", "hand/back"])
    total, centroid, contact = (f"observation.percepts.{name}" for name in ("total", "centroid", "contact"))
    assert told == {"episodes": 3, "frames": 100, "features": [contact, total, centroid]}
    before, after = (json.loads((root / "meta" / "info.json").read_text()) for root in (dataset, out))
    fields = after["features"][total]["names"]
    assert sorted(fields) == ["hand/back", "hand/palm"]
    assert after["features"][centroid]["names"] == [f"{field}.{component}" for field in fields for component in "uv"]
    assert {name: after["features"][name] for name in before["features"]} == before["features"]
    # As an engine of its own makes them, episode by episode.
    for old, new in zip(lerobot.read(dataset, body="hand"), lerobot.read(out, total), strict=True):
        p = old.recording.engine({"outputs": ["total", "centroid"], "fields": ["hand/palm", "hand/back"]}, backend="cpu").process(
            old.recording.t, old.recording.values
        )
        present = p.present("total")
        assert present.any() and np.array_equal(new.recording.values[present], p["total"][present])
        assert np.isnan(new.recording.values[~present]).all()
    assert [lerobot.read(out, body="hand")[0].feature] == [TOUCH]
    tables = sorted(path.relative_to(out) for path in out.glob("data/*/*"))
    assert tables == sorted(path.relative_to(dataset) for path in dataset.glob("data/*/*"))
    for path in tables:
        old, new = pq.read_table(dataset / path), pq.read_table(out / path)
        assert new.select(old.column_names).equals(old)
        kinds = json.loads(new.schema.metadata[b"huggingface"])["info"]["features"]
        assert kinds[total]["length"] == 2 and new.schema.field(total).type == pa.list_(pa.float32(), 2)
    assert (out / "videos" / "chunk-000" / "scene.mp4").read_bytes() == b"not a table"


def test_statistics_of_new_features_stand_beside_the_old_ones(dataset: pathlib.Path, tmp_path: pathlib.Path) -> None:
    out, total = tmp_path / "out", "observation.percepts.total"
    lerobot.add_percepts(dataset, out, body="hand", outputs="total", absent=0)
    values = [episode.recording.values.astype(np.float64) for episode in lerobot.read(out, total)]
    if (out / "meta" / "stats.json").is_file():
        told = json.loads((out / "meta" / "stats.json").read_text())
        assert told["timestamp"] == {"min": [0.0]}
        every = np.concatenate(values)
        assert np.allclose(told[total]["mean"], every.mean(axis=0)) and np.allclose(told[total]["std"], every.std(axis=0))
        assert np.allclose(told[total]["max"], every.max(axis=0)) and told[total]["count"] == [100]
        table = pq.read_table(out / "meta" / "episodes" / "chunk-000" / "file-000.parquet")
        means = table[f"stats/{total}/mean"].to_pylist()
        assert "stats/timestamp/min" in table.column_names
    else:
        lines = [json.loads(line) for line in (out / "meta" / "episodes_stats.jsonl").read_text().splitlines()]
        means = [line["stats"][total]["mean"] for line in lines]
        assert all(line["stats"]["timestamp"] == {"min": [0.0]} for line in lines)
    for got, wanted in zip(means, values, strict=True):
        assert np.allclose(got, wanted.mean(axis=0))


def test_nothing_half_written_stays(dataset: pathlib.Path, tmp_path: pathlib.Path) -> None:
    out = tmp_path / "out"
    last = sorted(dataset.glob("data/*/*"))[-1]
    whole = last.read_bytes()
    last.write_bytes(whole[:-9])
    with pytest.raises(st.InputError):
        lerobot.add_percepts(dataset, out, body="hand")
    assert [path.name for path in tmp_path.iterdir()] == ["dataset"]
    last.write_bytes(whole)
    with pytest.raises(st.UsageError, match="touches come and go"):
        lerobot.add_percepts(dataset, out, body="hand", outputs=["touches.total"])
    with pytest.raises(st.UsageError, match="inside the dataset that is read"):
        lerobot.add_percepts(dataset, dataset / "out", body="hand")
    with pytest.raises(st.UsageError, match="it exists; name a new folder"):
        lerobot.add_percepts(dataset, tmp_path, body="hand")
    assert [path.name for path in tmp_path.iterdir()] == ["dataset"] and not (dataset / "out").exists()
    lerobot.add_percepts(dataset, out, body="hand")
    with pytest.raises(st.UsageError, match=r"it has a feature `observation\.percepts\.contact` already"):
        lerobot.add_percepts(out, tmp_path / "again", body="hand")


def test_without_pyarrow_it_says_what_to_install() -> None:
    code = "import sys; sys.modules['pyarrow'] = None; from somatic_touch import lerobot; lerobot.read('dataset')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "which pyarrow reads; run `pip install pyarrow`" in done.stderr


def test_the_page_shows_code_that_runs(tmp_path: pathlib.Path, monkeypatch) -> None:
    write(tmp_path / "pick", "v3.0")
    monkeypatch.chdir(tmp_path)
    [block] = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "how-to" / "lerobot.md").read_text(), re.DOTALL)
    exec(compile(block, "lerobot.md", "exec"), {})
    assert (tmp_path / "pick-with-percepts" / "meta" / "info.json").is_file()


def test_the_example_of_its_documentation_runs() -> None:
    found = doctest.testmod(lerobot, extraglobs={})
    assert found.attempted == 2 and not found.failed
