"""A ball that slides over a pad with a touch grid, in MuJoCo.

    slide.py FRAMES.ndjson [MODEL.xml]

Writes lines {"time": s, "sensordata": [...]}: the grid's forces along the normal, then along x and y of its site. Prints for
each line the direction of the force on the pad in its plane, in radians, and the direction of the slide. With a second file, that
is where the model is written, and its site is turned by 40° about the normal.
"""

import json
import sys

import mujoco
import numpy as np

MODEL = """
<mujoco>
  <option timestep="0.001" cone="elliptic"/>
  <extension><plugin plugin="mujoco.sensor.touch_grid"/></extension>
  <worldbody>
    <body name="pad">
      <geom name="pad" type="box" size="0.03 0.03 0.004" friction="0.6"/>
      <site name="eye" pos="0 0 -0.02" euler="180 0 0"/>
    </body>
    <body name="ball" pos="0 0 0.0139">
      <joint name="x" type="slide" axis="1 0 0"/>
      <joint name="y" type="slide" axis="0 1 0"/>
      <joint name="z" type="slide" axis="0 0 1"/>
      <geom name="ball" type="sphere" size="0.01" mass="0.05" friction="0.6"/>
    </body>
  </worldbody>
  <sensor>
    <plugin name="grid" plugin="mujoco.sensor.touch_grid" objtype="site" objname="eye">
      <config key="nchannel" value="3"/>
      <config key="size" value="9 9"/>
      <config key="fov" value="60 60"/>
      <config key="gamma" value="0"/>
    </plugin>
  </sensor>
</mujoco>
"""

if len(sys.argv) > 2:
    MODEL = MODEL.replace('euler="180 0 0"', 'euler="180 0 40"')
    with open(sys.argv[2], "w", encoding="utf-8") as to:
        to.write(MODEL.strip())
model = mujoco.MjModel.from_xml_string(MODEL)
truth = []
with open(sys.argv[1], "w", encoding="utf-8") as to:
    for turn in range(24):
        data = mujoco.MjData(model)
        angle = np.deg2rad(15 * turn - 172.5)
        for step in range(120):
            data.qvel[:2] = 0.05 * np.cos(angle), 0.05 * np.sin(angle)
            data.qfrc_applied[2] = -3
            mujoco.mj_step(model, data)
        mujoco.mj_forward(model, data)
        assert data.ncon == 1, "the ball is on the pad"
        force = np.zeros(6)
        mujoco.mj_contactForce(model, data, 0, force)
        # From the first geom of a contact to the second.
        on_second = data.contact[0].frame.reshape(3, 3).T @ force[:3]
        on_pad = on_second if data.contact[0].geom[1] == model.geom("pad").id else -on_second
        truth.append([float(np.arctan2(on_pad[1], on_pad[0])), float(angle)])
        line = {"time": turn * 0.1, "sensordata": data.sensordata.tolist()}
        print(json.dumps(line), file=to)
json.dump(truth, sys.stdout)
