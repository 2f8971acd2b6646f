"""Boxing and kicking that is exaggerated five times still hits what was hit."""

from pathlib import Path

import numpy as np
import pytest

from capture.pictures.encode import write_picture
from mocap import sticks
from mocap.bodies.body import find_body
from mocap.rubber import hits, rubber
from mocap.skeletons.bvh import read_bvh
from mocap.skeletons.units import STATURE, stature, upright

SHOWN = 8


def blows_of(path: Path):
    if not path.is_file():
        pytest.skip(f"there is no {path}")
    motion = upright(read_bvh(path))
    places = motion.positions()
    body = find_body(motion.skeleton, places)
    scale = stature(motion, body) / STATURE
    return motion, places, hits.find_hits(places, body, motion.fps, scale)


@pytest.mark.parametrize(("name", "count", "limb"), [("cmu21_box-2", (25, 45), "hand"), ("cmu21_kick", (1, 1), "foot")])
def test_blows_are_met_to_a_tenth_of_a_millimetre(data: Path, name, count, limb):
    motion, places, blows = blows_of(data / "bvh" / f"{name}.bvh")
    assert count[0] <= len(blows) <= count[1]
    assert all(limb in motion.skeleton.names[joint].lower() for joint, _ in blows)
    free, made = (rubber.make_rubber(motion, 5, follow=0.5, apart=True, hits=it) for it in ((), blows))
    ends = made.subjoints.ends
    astray, off = (
        np.array([np.linalg.norm(it.positions[frame, ends[joint]] - places[frame, joint]) for joint, frame in blows])
        for it in (free, made)
    )
    print(
        f"\n{name}: {len(blows)} blows, {100 * np.median(astray):.0f} cm astray before, {1000 * off.max():.3f} mm now"
    )
    assert off.max() < 1e-4 and np.median(astray) > 0.05


@pytest.mark.parametrize("name", ["cmu21_walk", "cmu21_dance", "cmu_12_01_walk", "bandai1_run_normal", "cmu21_swim"])
def test_who_walks_runs_dances_or_swims_hits_nothing(data: Path, name):
    assert blows_of(data / "bvh" / f"{name}.bvh")[2] == ()


def test_a_sheet_of_a_punch_is_left_to_look_at(data: Path, sheets: Path):
    """As captured, exaggerated astray, and hitting: a cross marks what was hit."""
    motion, places, blows = blows_of(data / "bvh" / "cmu21_box-2.bvh")
    joint, hit = blows[3]
    shown = hit + np.arange(-32, 25, 8)
    figures = [
        rubber.plain(motion),
        *(rubber.make_rubber(motion, 5, follow=0.5, apart=True, hits=it) for it in ((), blows)),
    ]
    both = np.concatenate([it.positions[shown] for it in figures], axis=1)
    view = sticks.view_of(both, (220, 240), 0.9, follow=False, margin=0.05)
    parts = figures[0].subjoints
    colors = sticks.sides(tuple(parts.skeleton.names[joint] for joint in parts.joint))
    thick = np.clip(0.13 * parts.skeleton.lengths()[parts.joint], 0.012, 0.055)
    target = places[hit, joint] + 0.05 * np.array([[0, 0, 0], [0, 1, 0], [0, -1, 0], [1, 0, 0], [-1, 0, 0]])
    rows = []
    for it in figures:
        points = np.concatenate([it.positions[shown], np.tile(target, (len(shown), 1, 1))], axis=1)
        count = len(parts)
        parents = (*parts.parents, -1, count, count, count, count)
        radius = np.concatenate([thick * it.thickness[shown], np.full((len(shown), 5), 0.008)], axis=1)
        paint = np.concatenate([colors, np.tile([[20, 140, 60]], (5, 1))])
        rows.append(np.concatenate(list(sticks.draw(points, parents, view, radius, paint, 0.0)), axis=1))
    write_picture(sheets / "boxing_hits.png", np.concatenate(rows))
