"""What people who know Python expect of any package: dicts, slices, names in errors, pickles, copies and dates."""

from __future__ import annotations

import copy
import datetime
import pickle

import numpy as np
import pandas as pd
import polars as pl
import pytest

import somatic_touch as st

OUTPUTS = ["total", "centroid", "position", "touches"]


@pytest.fixture(scope="module")
def p() -> st.Percepts:
    touch = st.read("hand")
    return touch.engine({"outputs": OUTPUTS}, backend="cpu").process(touch.t, touch.values)


def test_flags_are_printed_by_their_names() -> None:
    assert f"{st.Flags(4)}, {st.Flags(36)}, {st.Flags(0)}" == "TIE, TIE|STILL, none"
    assert str(st.TouchFlags(1 << 30)) == str(1 << 30) and st.Flags(4) == 4
    assert str(st.Flags(np.uint32(4))) == "TIE"


@pytest.mark.parametrize(
    ("ask", "says"),
    [
        (lambda p: p["centriod"], "there is no output `centriod`; did you mean `centroid`?"),
        (lambda p: p.present("centriod"), "did you mean `centroid`"),
        (lambda p: p["force"], "`force` was not asked for; add it to the scene's outputs"),
        (lambda p: p["touches"], r"see `\.touches`"),
        (lambda p: p.index("hand/plam"), "did you mean `hand/palm`"),
        (lambda p: p.select("hand/plam"), "no field matches `hand/plam`; did you mean `hand/palm`"),
        (lambda p: p.touches["spraed"], "did you mean `spread`"),
        (lambda p: p.touches.unit("spraed"), "did you mean `spread`"),
        (lambda p: p.touches["wrench"], "there are: total"),
    ],
)
def test_an_unknown_name_is_a_key_error_that_names_the_nearest(p: st.Percepts, ask, says: str) -> None:
    with pytest.raises(st.UnknownNameError, match=says) as caught:
        ask(p)
    assert isinstance(caught.value, KeyError) and isinstance(caught.value, st.UsageError)
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


def test_what_is_given_in_the_wrong_form_is_told_the_right_one(p: st.Percepts, hand: st.Body) -> None:
    for columns in (p, p.touches):
        with pytest.raises(TypeError, match=r'columns are read by name, such as \["total"\]'):
            columns[0]  # type: ignore[index,call-overload]
    with pytest.raises(st.UsageError, match="pitch_m should be a number of metres"):
        st.Body.grid(3, 4, "10 mm")  # type: ignore[arg-type]
    assert len(st.Body.grid(3, 4, (0.01, 0.02)).taxels) == len(st.Body.grid(3, 4, 1).taxels) == 12
    with pytest.raises(st.UsageError, match=r'is a file\'s name.*Scene.load\("robot.scene.toml"\)'):
        st.Engine(hand, "robot.scene.toml")


def test_percepts_are_used_as_a_dict(p: st.Percepts) -> None:
    assert list(p) == p.keys() == [name for name, _ in p.items()] and len(p.values()) == len(p)
    assert all(column is p[name] for name, column in p.items())
    assert "centroid" in p and "touches" not in p
    assert p.get("centroid") is p["centroid"] and p.get("force") is None and p.get("force", 3) == 3
    assert dict(p.items()).keys() == set(p.keys())


def test_a_part_has_the_frames_between_two_times(p: st.Percepts) -> None:
    part = p.between(2, 3.5)
    frames = (p.t >= 2) & (p.t < 3.5)
    assert part.t.tolist() == p.t[frames].tolist() and part.first_frame == np.argmax(frames)
    for name in p:
        assert np.array_equal(part[name], p[name][frames], equal_nan=True)
        assert np.array_equal(part.present(name), p.present(name)[frames])
        assert not part[name].flags.writeable
    assert np.array_equal(part.flags, p.flags[frames]) and np.array_equal(part.contact, p.contact[frames])
    rows = (p.touches.t >= 2) & (p.touches.t < 3.5)
    assert 0 < len(part.touches) == rows.sum() < len(p.touches)
    assert np.array_equal(part.t[part.touches.frame], part.touches.t)
    assert np.array_equal(part.touches["spread"], p.touches["spread"][rows], equal_nan=True)
    assert part.between(2.5).between(None, 3) == p.between(2.5, 3)
    assert len(p.between(100).t) == 0 and len(p.between(100).touches) == 0
    assert p.between().t.shape == p.t.shape
    with pytest.raises(st.UsageError, match="t0 should be a time"):
        p.between("now")  # type: ignore[arg-type]
    with pytest.raises(st.UsageError, match="NaN"):
        p.between(float("nan"))


