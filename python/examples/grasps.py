"""Which of five objects a hand grasps, told from percepts: features over time, a plain classifier, one score.

    python grasps.py FOLDER [-o grasps.png]

FOLDER has 51 grasps by a Schunk SDH hand (Drimus et al., RAS 2012; github.com/mmadry/st-hmp), as labels.csv, layout.csv and csv/*.gz: six
pads, 486 taxels, 15 frames a second. All that is chosen is chosen on the earlier half of each object's grasps, which are in the order in which they
were made; the later half is scored once. Needs pandas, scikit-learn and matplotlib.
"""

from __future__ import annotations

import argparse
import gzip
import itertools
import pathlib

import matplotlib
import numpy as np
import numpy.typing as npt
import pandas as pd
import somatic_touch as st
from sklearn.linear_model import LogisticRegression
from sklearn.metrics import confusion_matrix
from sklearn.model_selection import LeaveOneOut, cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

ROWS, COLUMNS, PADS = 14, 6, 6
PITCH_M = 0.0034
REST_FRAMES = 20
OUTPUTS = ["total", "peak", "active", "centroid", "principal_axis", "anisotropy"]
# Counts above rest from which on a taxel is pressed: some times the sensors' noise.
CALIBRATION = "[all]\ndead_band = 8\n"


def hand(layout: pd.DataFrame) -> tuple[st.Body, list[int]]:
    """The pads as fields of one sheet, each with 14 rows, and the taxel of each value."""
    body = st.Body.grid(ROWS * PADS, COLUMNS, PITCH_M, name="hand", regions=(PADS, 1))
    taxels = (layout["pad"] * ROWS + layout["row"]) * COLUMNS + layout["col"]
    return body, taxels.tolist()


def percepts(path: pathlib.Path, body: st.Body, taxels: list[int]) -> st.Percepts:
    """The percepts of a grasp, above the rest of its own first frames."""
    with gzip.open(path) as file:
        rows = np.loadtxt(file, delimiter=",", skiprows=1)
    t, values = rows[:, 0], rows[:, 1:]
    values -= np.median(values[:REST_FRAMES], axis=0)
    scene = st.Scene(outputs=OUTPUTS, fields="hand/*")
    engine = st.Engine(body, scene, st.Calibration(CALIBRATION, body), "cpu", taxels=taxels)
    return engine.process(t, values.astype(np.float32))


def features(p: st.Percepts) -> dict[str, list[float]]:
    """Features over time, in groups, of the pads together and of the two that press most."""
    total = np.asarray(p["total"], np.float64)
    groups: dict[str, list[float]] = {name: [] for name in ("force", "area", "shape", "place", "time", "soft")}
    for pad in np.argsort(-total.max(axis=0), kind="stable")[:2]:
        force = total[:, pad]
        top = force.max()
        if top <= 0:
            for name, count in [("force", 2), ("area", 2), ("shape", 4), ("place", 3), ("time", 2), ("soft", 2)]:
                groups[name] += [0.0] * count
            continue
        held = force > 0.5 * top
        weight = force[held] / force[held].sum()
        active, peak = p["active"][held, pad], p["peak"][held, pad]
        axis, anisotropy = np.nan_to_num(p["principal_axis"][held, pad]), np.nan_to_num(p["anisotropy"][held, pad])
        centroid = p["centroid"][held, pad]
        rise = [p.t[np.argmax(force > share * top)] for share in (0.1, 0.8)]
        pressed = force > 0.05 * top
        slope = np.polyfit(np.log(force[pressed]), np.log(np.maximum(p["active"][pressed, pad], 1)), 1)[0]
        groups["force"] += [np.log(top), float(weight @ (peak / force[held]))]
        groups["area"] += [float(active.max()), float(weight @ active)]
        groups["shape"] += [float(weight @ anisotropy), float(anisotropy.std())]
        groups["shape"] += [float(weight @ (anisotropy * turn(2 * axis))) for turn in (np.cos, np.sin)]
        groups["place"] += [*(weight @ centroid), float(np.linalg.norm(centroid.std(axis=0)))]
        groups["time"] += [rise[1] - rise[0], p.t[held][-1] - p.t[held][0]]
        groups["soft"] += [float(slope), float(force[held][-len(weight) // 3 :].mean() / top)]
    return groups


def table(all_groups: list[dict[str, list[float]]], names: tuple[str, ...]) -> npt.NDArray[np.float64]:
    """A row for each grasp, of the groups called so."""
    return np.array([[number for name in names for number in groups[name]] for groups in all_groups])


def main() -> None:
    """Reads, chooses, scores and draws."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("folder", type=pathlib.Path)
    words.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path("grasps.png"))
    asked = words.parse_args()

    labels = pd.read_csv(asked.folder / "labels.csv")
    layout = pd.read_csv(asked.folder / "layout.csv")
    body, taxels = hand(layout.sort_values("taxel"))
    grasps = [features(percepts(asked.folder / "csv" / name, body, taxels)) for name in labels["file"]]
    objects = labels["object"].to_numpy()
    size = np.asarray(labels.groupby("object")["file"].transform("count"))
    earlier = (labels["order_in_block"] < size // 2).to_numpy()

    classifier = make_pipeline(StandardScaler(), LogisticRegression(C=0.3, max_iter=5000))
    ways = [names for count in (1, 2, 3, 4) for names in itertools.combinations(grasps[0], count)]
    learn = [grasp for grasp, is_earlier in zip(grasps, earlier, strict=True) if is_earlier]
    # Of equally good choices the first, which has the fewest groups.
    scores = [cross_val_score(classifier, table(learn, names), objects[earlier], cv=LeaveOneOut()).mean() for names in ways]
    chosen = ways[int(np.argmax(scores))]
    print(f"chosen on the earlier half: {', '.join(chosen)} ({100 * max(scores):.1f} % of {earlier.sum()}, leaving one out)")

    classifier.fit(table(learn, chosen), objects[earlier])
    later = [grasp for grasp, is_earlier in zip(grasps, earlier, strict=True) if not is_earlier]
    guessed = classifier.predict(table(later, chosen))
    right = int((guessed == objects[~earlier]).sum())
    print(f"the later half, scored once: {right} of {len(later)}, {100 * right / len(later):.1f} %")
    felt = dict(zip(labels["file"], labels["touched"], strict=True))
    for name, wanted, got in zip(labels["file"][~earlier], objects[~earlier], guessed, strict=True):
        if wanted != got:
            print(f"  {name}: {got}" + ("" if felt[name] else " (the pads never felt it)"))

    names = sorted(set(objects))
    counts = confusion_matrix(objects[~earlier], guessed, labels=names)
    figure, axes = plt.subplots(figsize=(5.4, 4.6), layout="constrained")
    axes.imshow(counts, cmap="Blues", vmin=0, vmax=counts.sum(axis=1).max())
    shown = [name.replace("_", " ").lower() for name in names]
    axes.set_xticks(range(len(names)), shown, rotation=30, ha="right")
    axes.set_yticks(range(len(names)), shown)
    axes.set(xlabel="told", ylabel="grasped", title=f"{right} of {len(later)} grasps right")
    for row, column in np.ndindex(counts.shape):
        if counts[row, column]:
            dark = counts[row, column] > 0.6 * counts.max()
            axes.text(column, row, counts[row, column], ha="center", va="center", color="white" if dark else "black")
    figure.savefig(asked.output, dpi=130)
    print(asked.output)


if __name__ == "__main__":
    main()
