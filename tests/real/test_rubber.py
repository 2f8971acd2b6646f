"""Real motion capture made rubber: limbs are found on every skeleton, feet stand, nothing trembles or flips."""

from pathlib import Path

import numpy as np
import pytest

from capture.pictures.encode import write_picture
from mocap import sticks
from mocap.bvh import read_bvh
from mocap.report import report
from mocap.rubber import rubber, subjoints
from mocap.skeleton import SkeletonMotion
from mocap.units import upright

TIPS = ("hand", "wrist", "foot", "ankle")


def test_wrists_and_ankles_are_the_tips_of_four_limbs_on_every_skeleton(data: Path):
    for path in sorted((data / "bvh").glob("*.bvh")):
        skeleton = rubber.rooted(read_bvh(path)).skeleton
        tips = [skeleton.names[group[-1]].lower() for group in subjoints.rubber_groups(skeleton)]
        limbs = [tip for tip in tips if any(word in tip for word in TIPS)]
        assert len(limbs) == 4, f"{path.name}: {tips}"
        assert all("head" in tip for tip in tips if tip not in limbs), f"{path.name}: {tips}"


def test_a_kick_exaggerated_five_times_neither_skates_nor_trembles(data: Path):
    motion = upright(read_bvh(data / "bvh" / "cmu21_kick.bvh"))
    made = rubber.make_rubber(motion, omega=5, sigma=0.15)
    card = report(motion, made)
    print(f"\nkick: skate {card.skate:.1f} cm/s (captured {card.skate_before:.1f}), jerk {card.jerk:.2f}")
    assert card.skate <= card.skate_before + 2 and card.kept > 0.95
    assert card.jerk <= 1.5
    np.testing.assert_allclose([card.volume[0], card.volume[1]], 1, atol=0.05)


@pytest.mark.parametrize("follow", [0.0, 0.5])
def test_no_joint_turns_much_further_in_a_frame_than_it_was_captured_to(data: Path, follow):
    """A flip is half a turn within a frame; in the cusp of an arm that is folded and swings, 60 degrees were seen."""
    for path in sorted((data / "bvh").glob("*.bvh")):
        made = rubber.make_rubber(upright(read_bvh(path)), follow=follow)
        first = int(rubber.posed_first(made.source))
        _, captured = rubber.joints_of(made.source)
        before = _steps(captured[first:])
        parents = np.array(made.source.skeleton.parents)
        before = np.maximum(before, np.where(parents >= 0, before[:, parents], 0))
        further = _steps(made.rotation[first:]) - before[:, made.subjoints.joint]
        assert further.max() < 70, f"{path.name}: {further.max():.0f} degrees"


def test_contact_sheets_are_left_to_look_at(data: Path, sheets: Path):
    for name, first, last, turn in (("cmu21_kick", 150, 240, 0.9), ("ad_rokoko_jesse_dance", 380, 470, 0.4)):
        motion = upright(read_bvh(data / "bvh" / f"{name}.bvh"))
        write_picture(sheets / f"rubber_{name}.png", _sheet(motion, np.linspace(first, last, 8).astype(int), turn))


def _steps(rotation):
    """How far quaternions (T, N, 4) turn from frame to frame, degrees."""
    return np.degrees(2 * np.arccos(np.abs(np.einsum("tni,tni->tn", rotation[1:], rotation[:-1])).clip(max=1)))


def _sheet(motion: SkeletonMotion, frames, turn):
    """Rows: as captured, as much as is right, five times; each frame seen from the same side."""
    figures = [rubber.plain(motion), *(rubber.make_rubber(motion, omega, follow=0.5) for omega in (None, 5))]
    view = sticks.view_of(
        np.concatenate([it.positions[frames] for it in figures], axis=1), (220, 240), turn, margin=0.05
    )
    joints = figures[0].subjoints
    colors = sticks.sides(tuple(joints.skeleton.names[joint] for joint in joints.joint))
    thick = np.clip(0.13 * joints.skeleton.lengths()[joints.joint], 0.012, 0.055)
    ground = float(np.quantile(figures[0].positions[..., 1].min(axis=1), 0.05))
    rows = []
    for it in figures:
        pictures = sticks.draw(it.positions[frames], joints.parents, view, thick * it.thickness[frames], colors, ground)
        rows.append(np.concatenate(list(pictures), axis=1))
    return np.concatenate(rows)
