"""A ball that slides over a skin with a `<tactile>` sensor, in MuJoCo.

    tactile.py FRAMES.ndjson

Writes lines {"time": s, "normal": [...], "first": [...], "second": [...]}, each a grid row by row from above: what the sensor gives of a
vertex along its normal and its two tangents. Of the last two it gives speeds, without a sign. Prints for each line the direction of the
slide, in radians from the first tangent t towards n × t, the ball's place along both, in metres, and whether the slide is along both
of the sensor's tangents and not against one, so that signs do not matter.
"""

import json
import sys

import mujoco
import numpy as np

# Vertices along both sides, 4 mm apart. Of the meshes that MuJoCo makes, a wedge has tangents that are tangents: one of a plate is its
# normal. This one is a part of a sphere of a metre, as good as flat, 2 mm over the pad, so that the ball reaches into it.
COUNT, PITCH_M, RADIUS_M, OVER_M = 17, 0.004, 1.0, 0.006
FOV_DEG = np.rad2deg(COUNT * PITCH_M / 2 / RADIUS_M)

MODEL = f"""
<mujoco>
  <option timestep="0.001" cone="elliptic" gravity="0 0 0"/>
  <asset>
    <mesh name="part" builtin="wedge" params="{COUNT} {COUNT} {FOV_DEG} {FOV_DEG} 0" scale="{RADIUS_M} {RADIUS_M} {RADIUS_M}"/>
  </asset>
  <worldbody>
    <body name="pad">
      <geom name="pad" type="box" size="0.04 0.04 0.004" friction="0.6"/>
      <geom name="skin" type="mesh" mesh="part" pos="0 0 {OVER_M - RADIUS_M}" euler="180 0 30" contype="0" conaffinity="0" mass="0"/>
    </body>
    <body name="ball" pos="0 0 0.0139">
      <joint name="x" type="slide" axis="1 0 0"/>
      <joint name="y" type="slide" axis="0 1 0"/>
      <joint name="z" type="slide" axis="0 0 1"/>
      <geom name="ball" type="sphere" size="0.01" mass="0.05" friction="0.6"/>
    </body>
  </worldbody>
  <sensor><tactile name="skin" geom="skin" mesh="part"/></sensor>
</mujoco>
"""


def matrix(quat):
    flat = np.zeros(9)
    mujoco.mju_quat2Mat(flat, quat)
    return flat.reshape(3, 3)


model = mujoco.MjModel.from_xml_string(MODEL)
skin = model.geom("skin").id
turn = matrix(model.geom_quat[skin])
places = model.mesh_vert @ turn.T + model.geom_pos[skin]
# By vertex, its normal and its tangents; those of the middle one are as good as all of them.
own = model.mesh_normal.reshape(-1, 3, 3) @ turn.T
middle = np.argmin(np.linalg.norm(places[:, :2], axis=1))
normal, first, second = own[middle]
assert normal[2] > 0.999 and np.abs(own - own[middle]).max() < 0.1, own[middle]
across = np.cross(normal, first)
# From above, row by row.
u, v = (np.round((places @ axis) / PITCH_M) for axis in (first, across))
rows = np.lexsort((u, -v))
assert len(set(zip(u, v))) == COUNT**2
truth = []
with open(sys.argv[1], "w", encoding="utf-8") as to:
    for number, degrees in enumerate((15, 35, 50, 80, 130, 220, 310)):
        data = mujoco.MjData(model)
        angle = np.deg2rad(degrees)
        way = np.cos(angle) * first + np.sin(angle) * second
        for step in range(120):
            data.qvel[:2] = 0.05 * way[:2]
            data.qfrc_applied[2] = -3
            mujoco.mj_step(model, data)
        mujoco.mj_forward(model, data)
        assert data.ncon == 1, "the ball is on the pad"
        values = data.sensordata.reshape(3, -1)[:, rows]
        line = {"time": number * 0.1} | {name: part.tolist() for name, part in zip(("normal", "first", "second"), values)}
        print(json.dumps(line), file=to)
        slid, place = data.qvel, data.body("ball").xpos
        along = [float(slid @ first), float(slid @ second)]
        direction = float(np.arctan2(slid @ across, slid @ first))
        truth.append([direction, float(place @ first), float(place @ across), min(along) > 0])
json.dump(truth, sys.stdout)
