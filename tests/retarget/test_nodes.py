"""Two nested nodes are the affine map, and their curves have no jumps."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from retarget.export import nodes


def moving(frames, shear=0.4, start=(1.0, 1.0), stop=(0.5, 1.6), turn=7.0):
    """Maps of the plane (T, 2, 3) that turn by more than a whole turn, squash and shear."""
    maps = []
    for t in np.linspace(0, 1, frames):
        c, s = np.cos(turn * t), np.sin(turn * t)
        stretch = np.diag((1 - t) * np.array(start) + t * np.array(stop))
        linear = np.array([[c, -s], [s, c]]) @ stretch @ np.array([[1, shear * np.sin(5 * t)], [0, 1]])
        maps.append(np.column_stack([linear, [30 * t, -20 * t**2]]))
    return np.array(maps)


def played(made, at):
    """What a player shows between frames: lerped travel and stretch, turns along the shortest way."""
    from scipy.spatial.transform import Slerp

    times = np.arange(len(made.scale))
    outer, inner = (Slerp(times, Rotation.from_quat(quats))(at).as_matrix() for quats in (made.rotation, made.inner))
    scale = np.stack([np.interp(at, times, values) for values in made.scale.T], axis=-1)
    return outer * scale[:, None] @ inner


@pytest.mark.parametrize("stop", [(0.5, 1.6), (-1.0, 1.0), (-0.3, -2.0), (1.0, 1.0), (0.0, 1.0)])
def test_two_nodes_make_the_map_again_with_shear_with_mirroring_and_flat(stop):
    maps = nodes.lifted(moving(60, stop=stop))
    np.testing.assert_allclose(nodes.nodes(maps).maps(), maps, atol=1e-6)


def test_maps_of_space_are_made_again():
    rng = np.random.default_rng(3)
    maps = rng.normal(size=(50, 3, 4))  # half of them mirror
    np.testing.assert_allclose(nodes.nodes(maps).maps(), maps, atol=1e-6)


@pytest.mark.parametrize("stop", [(0.5, 1.6), (1.0, 1.0), (1.6, 0.5), (-1.0, 1.0)])
def test_between_frames_the_nodes_stay_near_the_true_motion(stop):
    """A flip of an axis would show here as a collapse half-way between two frames."""
    fine = nodes.lifted(moving(481, stop=stop, start=(0.8, 1.2)))
    made = nodes.nodes(fine[::8])
    at = np.arange(60) + 0.5
    assert np.abs(played(made, at) - fine[4::8, :, :3]).max() < 0.02


def test_a_turn_without_shear_needs_one_node_only():
    made = nodes.nodes(nodes.lifted(moving(40, shear=0.0, stop=(1.0, 1.0))))
    np.testing.assert_allclose(made.inner, np.tile([0, 0, 0, 1.0], (40, 1)), atol=1e-6)
    np.testing.assert_allclose(made.scale, 1, atol=1e-6)
    squashed = nodes.nodes(nodes.lifted(moving(40, shear=0.0)))
    np.testing.assert_allclose(squashed.inner, np.tile([0, 0, 0, 1.0], (40, 1)), atol=1e-6)


def test_a_motion_in_the_plane_turns_about_the_viewing_axis_only():
    made = nodes.nodes(nodes.lifted(moving(80)))
    for quats in (made.rotation, made.inner):
        np.testing.assert_allclose(quats[:, :2], 0, atol=1e-9)
    np.testing.assert_allclose(made.scale[:, 2], 1, atol=1e-9)


def test_a_shape_that_is_squashed_and_then_stretched_keeps_its_axes():
    """Where the stretch passes through none, any axes would do; the curves must not notice."""
    t = np.linspace(-0.3, 0.3, 41)
    lean = np.array([[np.cos(0.5), -np.sin(0.5)], [np.sin(0.5), np.cos(0.5)]])
    maps = np.zeros((41, 2, 3))
    maps[:, :, :2] = [lean @ np.diag([1 + x, 1 - x]) @ lean.T for x in t]
    made = nodes.nodes(nodes.lifted(maps))
    assert np.abs(np.diff(made.scale, axis=0)).max() < 0.016  # the steps of t
    assert np.abs(np.diff(made.inner, axis=0)).max() < 1e-3
