"""What vector files are given: the performance's own drawings, stacked as formats stack them."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from capture.errors import InputError
from retarget.characters.drawings.drawing import read_drawing
from retarget.export.elements import kept, one_frame, page_of
from retarget.stage.perform import perform


def acting(by_hand, worm, order=(0, 0, 0, 0), visible=(1, 1, 1, 1)):
    """A worm and its twin: the worm's order is given, the twin's is 1."""
    egg = by_hand.motion(by_hand.tumble(4), [[1.0, 0]] * 4, order=np.array(order), visible=np.array(visible, bool))
    lid = by_hand.motion(by_hand.still(4), [[1.0, 0]] * 4, part="lid", order=np.ones(4, int))
    both = replace(egg, tracks=egg.tracks + lid.tracks, keysets=egg.keysets + lid.keysets)
    target = read_drawing("egg", by_hand.names, worm)
    return perform(both, [target, replace(target, part="lid")])


@pytest.mark.parametrize(
    ("order", "visible", "layers"),
    [
        ((0, 0, 0, 0), (1, 1, 1, 1), 2),
        ((0, 2, 2, 0), (1, 1, 0, 1), 4),
        ((2, 2, 2, 2), (0, 0, 0, 0), 1),
    ],
)
def test_layers_from_back_to_front_are_what_the_performance_draws(by_hand, worm, order, visible, layers):
    performance = acting(by_hand, worm, order, visible)
    page = page_of(performance)
    assert len(page.layers) == layers
    for t in range(4):
        shown = [element.drawn[t] for layer in page.layers if layer.visible[t] for element in layer.elements]
        ours = performance.posed(t)
        assert [path.name for path in shown] == [path.name for path in ours]
        for one, other in zip(shown, ours, strict=True):
            np.testing.assert_allclose(one.points, other.points + 0.5, atol=1e-9)  # from the page's corner


def test_one_frame_is_that_frame(by_hand, worm):
    performance = acting(by_hand, worm, (0, 2, 2, 0), (1, 1, 0, 1))
    for t in range(4):
        alone = one_frame(performance, t)
        assert len(alone.times) == 1
        for one, other in zip(alone.posed(0), performance.posed(t), strict=True):
            np.testing.assert_array_equal(one.points, other.points)


def test_a_page_twice_as_wide_is_twice_as_large(by_hand, worm):
    performance = acting(by_hand, worm)
    small, large = page_of(performance), page_of(performance, 640, "#fed")
    assert (small.size, large.size, large.background) == ((320, 240), (640, 480), "#ffeedd")
    for one, two in zip(small.layers[0].elements, large.layers[0].elements, strict=True):
        np.testing.assert_allclose(2 * one.drawn[1].points, two.drawn[1].points, atol=1e-9)
        assert two.drawn[1].width == pytest.approx(2 * one.drawn[1].width)
    with pytest.raises(InputError, match="at least 1 pixel"):
        page_of(performance, 0)


@given(st.lists(st.integers(0, 2), min_size=1, max_size=12))
def test_kept_values_are_enough_to_tell_the_others(values):
    """Stepped: the last key at or before a frame.  Smooth: the straight way between two keys, or after the last."""
    steps, ends = kept(values, stepped=True), kept(values, stepped=False)
    assert steps[0] == ends[0] == 0 and len(steps) <= len(ends)
    assert [values[max(key for key in steps if key <= t)] for t in range(len(values))] == values
    np.testing.assert_allclose(np.interp(range(len(values)), ends, [values[key] for key in ends]), values)
