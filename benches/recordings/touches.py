"""Touches of a person who handles a humanoid: a hand on its forearm, a finger on its chest, one on its shank."""

import sys

seconds = float(sys.argv[1])
print(f"""body = "h1.glb"
rate_hz = 250
duration_s = {seconds}
seed = 11

[skin]
thickness_m = 0.004

[sensor]
kind = "linear"
offset = 40
gain = 300
bits = 10
noise_sigma = 0.7
""")


def touch(link, path, newton):
    times = [seconds * i / (len(path) - 1) for i in range(len(path))]
    print(f"""[[touch]]
on = "{link}"
indenter = "fingertip"
path = {path}
times_s = {times}
hold = {{ newton = {newton} }}
""")


# Strokes up and down, 4 s each way; the first and last places are the same.
def stroke(a, b):
    turns = max(int(seconds / 4), 1)
    return [a if i % 2 == 0 else b for i in range(turns + 1)]


touch("left_forearm", stroke([0.03, 0.0, -0.04], [0.03, 0.0, -0.10]), 6)
touch("chest", stroke([-0.04, 0.12, 0.1], [0.04, 0.12, 0.1]), 4)
