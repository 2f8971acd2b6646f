"""Milliseconds a frame of the whole rubber chain: 2,700 frames of 31 joints, from turns to turned sub-joints.

The figure walks and swings its arms by formula; the paper's own programme took 5.8 to 12.8 ms a frame on its machine.
"""

from time import thread_time

import numpy as np

from mocap.rubber import rubber
from mocap.skeleton import Skeleton, SkeletonMotion

FRAMES, FPS = 2700, 120


def rows():
    """All of the chain, and without springs, and without feet that stand; and what turning sub-joints takes alone."""
    motion = _motion()
    feet = [motion.skeleton.names.index(f"leg {side} {n}") for side in "lr" for n in (3, 4)]
    left = (np.arange(FRAMES) // 60 % 2 == 0)[:, None]
    stands = np.concatenate([left, left, ~left, ~left], axis=1)
    made = rubber.make_rubber(motion)
    captured, turns = rubber.joints_of(made.source)
    return {
        "ms_per_frame": _best(lambda: rubber.make_rubber(motion, follow=0.5, feet=feet, contacts=stands)),
        "ms_per_frame_without_springs": _best(lambda: rubber.make_rubber(motion, feet=feet, contacts=stands)),
        "ms_per_frame_without_feet": _best(lambda: rubber.make_rubber(motion, feet=())),
        "ms_per_frame_turning": _best(
            lambda: rubber.finished(made.source, made.subjoints, made.positions, captured, turns)
        ),
        "sub_joints": len(made.subjoints),
    }


def _best(work):
    """Milliseconds a frame, the best of five runs after one that warms up."""
    work()
    times = []
    for _ in range(5):
        start = thread_time()
        work()
        times.append(thread_time() - start)
    return 1000 * min(times) / FRAMES


def _motion():
    from scipy.spatial.transform import Rotation

    chains = {  # from the joint they grow from: links in metres
        "leg l": ("root", [(0.09, -0.05, 0), (0, -0.42, 0), (0, -0.4, 0), (0, -0.06, 0.14), (0, 0, 0.07)]),
        "leg r": ("root", [(-0.09, -0.05, 0), (0, -0.42, 0), (0, -0.4, 0), (0, -0.06, 0.14), (0, 0, 0.07)]),
        "back": ("root", [(0, 0.11, 0), (0, 0.11, 0), (0, 0.12, 0), (0, 0.15, 0), (0, 0.1, 0), (0, 0.12, 0)]),
        "arm l": ("back 3", [(0.03, 0.1, 0), (0.14, 0, 0), (0.28, 0, 0), (0.25, 0, 0), (0.08, 0, 0), (0.05, 0, 0)]),
        "arm r": (
            "back 3",
            [(-0.03, 0.1, 0), (-0.14, 0, 0), (-0.28, 0, 0), (-0.25, 0, 0), (-0.08, 0, 0), (-0.05, 0, 0)],
        ),
        "thumb l": ("arm l 4", [(0.03, 0, 0.04)]),
        "thumb r": ("arm r 4", [(-0.03, 0, 0.04)]),
    }
    names, parents, offsets = ["root"], [-1], [(0, 0.95, 0)]
    for chain, (stem, links) in chains.items():
        for number, link in enumerate(links, 1):
            parents.append(names.index(stem if number == 1 else f"{chain} {number - 1}"))
            names.append(f"{chain} {number}")
            offsets.append(link)
    skeleton = Skeleton(tuple(names), tuple(parents), np.array(offsets, float))
    assert len(skeleton) == 31
    rng = np.random.default_rng(0)
    seconds = np.arange(FRAMES) / FPS
    phases, sizes = rng.uniform(0, 2 * np.pi, (31, 3)), 0.5 * rng.uniform(size=(31, 3))
    angles = sizes * np.sin(2 * np.pi * seconds[:, None, None] * np.array([0.9, 1.3, 2.1]) + phases)
    rotation = Rotation.from_rotvec(angles.reshape(-1, 3)).as_quat().reshape(FRAMES, 31, 4)
    translation = np.tile(skeleton.offsets, (FRAMES, 1, 1))
    translation[:, 0, 2] += 1.3 * seconds
    translation[:, 0, 1] += 0.03 * np.sin(11 * seconds)
    return SkeletonMotion(skeleton, translation, rotation, FPS)
