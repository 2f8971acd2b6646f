"""Feet of a skeleton stand in their contacts, and no bone stretches."""

from dataclasses import replace

import numpy as np

from mocap.analogy.feet import standing


def skating(stroll):
    """A walk whose hips drift aside, and each foot's steps: where it is lowest."""
    motion = stroll(seconds=3.0, turning=0.0)
    drift = motion.translation.copy()
    drift[:, 0] += np.linspace(0, 0.4, len(motion))[:, None] * [1, 0, 0]
    feet = [motion.skeleton.names.index(f"{side} foot") for side in ("left", "right")]
    heights = motion.positions()[:, feet, 1]
    return replace(motion, translation=drift), feet, heights < heights.min(axis=0) + 0.02


def skate(places, contacts):
    """Metres that feet slide in their contacts."""
    both = contacts[1:] & contacts[:-1]
    return (np.linalg.norm(np.diff(places, axis=0), axis=-1) * both).sum()


def test_feet_stand_in_their_contacts(stroll):
    motion, feet, contacts = skating(stroll)
    after = standing(motion, feet, contacts)
    before = skate(motion.positions()[:, feet], contacts)
    assert before > 0.3 and skate(after.positions()[:, feet], contacts) < 0.01 * before


def test_bones_keep_their_lengths_and_the_head_hardly_moves(stroll):
    motion, feet, contacts = skating(stroll)
    after = standing(motion, feet, contacts)
    np.testing.assert_array_equal(after.translation[:, 1:], motion.translation[:, 1:])
    head = motion.skeleton.names.index("head")
    shift = after.positions()[:, head] - motion.positions()[:, head]
    assert np.abs(shift).max() < 0.06 and np.abs(np.diff(shift, 2, axis=0)).max() < 0.004


def test_without_contacts_nothing_changes(stroll):
    motion, feet, contacts = skating(stroll)
    assert standing(motion, feet, np.zeros_like(contacts)) is motion
