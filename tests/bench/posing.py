"""Milliseconds of a drag: springs on trees of 60 and of 1,000 joints, with a pin, and how the cost grows with joints."""

from time import thread_time

import numpy as np

from mocap.posing.poses import Pose
from mocap.posing.springs import drag


def rows():
    """The median of drags of random joints by a third of the figure's size."""
    counts = np.array([60, 125, 250, 500, 1000])
    spent = np.array([_milliseconds(int(count)) for count in counts])
    return {
        "ms_per_drag": spent[0],
        "ms_per_drag_1000_joints": spent[-1],
        "slope": np.polyfit(np.log(counts), np.log(spent), 1)[0],  # 1 is linear
    }


def _milliseconds(count):
    """The best of five rounds of fifteen drags each."""
    rng = np.random.default_rng(count)
    parents = (-1, *(int(rng.integers(max(0, joint - 4), joint)) for joint in range(1, count)))
    places = np.zeros((count, 3))
    for joint in range(1, count):
        places[joint] = places[parents[joint]] + 0.1 * rng.normal(size=3)
    pose = Pose(places, np.tile([0.0, 0, 0, 1], (count, 1)))
    size = np.linalg.norm(places - places.mean(axis=0), axis=1).max()
    asked = [(int(joint), 0.6 * size * rng.normal(size=3) / np.sqrt(3)) for joint in rng.integers(1, count, 15)]
    best = []
    for _ in range(6):
        spent = []
        for joint, way in asked:
            start = thread_time()
            drag(parents, pose, joint, places[joint] + way, (0,))
            spent.append(thread_time() - start)
        best.append(np.median(spent))
    return 1000 * min(best[1:])
