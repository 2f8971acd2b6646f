"""Gradients told in the words of vector formats colour every point as they did."""

import numpy as np
import pytest

from capture.motion import affine
from retarget.characters.drawings.paths import Gradient
from retarget.export.gradients import finer, line_of, padded, round_of

RNG = np.random.default_rng(11)
OFFSETS = np.array([0.1, 0.4, 1.0])
COLORS = np.array([[1, 0, 0, 1], [0, 1, 0, 0.5], [0, 0.2, 1, 0]], float)


def places(frames=6):
    """Maps that turn, shear and stretch."""
    maps = []
    for t in np.linspace(0, 1, frames):
        c, s = np.cos(5 * t), np.sin(5 * t)
        linear = np.array([[c, -s], [s, c]]) @ [[30 + 20 * t, 12 * t], [0, 40 - 25 * t]]
        maps.append(np.column_stack([linear, [100 + 10 * t, 80]]))
    return maps


def seen(gradient, t):
    """Colours (n, 4) at gradient parameters t (n,)."""
    if gradient.spread == "repeat":
        t = t % 1
    if gradient.spread == "reflect":
        t = np.abs((t + 1) % 2 - 1)
    return np.stack([np.interp(t, gradient.offsets, channel) for channel in gradient.colors.T], axis=-1)


def parameters(gradient, points):
    """t at points (n, 2) of the page, for a gradient that is linear or whose focus is its middle."""
    own = affine.apply(affine.invert(gradient.place), points)
    return own[:, 0] if gradient.focus is None else np.linalg.norm(own, axis=1)


def test_a_line_has_the_same_stripes_as_a_sheared_gradient():
    points = RNG.uniform(0, 200, (50, 2))
    for place in places():
        gradient = Gradient(OFFSETS, COLORS, place)
        start, end = line_of(gradient)
        along = (points - start) @ (end - start) / ((end - start) @ (end - start))
        np.testing.assert_allclose(along, parameters(gradient, points), atol=1e-9)


def test_a_circle_turned_and_stretched_is_the_oval_and_keeps_its_focus():
    gradients = [Gradient(OFFSETS, COLORS, place, focus=np.array([0.3, -0.5])) for place in places(40)]
    way = round_of(gradients)
    points = RNG.uniform(0, 200, (40, 30, 2))
    wanted = [parameters(gradient, here) for gradient, here in zip(gradients, points, strict=True)]
    np.testing.assert_allclose(np.linalg.norm(way.inside(points), axis=-1), wanted, atol=1e-9)
    foci = [affine.apply(gradient.place, gradient.focus[None]) for gradient in gradients]
    np.testing.assert_allclose(way.inside(np.array(foci))[:, 0], way.focus, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(way.focus, axis=1), np.hypot(0.3, 0.5), atol=1e-9)
    assert np.abs(np.diff(way.angle)).max() < 0.3  # a slow turn is a slow turn


@pytest.mark.parametrize("spread", ["pad", "repeat", "reflect"])
@pytest.mark.parametrize("focus", [None, np.zeros(2)])
def test_a_spread_written_out_colours_every_point_as_before(spread, focus):
    gradients = [Gradient(OFFSETS, COLORS, place, focus, spread) for place in places()]
    points = RNG.uniform(0, 160, (len(gradients), 200, 2))
    plain = padded(gradients, points)
    assert len({len(gradient.offsets) for gradient in plain}) == 1
    for before, after, here in zip(gradients, plain, points, strict=True):
        assert after.spread == "pad" and (np.diff(after.offsets) >= 0).all()
        t = parameters(before, here)
        edge = np.abs(t - np.round(t)) < 1e-6
        np.testing.assert_allclose(
            seen(after, parameters(after, here))[~edge], seen(before, t)[~edge], atol=1e-6, err_msg=spread
        )


def test_more_stops_are_the_same_gradient_and_a_solid_one_gets_none():
    fading = [Gradient(OFFSETS, COLORS, place) for place in places(2)]
    t = np.linspace(-0.2, 1.2, 300)
    for before, after in zip(fading, finer(fading), strict=True):
        assert len(after.offsets) == 17
        np.testing.assert_allclose(seen(after, t), seen(before, t), atol=1e-9)
        # what players show that multiply by alpha before they mix, against those that do it after
        first = [np.interp(t, after.offsets, channel) for channel in (after.colors[:, :3] * after.colors[:, 3:]).T]
        last = seen(after, t)[:, :3] * seen(after, t)[:, 3:]
        assert np.abs(np.stack(first, axis=-1) - last).max() < 1 / 255
    solid = [Gradient(OFFSETS, COLORS * [1, 1, 1, 0] + [0, 0, 0, 1], places(1)[0])]
    assert len(finer(solid)[0].offsets) == 3
