"""Reading motion capture and finding where its joints are, against bvhio, which is right on all real files.

On the longest figure that can be drawn by formula; on the real files too where they are (TOONCAP_DATA).
"""

import os
import tempfile
import warnings
from pathlib import Path
from time import process_time

import numpy as np

from fixtures.skeletons import walk
from mocap.skeletons.bvh import read_bvh, write_bvh
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion

DATA = Path(os.environ.get("TOONCAP_DATA", Path(__file__).resolve().parents[3] / "shared" / "data")) / "bvh"
"""Where real files may be."""


def rows():
    """Milliseconds a frame of ours, and how many times longer bvhio takes for the same."""
    with tempfile.TemporaryDirectory() as folder:
        drawn = walk(seconds=20.0, fps=60.0)
        skeleton = Skeleton(drawn.names, drawn.parents, drawn.offsets)
        path = Path(folder) / "walk.bvh"
        write_bvh(SkeletonMotion(skeleton, drawn.translation, drawn.rotation, drawn.fps), path)
        found = {f"drawn_{name}": value for name, value in _against([path]).items()}
    real = sorted(DATA.glob("*.bvh"))
    return found | (_against(real) if real else {})


def _against(paths):
    ours = frames = theirs = 0.0
    for path in paths:
        ours += min(_timed(_read, path)[0] for _ in range(3))
        taken, count = _timed(_by_bvhio, path)
        theirs, frames = theirs + taken, frames + count
    return {"ms_per_frame": 1e3 * ours / frames, "ratio_to_bvhio": theirs / ours}


def _read(path):
    return len(read_bvh(path).positions())


def _by_bvhio(path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import bvhio
    root = bvhio.readAsHierarchy(str(path))
    joints = [joint for joint, _, _ in root.layout()]
    count = root.getKeyframeRange()[1] + 1
    places = np.empty((count, len(joints), 3))
    for frame in range(count):
        root.loadPose(frame)
        places[frame] = [tuple(joint.PositionWorld) for joint in joints]
    return count


def _timed(function, path):
    start = process_time()
    found = function(path)
    return process_time() - start, found
