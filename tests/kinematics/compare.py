"""Where yourdfpy and pinocchio have the links of a robot, against poses from elsewhere.

    compare.py where ROBOT
    compare.py compare ROBOT.urdf NAMES.json NUMBERS
    compare.py places ROBOT.urdf NAMES.json NUMBERS

`where` prints the path of a robot's URDF among example-robot-data. NAMES.json has the lists "joints" and "links". NUMBERS are
doubles: for each configuration the joints' positions, then each link's root_from_link as the 12 numbers of a 3 × 4 matrix,
row by row. Prints, for each of the two libraries, the largest distance of any of those numbers, as JSON. For `places` they are for
each touch the joints' positions, the index of a link, a point in that link, and where it was said to be in the world.
"""

import json
import sys
from pathlib import Path

import numpy as np

URDF = {
    "panda": "panda_description/urdf/panda.urdf",
    "icub": "icub_description/robots/icub.urdf",
    "tiago": "tiago_description/robots/tiago.urdf",
}


def folder():
    import importlib.metadata

    for file in importlib.metadata.files("example-robot-data"):
        if str(file).endswith(URDF["panda"]):
            return Path(file.locate()).resolve().parents[2]
    raise SystemExit("example-robot-data has no panda")


def by_pinocchio(path, robot, joints, links, positions):
    import pinocchio as pin

    model = pin.buildModelFromUrdf(path)
    data = model.createData()
    frames = [model.getFrameId(link, pin.FrameType.BODY) for link in links]
    column = {joint: index for index, joint in enumerate(joints)}
    drives = []
    for index in range(1, model.njoints):
        # pinocchio moves joints that mimic by themselves.
        mimic = robot.joint_map[model.names[index]].mimic
        of, multiplier, offset = (mimic.joint, mimic.multiplier, mimic.offset) if mimic else (model.names[index], None, None)
        one = lambda number, usual: usual if number is None else number
        drives.append((model.joints[index], column[of], one(multiplier, 1.0), one(offset, 0.0)))
    for row in positions:
        q = pin.neutral(model)
        for joint, of, multiplier, offset in drives:
            position = multiplier * row[of] + offset
            # A joint that turns without end has cosine and sine.
            q[joint.idx_q : joint.idx_q + joint.nq] = position if joint.nq == 1 else [np.cos(position), np.sin(position)]
        pin.framesForwardKinematics(model, data, q)
        yield [data.oMf[frame].homogeneous[:3].ravel() for frame in frames]


def by_yourdfpy(path, robot, joints, links, positions):
    for row in positions:
        robot.update_cfg(dict(zip(joints, row)))
        yield [robot.get_transform(link, robot.base_link)[:3].ravel() for link in links]


def compare(path, names, numbers):
    import yourdfpy

    names = json.loads(Path(names).read_text())
    joints, links = names["joints"], names["links"]
    rows = np.fromfile(numbers).reshape(-1, len(joints) + 12 * len(links))
    positions, poses = rows[:, : len(joints)], rows[:, len(joints) :].reshape(len(rows), len(links), 12)
    robot = yourdfpy.URDF.load(path, load_meshes=False, build_scene_graph=True)
    largest = {}
    for name, library in (("pinocchio", by_pinocchio), ("yourdfpy", by_yourdfpy)):
        found = library(path, robot, joints, links, positions)
        apart = [np.abs(np.array(theirs) - ours).max() for theirs, ours in zip(found, poses)]
        # A number that is none is no small one.
        largest[name] = {"configurations": len(apart), "largest": float(np.max(apart))}
    json.dump(largest, sys.stdout)


def places(path, names, numbers):
    import yourdfpy

    names = json.loads(Path(names).read_text())
    joints, links = names["joints"], names["links"]
    rows = np.fromfile(numbers).reshape(-1, len(joints) + 7)
    positions, link, point, told = np.split(rows, [len(joints), len(joints) + 1, len(joints) + 4], axis=1)
    robot = yourdfpy.URDF.load(path, load_meshes=False, build_scene_graph=True)
    largest = {}
    for name, library in (("pinocchio", by_pinocchio), ("yourdfpy", by_yourdfpy)):
        apart = []
        for poses, of, p, place in zip(library(path, robot, joints, links, positions), link[:, 0], point, told):
            pose = np.reshape(poses[int(of)], (3, 4))
            apart.append(np.linalg.norm(pose[:, :3] @ p + pose[:, 3] - place))
        largest[name] = {"touches": len(apart), "largest": float(np.max(apart))}
    json.dump(largest, sys.stdout)


match sys.argv[1:]:
    case ["where", robot]:
        print(folder() / URDF[robot])
    case ["compare", path, names, numbers]:
        compare(path, names, numbers)
    case ["places", path, names, numbers]:
        places(path, names, numbers)
    case _:
        raise SystemExit(__doc__)