def test_times_that_are_not_in_order_have_no_part() -> None:
    engine = st.Engine(st.Body.grid(1, 2, 0.01), {"outputs": ["total"]}, backend="cpu")
    p = engine.process([0.0, 5.0, 1.0, 2.0], np.ones((4, 2)))
    with pytest.raises(st.UsageError, match="not in order: frame 1 at 5 s"):
        p.between(0, 3)
    assert p.between(0.5, 3).t.tolist() == [1, 2]


def test_a_part_has_the_fields_whose_names_match(p: st.Percepts) -> None:
    part = p.select(["hand/b*", "hand/palm/**"])
    assert part.fields == [name for name in p.fields if name == "hand/back" or name.startswith("hand/palm/")]
    chosen = [p.index(name) for name in part.fields]
    for name in p:
        assert np.array_equal(part[name], p[name][:, chosen], equal_nan=True)
    assert part.flags.shape == (280, len(chosen)) and part.t is p.t or len(part.t) == 280
    assert [part.index(name) for name in part.fields] == list(range(len(chosen)))
    # A star does not go over a slash, as in a scene.
    assert all("/" not in name[5:] for name in p.select("hand/*").fields)
    assert part.select("hand/back").fields == ["hand/back"]
    with pytest.raises(st.UsageError, match="not a glob"):
        p.select("hand/[")


@pytest.mark.parametrize("all_fields", [False, True])
def test_tables_of_a_part_are_the_rows_of_the_whole(p: st.Percepts, all_fields: bool) -> None:
    part = p.between(2, 5).select("hand/{back,palm}")
    whole = p.to_polars(all_fields=all_fields)
    rows = whole.filter((pl.col("t") >= 2) & (pl.col("t") < 5) & pl.col("field").cast(pl.String).is_in(part.fields))
    assert part.to_polars(all_fields=all_fields).equals(rows) and len(rows) > 100
    assert (len(rows) == part.flags.size) == all_fields
    assert pl.DataFrame(p.between(100)).columns == whole.columns
    with pytest.raises(st.UsageError, match="part of percepts"):
        st.write(part, "no.csv")


def test_touches_are_walked_by_touch_and_by_frame(p: st.Percepts) -> None:
    touches = p.touches
    by_frame = list(touches.by_frame())
    assert len(by_frame) == len(p.t) and sum(map(len, by_frame)) == len(touches)
    assert [len(part) for part in by_frame] == np.bincount(touches.frame, minlength=len(p.t)).tolist()
    assert np.array_equal(np.concatenate([part.id for part in by_frame]), touches.id)
    rows = list(touches)
    assert len(rows) == len(touches) and [row["id"] for row in rows] == touches.id.tolist()
    for index, row in enumerate(rows):
        assert isinstance(row["flags"], st.TouchFlags) and row["link"] == touches.link[index]
        for name in touches.keys():
            if name not in row:
                assert np.isnan(touches[name][index]).all()
            elif name not in ("flags", "link"):
                assert np.array_equal(row[name], touches[name][index])
    assert any("velocity" not in row for row in rows) and any("velocity" in row for row in rows)
    assert "spread" in touches and touches.get("wrench") is None and dict(touches.items()).keys() == set(touches.keys())
    assert touches.unit("total") == "count" and touches.unit("spread") == "m" and touches.unit("flags") == "1"


def test_touches_have_the_ids_of_their_taxels(p: st.Percepts) -> None:
    touch = st.read("hand")
    touches = touch.engine({"outputs": ["touches", "touches.taxels"]}, backend="cpu").process(touch.t, touch.values).touches
    assert len(touches) > 100 and [len(taxels) for taxels in touches.taxels] == touches.active.tolist()
    for frame, total, taxels in zip(touches.frame, touches.total, touches.taxels, strict=True):
        columns = [touch.taxels.index(id) for id in taxels]
        assert touch.values[frame, columns].sum() == pytest.approx(total)
    with pytest.raises(st.UsageError, match="touches.taxels"):
        p.touches.taxels


