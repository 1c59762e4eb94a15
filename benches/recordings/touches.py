"""Touches of a person who handles a humanoid: three fingers on its forearm."""

import sys

seconds = float(sys.argv[1])
print(f"""body = "h1.glb"
rate_hz = 250
duration_s = {seconds}
seed = 11

[layer]
thickness_m = 0.004

[sensor]
kind = "linear"
offset = 40
gain = 300
bits = 10
noise_sigma = 0.7
""")


def touch(field, path, newton):
    times = [seconds * i / (len(path) - 1) for i in range(len(path))]
    print(f"""[[touch]]
on = "{field}"
indenter = "fingertip"
path = {path}
times_s = {times}
hold = {{ newton = {newton} }}
""")


# Strokes to and fro, 4 s each way, of which the field's chart holds every place.
def stroke(half):
    turns = max(int(seconds / 4), 1)
    return [[-half if i % 2 == 0 else half, 0.0] for i in range(turns + 1)]


touch("left_arm/forearm/back_2", stroke(0.008), 6)
touch("left_arm/forearm/outer_1", stroke(0.006), 6)
touch("left_arm/forearm/outer_4", stroke(0.006), 4)
