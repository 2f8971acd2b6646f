"""Analogies of real motion capture: the laws, the paper's four experiments, other skeletons; sheets to look at."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from capture.pictures import overlay
from capture.pictures.encode import write_picture
from mocap import sticks
from mocap.analogy import curves as curving
from mocap.analogy import experiments, styles
from mocap.analogy.analogy import Knobs, analogy
from mocap.skeletons.bvh import read_bvh
from mocap.skeletons.skeleton import SkeletonMotion
from mocap.skeletons.units import upright

PAIRS = [
    ("bandai1_walk_normal", "bandai1_walk_tired"),
    ("bandai1_walk_tired", "bandai1_walk_normal"),
    ("bandai1_walk_normal", "bandai1_kick"),
    ("bandai1_kick", "bandai1_walk_tired"),
    ("cmu21_walk", "cmu21_kick"),
    ("cmu21_kick", "cmu21_dance"),
    ("cmu21_dance", "cmu21_walk"),
    ("cmu21_swim", "cmu21_kick"),
    ("ad_fair1_wave_hello", "ad_fair1_jumping"),
    ("cmu21_walk", "cmu21_dance"),
]


@pytest.fixture(scope="module")
def read(data: Path):
    """Reads a motion by its name, upright and in metres."""
    return cache(lambda name: upright(read_bvh(data / "bvh" / f"{name}.bvh")))


@pytest.mark.parametrize(("first", "second"), PAIRS)
def test_b_that_is_a_becomes_a2(read, first: str, second: str):
    """rms over joints at most 2 degrees, timing within a frame; A' at A's frame rate, on A's skeleton."""
    from mocap.analogy.lend import lent

    one, two = read(first), read(second)
    made = analogy(one, two, one, Knobs(slope=4))
    asked = lent(two, one)[0]
    told, start = curving.of_skeleton(asked)
    goal = curving.to_skeleton(curving.at_rate(told, one.fps), start, asked)
    print(f"\n{first} -> {second}: {experiments.apart(made, goal):.2f} deg, {len(made)} frames for {len(goal)}")
    assert abs(len(made) - len(goal)) <= 1
    assert experiments.apart(made, goal) <= 2.0


@pytest.mark.parametrize(("first", "second"), PAIRS)
def test_what_was_not_changed_changes_nothing(read, first: str, second: str):
    one, three = read(first), read(second)
    made = analogy(one, one, three, Knobs(slope=4))
    assert len(made) == len(three)
    assert experiments.apart(made, three) <= 0.5
    np.testing.assert_allclose(made.positions(), three.positions(), atol=0.02)


def test_style_walk_is_to_run_as_tired_walk_is_to_tired_run(read, sheets: Path):
    walk, run, tired = (read(f"bandai1_{name}") for name in ("walk_normal", "run_normal", "walk_tired"))
    found = experiments.style(walk, run, tired)
    cards = _told("style, walk : run :: tired walk : ?", found, sheets)
    tempo = cards["B"].seconds / cards["B'"].seconds
    assert tempo == pytest.approx(1.07 / 0.77, rel=0.04)  # the seconds of a walk's and a run's two steps
    assert _speed(found.made) > 1.5 * _speed(tired)
    assert _bend(found.made) > _bend(run) + 0.1  # still tired: its back is bent


def test_content_crouching_is_to_crouching_aside_as_walking_is_to_walking_aside(read, sheets: Path):
    crouch = styles.crouched(read("bandai1_walk_normal"))
    walk = read("bandai1_walk_tired")
    found = experiments.content(crouch, styles.aside(crouch), walk)
    _told("content, crouch : crouch aside :: tired walk : ?", found, sheets)
    ahead, aside = _ways(found.made)
    assert abs(ahead) < 0.15 * _ways(walk)[0] and aside == pytest.approx(0.5 * _ways(walk)[0], rel=0.3)
    height = [motion.positions()[:, curving.hips(motion), 1].mean() for motion in (crouch, walk, found.made)]
    assert height[0] < height[1] - 0.1 and height[2] == pytest.approx(height[1], abs=0.05)  # it does not crouch


@pytest.mark.parametrize(
    ("walk", "other"), [("cmu_12_01_walk", "cmu21_dance"), ("bandai1_walk_normal", "bandai1_kick")]
)
def test_rhythm_slow_is_to_fast_as_another_motion_is_to_the_same_faster(read, sheets: Path, walk: str, other: str):
    plain, three = read(walk), read(other)
    found = experiments.rhythm(styles.sped(plain, 1 / 1.3), styles.sped(plain, 1.3), three)
    cards = _told(f"rhythm, slow : fast {walk} :: {other} : ?", found, sheets)
    assert cards["B'"].seconds == pytest.approx(cards["B"].seconds / 1.3**2, rel=0.02)