def test_touches_and_self_contacts_go_into_tables(p: st.Percepts) -> None:
    assert p.touches.to_pandas()["touch"].tolist() == p.touches.to_polars()["touch"].to_list() == p.touches.id.tolist()
    assert p.touches.to_arrow().num_rows == len(p.touches)
    engine = st.Engine(st.Body.bundled("hand"), {"outputs": ["self_contacts"]}, backend="cpu")
    contacts = engine.step(0, [0] * 40).self_contacts
    assert contacts.to_arrow().num_rows == 0 and contacts.to_pandas().empty and contacts.to_polars().is_empty()
    assert list(contacts) == [] and [len(part) for part in contacts.by_frame()] == [0]
    assert contacts["distance"].shape == (0,) and contacts.get("distances") is None and "angle" in contacts
    with pytest.raises(st.UnknownNameError, match="did you mean `distance`"):
        contacts["distanse"]


BODY = st.Body.bundled("hand")
CALIBRATION = st.Calibration("[all]\nbaseline = 2\nunit = 'kPa'", BODY)


@pytest.mark.parametrize(
    "thing",
    [BODY, CALIBRATION, st.Scene(outputs=["total"], fields="hand/*"), st.read("hand")],
    ids=lambda thing: type(thing).__name__,
)
def test_what_does_not_change_is_pickled_copied_and_compared(thing) -> None:
    again = pickle.loads(pickle.dumps(thing))
    assert again == thing and again is not thing and repr(again) == repr(thing)
    assert copy.copy(thing) is thing and copy.deepcopy(thing) is thing
    assert thing != "another" and thing is not None
    if not isinstance(thing, st.Recording):
        assert hash(again) == hash(thing)


class Pickled:
    """What pickles as a calibration did that an older version wrote."""

    def __init__(self, *parts: object) -> None:
        self.parts = parts

    def __reduce__(self):
        return st.Calibration._of_parts, self.parts  # type: ignore[attr-defined]


def test_pickles_of_older_calibrations_load() -> None:
    ids = BODY.taxels["id"].tolist()
    again = pickle.loads(pickle.dumps(Pickled(CALIBRATION.text, "hand", ids)))
    assert again == CALIBRATION and pickle.loads(pickle.dumps(again)) == CALIBRATION
    touch = st.read("hand")
    values = [touch.engine(None, given, "cpu").process(touch.t, touch.values)["total"] for given in (again, CALIBRATION)]
    assert np.array_equal(*values, equal_nan=True)
    renamed = pickle.loads(pickle.dumps(Pickled("[upkeep]\ncadence_s = 1\n", "hand", ids)))
    assert renamed == st.Calibration(renamed.text, BODY) and "[drift]" in renamed.text
    with pytest.raises(st.InputError, match=r"a pickled calibration: .*\[taxel.7\] names a taxel that the body does not have"):
        pickle.loads(pickle.dumps(Pickled("[taxel.7]\ngain = 2", "hand", [1, 2])))
    with pytest.raises(TypeError, match="taxels"):
        pickle.loads(pickle.dumps(Pickled("", "hand", "all")))


def test_what_differs_is_not_equal() -> None:
    assert st.Body.grid(2, 2, 0.01) != st.Body.grid(2, 3, 0.01) and st.Body.grid(2, 2, 0.01) == st.Body.grid(2, 2, 0.01)
    assert st.Calibration("", BODY) != CALIBRATION
    keys, text = st.Scene(outputs=["total"], max_gap_s=2), st.Scene("max_gap_s = 2\noutputs = ['total']")
    assert keys == text and hash(keys) == hash(text) and keys != st.Scene(outputs=["total"])
    touch = st.read("hand")
    assert touch != st.read("hand", to_s=3) and touch == st.read("hand")


def test_a_recording_comes_back_to_the_bit() -> None:
    touch = st.read("hand", from_s=1, to_s=2)
    assert len(touch) == 50
    values = np.array(touch.values)
    values[3, 4] = np.nan
    engine = touch.engine({"outputs": ["total"]}, backend="cpu")
    missing = engine.process(touch.t, [{0: 1.0}] * 50)
    again = pickle.loads(pickle.dumps(touch))
    assert again.values.tobytes() == touch.values.tobytes() and np.array_equal(again.mask, touch.mask)
    assert not again.values.flags.writeable and not again.t.flags.writeable
    assert again.body == touch.body and again.losses == touch.losses
    assert st.Flags.INCOMPLETE in st.Flags(missing.flags[0, missing.index("hand/palm")])


