"""Where MuJoCo itself has the taxels of a model, as JSON.

    positions.py MODEL.xml

For each <tactile> and touch_grid sensor, in the order of the model: its taxels in the frame of the body that they are on,
and how many numbers it gives.
"""

import json
import sys

import mujoco
import numpy as np


# Meshes that only carry taxels are in group 3.
COLLIDING = np.array([1, 1, 1, 0, 1, 1], dtype=np.uint8)


def matrix(quat):
    flat = np.zeros(9)
    mujoco.mju_quat2Mat(flat, quat)
    return flat.reshape(3, 3)


def tactile(model, sensor):
    mesh, geom = model.sensor_objid[sensor], model.sensor_refid[sensor]
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    vertices = model.mesh_vert[first : first + count]
    places = vertices @ matrix(model.geom_quat[geom]).T + model.geom_pos[geom]
    return [[model.body(model.geom_bodyid[geom]).name, *place.tolist()] for place in places]


def touch_grid(model, data, sensor, config):
    """The middle of each bin, as far as a ray from the site goes to leave what is around it."""
    site = model.sensor_objid[sensor]
    origin, turn = data.site_xpos[site], data.site_xmat[site].reshape(3, 3)
    (columns, rows), (fov_x, fov_y), gamma = config
    edges = lambda count, fov: np.deg2rad(fov) * (lambda x: gamma * x**5 + (1 - gamma) * x)(np.linspace(-1, 1, count + 1))
    middles = lambda edges: (edges[1:] + edges[:-1]) / 2
    taxels = []
    for elevation in middles(edges(rows, fov_y)):
        for azimuth in middles(edges(columns, fov_x)):
            across = np.cos(elevation)
            along = turn @ [across * np.sin(azimuth), np.sin(elevation), -across * np.cos(azimuth)]
            geom = np.zeros(1, dtype=np.int32)
            distance = mujoco.mj_ray(model, data, origin, along, COLLIDING, 1, -1, geom)
            if distance < 0:
                taxels.append(None)
                continue
            body = model.geom_bodyid[geom[0]]
            place = data.xmat[body].reshape(3, 3).T @ (origin + distance * along - data.xpos[body])
            taxels.append([model.body(body).name, *place.tolist()])
    return taxels


def config(model, sensor):
    instance = model.sensor_plugin[sensor]
    start = model.plugin_attradr[instance]
    # The plugin's four attributes, each ended by a zero.
    words = bytes(model.plugin_attr[start:]).split(b"\0")[:4]
    _, size, fov, gamma = (word.decode() for word in words)
    pair = lambda text, kind: tuple(kind(float(word)) for word in text.split())
    return pair(size, int), pair(fov, float), float(gamma or 0)


model = mujoco.MjModel.from_xml_path(sys.argv[1])
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
found = []
for sensor in range(model.nsensor):
    kind = model.sensor_type[sensor]
    if kind == mujoco.mjtSensor.mjSENS_TACTILE:
        taxels = tactile(model, sensor)
    elif kind == mujoco.mjtSensor.mjSENS_PLUGIN:
        taxels = touch_grid(model, data, sensor, config(model, sensor))
    else:
        continue
    found.append({"name": model.sensor(sensor).name, "numbers": int(model.sensor_dim[sensor]), "taxels": taxels})
json.dump({"version": mujoco.__version__, "sensors": found}, sys.stdout)