@pytest.mark.parametrize("other", ["bandai1_walk_tired", "ad_fair1_zombie"])
def test_several_features_of_a_drunk_walk_for_another(read, sheets: Path, other: str):
    """Style, speed and path; the zombie is on another skeleton, and keeps its arms stretched out."""
    walk, three = read("bandai1_walk_normal"), read(other)
    found = experiments.features(walk, styles.drunk(walk), three)
    cards = _told(f"features, walk : drunk walk :: {other} : ?", found, sheets)
    assert cards["B'"].seconds == pytest.approx(1.25 * cards["B"].seconds, rel=0.05)
    assert _sway(found.made) > 1.4 * _sway(three)


def test_a_captures_tempo_and_lean_go_onto_a_skeleton_of_other_names(read, sheets: Path):
    """Bandai's walk : tired walk :: CMU's walk : ?"""
    walk, tired, other = read("bandai1_walk_normal"), read("bandai1_walk_tired"), read("cmu21_walk")
    found = experiments.style(walk, tired, other)
    _told("onto another skeleton, walk : tired walk :: cmu21 walk : ?", found, sheets)
    assert _bend(found.made) > _bend(other) + 0.05
    assert _speed(found.made) < 0.95 * _speed(other)


def test_half_a_style_lies_between(read):
    walk, tired = read("bandai1_walk_normal"), read("bandai1_walk_tired")
    bends = [_bend(analogy(walk, tired, walk, Knobs(style=style))) for style in (0.0, 0.5, 1.0)]
    assert bends[0] == pytest.approx(_bend(walk), abs=0.02) and bends[2] == pytest.approx(_bend(tired), abs=0.02)
    assert bends[1] == pytest.approx((bends[0] + bends[2]) / 2, abs=0.1)


def _told(title: str, found: experiments.Experiment, sheets: Path) -> dict[str, experiments.Card]:
    """Print the cards, leave a sheet, and hold what holds for every experiment: the feet, the jerk, the joints."""
    cards = found.cards()
    print("", title, *(f"  {name:<15}{card}" for name, card in cards.items()), sep="\n")
    rows = [picture for motion in (found.one, found.two, found.three, found.made) for picture in _row(motion)]
    name = "analogy_" + "".join(c if c.isalnum() else "_" for c in title.replace(" : ?", ""))
    write_picture(sheets / f"{name}.png", overlay.contact_sheet(rows, columns=12, width=130))
    assert cards["B'"].skate <= 1.02 * cards["B"].skate
    assert cards["B'"].jerk <= 6 * max(cards[name].jerk for name in ("A", "A'", "B"))
    assert cards["B'"].beyond < 25
    return cards


def _row(motion: SkeletonMotion) -> list[np.ndarray]:
    above = motion.skeleton.path(curving.hips(motion))[:-1]
    shown = [joint for joint in range(len(motion.skeleton)) if joint not in above]
    parents = tuple(
        shown.index(motion.skeleton.parents[k]) if motion.skeleton.parents[k] in shown else -1 for k in shown
    )
    first = min(len(motion) // 3, max(len(motion) - round(1.5 * motion.fps), 0))
    frames = np.linspace(first, min(len(motion) - 1, first + 1.5 * motion.fps), 12).round().astype(int)
    places = replace(motion, translation=motion.translation[frames], rotation=motion.rotation[frames]).positions()
    view = sticks.view_of(places[:, shown], (200, 220), turn=0.9)
    names = tuple(motion.skeleton.names[k] for k in shown)
    return list(sticks.draw(places[:, shown], parents, view, 0.035, sticks.sides(names)))


def _speed(motion: SkeletonMotion) -> float:
    """Metres a second along the way."""
    way = motion.positions()[:, curving.hips(motion)][:, [0, 2]]
    return float(np.linalg.norm(np.diff(way, axis=0), axis=1).mean() * motion.fps)


def _ways(motion: SkeletonMotion) -> tuple[float, float]:
    """Metres a second ahead and to its left, by where its hips face."""
    front = styles.facing(motion)[:-1]
    way = np.diff(motion.positions()[:, curving.hips(motion)], axis=0) * motion.fps
    return float((way * front).sum(axis=1).mean()), float((way * (front[:, [2, 1, 0]] * [1, 0, -1])).sum(axis=1).mean())


def _bend(motion: SkeletonMotion) -> float:
    """How far the head is ahead of the hips, as a share of its height over them."""
    names = [name.lower() for name in motion.skeleton.names]
    back = motion.positions()[:, names.index("head")] - motion.positions()[:, curving.hips(motion)]
    return float(((back * styles.facing(motion)).sum(axis=1) / back[:, 1]).mean())


def _sway(motion: SkeletonMotion) -> float:
    """How much the head goes to and fro over the hips, across where it faces: a share of its height over them."""
    names = [name.lower() for name in motion.skeleton.names]
    back = motion.positions()[:, names.index("head")] - motion.positions()[:, curving.hips(motion)]
    left = styles.facing(motion)[:, [2, 1, 0]] * [1, 0, -1]
    return float(((back * left).sum(axis=1) / back[:, 1]).std())