def test_an_engine_is_pickled_before_its_first_frame_and_copied_at_any(p: st.Percepts) -> None:
    touch = st.read("hand")
    engine = touch.engine({"outputs": OUTPUTS}, CALIBRATION, "cpu")
    again = pickle.loads(pickle.dumps(engine))
    first = engine.process(touch.t[:240], touch.values[:240])
    assert again.process(touch.t[:240], touch.values[:240]) == first
    with pytest.raises(TypeError, match="has processed 240 frames.*pickle it before"):
        pickle.dumps(engine)
    for other in (copy.copy(engine), copy.deepcopy(engine)):
        rest = other.process(touch.t[240:], touch.values[240:])
        assert rest.first_frame == 240
    assert engine.process(touch.t[240:], touch.values[240:]) == rest
    assert engine.step(6, [0] * 40).first_frame == 280


def test_what_cannot_be_pickled_says_what_to_send(p: st.Percepts) -> None:
    state = st.Engine(BODY, backend="cpu").state()
    for thing, says in [(p, "to_arrow"), (p.touches, "to_arrow"), (state, "copy.copy"), (st.open("hand"), "its path")]:
        with pytest.raises(TypeError, match=says):
            pickle.dumps(thing)
    assert copy.copy(p) is p and copy.deepcopy(p.touches) is not None


def test_percepts_are_equal_if_they_say_the_same(p: st.Percepts) -> None:
    touch = st.read("hand")
    again = touch.engine({"outputs": OUTPUTS}, backend="cpu").process(touch.t, touch.values)
    assert again == p and not again != p
    assert p.between(0, 2) != p.between(0, 3) and p != 3
    values = np.array(touch.values)
    values[250, 4] += 1
    assert touch.engine({"outputs": OUTPUTS}, backend="cpu").process(touch.t, values) != p
    with pytest.raises(TypeError):
        hash(p)


MIDNIGHT = datetime.datetime(2026, 1, 2, tzinfo=datetime.UTC)
LATER = MIDNIGHT + datetime.timedelta(microseconds=123_456)


@pytest.mark.parametrize(
    "t",
    [
        [MIDNIGHT, LATER],
        [MIDNIGHT.replace(tzinfo=None), LATER.replace(tzinfo=None)],
        [time.astimezone(datetime.timezone(datetime.timedelta(hours=5))) for time in (MIDNIGHT, LATER)],
        np.array(["2026-01-02", "2026-01-02T00:00:00.123456"], "datetime64[ns]"),
        np.array(["2026-01-02", "2026-01-02T00:00:00.123456"], "datetime64[us]"),
        pd.DatetimeIndex([MIDNIGHT, LATER]),
        pd.Series([MIDNIGHT, LATER]),
        pd.Series([MIDNIGHT, LATER]).dt.tz_localize(None),
        pl.Series([MIDNIGHT, LATER]),
        np.array([MIDNIGHT, LATER]),
    ],
    ids=lambda t: f"{type(t).__module__}.{type(t).__name__}",
)
def test_dates_are_seconds_since_1970(t) -> None:
    engine = st.Engine(BODY, {"outputs": ["total"]}, backend="cpu")
    p = engine.process(t, np.zeros((2, 40), np.float32))
    assert p.t.tolist() == [1767312000.0, 1767312000.123456]
    assert p.between(MIDNIGHT, LATER).t.tolist() == [1767312000.0]


def test_one_date_and_spans_of_time() -> None:
    engine = st.Engine(BODY, {"outputs": ["total"]}, backend="cpu")
    frame = [0.0] * 40
    assert engine.step(MIDNIGHT, frame).t.tolist() == [1767312000.0]
    assert engine.step(np.datetime64("2026-01-02T00:00:01"), frame).t.tolist() == [1767312001.0]
    assert engine.step(pd.Timestamp("2026-01-02T00:00:02", tz="UTC"), frame).t.tolist() == [1767312002.0]  # type: ignore[arg-type]
    spans = np.array([0, 1500], "timedelta64[ms]")
    assert engine.process(spans, np.zeros((2, 40))).t.tolist() == [0, 1.5]
    for t in ([MIDNIGHT, pd.NaT], np.array(["2026", "NaT"], "M8[s]")):
        with pytest.raises(st.UsageError, match="NaT"):
            engine.process(t, np.zeros((2, 40)))
    with pytest.raises(st.UsageError, match="t should be a time in seconds, or a datetime"):
        engine.step("now", frame)  # type: ignore[arg-type]


