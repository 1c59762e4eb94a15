"""From a recording to pandas to a plot: load under two insoles, and where it is."""

import pathlib

import matplotlib
import somatic_touch as st

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

folder = pathlib.Path(__file__).parents[2]
insoles = st.read(folder / "examples" / "exports" / "insoles.csv")
p = insoles.engine({"outputs": ["force", "centroid"]}, backend="cpu").process(insoles.t, insoles.values)

table = p.to_pandas()
print(table.groupby("field", observed=True)["force"].agg(["count", "mean", "max"]).round(1))

figure, (load, path) = plt.subplots(1, 2, figsize=(9, 3.6), width_ratios=[2, 1], layout="constrained")
for field, rows in table.groupby("field", observed=True):
    load.plot(rows["t"], rows["force"], label=field)
    path.plot(1000 * rows["centroid_u"], 1000 * rows["centroid_v"], ".", markersize=3, label=field)
load.set(xlabel="time [s]", ylabel="force [N]")
load.legend(frameon=False)
path.set(xlabel="u [mm]", ylabel="v [mm]", aspect="equal", title="centroid")
figure.savefig("insoles.png", dpi=120)
print("insoles.png")