def test_frames_may_be_dicts_by_taxel() -> None:
    engine = st.Engine(BODY, {"outputs": ["total"]}, backend="cpu")
    frames = [{4: 512.0, 7: 3}, {}, {4: None, 7: np.nan}, {np.int64(4): np.float32(1)}]
    values, mask = np.zeros((4, 40), np.float32), np.ones((4, 40), bool)
    values[0, [4, 7]], values[2, 7], values[3, 4] = [512, 3], np.nan, 1
    mask[0, [4, 7]] = mask[2, 7] = mask[3, 4] = False
    got = engine.process(range(4), frames)
    assert got == st.Engine(BODY, {"outputs": ["total"]}, backend="cpu").process(range(4), values, mask)
    assert np.array_equal(engine.step(4, frames[0]).flags[0], got.flags[0])
    few = st.Engine(BODY, {"outputs": ["total"]}, backend="cpu", taxels=[7, 4])
    assert np.nanmax(few.step(0, {4: 512})["total"]) == 512
    for wrong, says in [
        ({99: 1}, "frame 0 has a value of taxel 99"),
        ({"four": 1}, "taxel 'four'"),
        ({4: "much"}, "taxel 4 should have a number"),
    ]:
        with pytest.raises(st.UsageError, match=says):
            engine.step(5, wrong)  # type: ignore[arg-type]
    with pytest.raises(st.UsageError, match="give no mask"):
        engine.step(5, {4: 1}, [False] * 40)
    with pytest.raises(st.UsageError, match="frame 1 has a value of taxel 9999"):
        engine.process([5, 6], [{}, {9999: 1}])


def test_messages_speak_of_keywords(tmp_path) -> None:
    numbers = tmp_path / "numbers.csv"
    numbers.write_text("1,2,3\n4,5,6\n7,8,9\n")
    with pytest.raises(st.SomaticError) as caught:
        st.read(numbers)
    assert "--" not in str(caught.value) and "rate_hz=HZ" in str(caught.value) and "grid='1x3'" in str(caught.value)
    for keys, says in [
        ({"grid": "wide"}, "grid"),
        ({"pitch": "1"}, "pitch"),
        ({"rate_hz": -1.0}, "rate_hz"),
        ({"layout": "a.csv"}, "layout="),
    ]:
        with pytest.raises(st.SomaticError) as caught:
            st.read(numbers, **keys)
        assert "--" not in str(caught.value) and says in str(caught.value), caught.value
    there = tmp_path / "there.csv"
    there.write_text("")
    touch = st.read("hand")
    p = touch.engine({"outputs": ["total"]}, backend="cpu").process(touch.t, touch.values)
    with pytest.raises(st.SomaticError, match="give force=True"):
        st.write(p, there)


def test_commands_in_messages_stay_as_they_are_typed() -> None:
    from somatic_touch._words import in_keywords

    for text in [
        "the body has no taxels: add some, as with `somatic author --taxels 500`",
        "this is a PNG, not a glTF; make one of it: somatic author a.png --taxels 500 -o body.glb",
        "give --label a name that it has",
        "nothing to say",
    ]:
        assert in_keywords(text) == text
    for flags, keywords in [
        ("give its frame rate with --rate HZ", "give its frame rate with rate_hz=HZ"),
        ("--grid and --pitch are for plain matrices", "grid= and pitch= are for plain matrices"),
        ("as with --grid 31x11", "as with grid='31x11'"),
        ("--rate 0 is not a frame rate", "rate_hz=0 is not a frame rate"),
        ("--grid wide is not rows and columns", "grid='wide' is not rows and columns"),
        ("--rate is not a frame rate; give Hz", "rate_hz= is not a frame rate; give Hz"),
        ("values are left out (--strict stops instead)", "values are left out"),
        ("--force, or `somatic run --force`; --force", "force=True, or `somatic run --force`; force=True"),
    ]:
        assert in_keywords(flags) == keywords


def test_notebooks_show_a_short_table(p: st.Percepts) -> None:
    touch = st.read("hand")
    for thing in (p, p.touches, p.between(100), p.between(100).touches, touch, BODY, st.Body.grid(2, 2, 0.01, name="<b>")):
        text = thing._repr_html_()
        assert text.startswith("<div>") and text.endswith("</div>") and text.count("<tr>") <= 12 and "nan" not in text
    assert "hand/back" in p._repr_html_() and "count" in p._repr_html_() and "&lt;b&gt;" in text
    engine = st.Engine(BODY, {"outputs": ["self_contacts"]}, backend="cpu")
    assert "distance" in engine.step(0, [0] * 40).self_contacts._repr_html_()
