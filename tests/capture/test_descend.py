"""What pictures say of many drawings at once, against OpenCV's sampling, true maps and honest error bars."""

import numpy as np
import pytest

from capture.fit.pixels import layer
from capture.fit.pixels import model as models
from capture.fit.whole import descend as descent
from capture.fit.whole.course import Course, course_of, placed_of
from capture.fit.whole.descend import descend
from capture.fit.whole.stack import stacks
from capture.motion.tracks import CartoonMotion, track_of
from capture.pictures.clip import clip_of
from fixtures import ball, maps, write

pytest.importorskip("torch", reason="refining needs the extra torch")
pytest.importorskip("kornia", reason="refining needs the extra torch")

FRAMES = 6


def test_pictures_are_sampled_as_opencv_does_and_pixel_0_0_is_a_centre():
    import torch

    rng = np.random.default_rng(4)
    picture = rng.uniform(0, 255, (23, 31, 4)).astype(np.float32)
    points = np.vstack([[[0, 0], [30, 22], [12, 7]], rng.uniform(-3, 34, (200, 2))])
    ours = descent._sampled(torch.tensor(picture.transpose(2, 0, 1)[None]), torch.tensor(points[None]))[0].numpy()
    assert np.allclose(ours[:3], picture[[0, 22, 7], [0, 30, 12]], atol=1e-2)
    assert np.allclose(ours, layer.sample(picture, points.astype(np.float32), np.zeros(4)), atol=0.02)


@pytest.fixture(scope="module")
def learnt():
    """The ball's model and its true motion as a captured one."""
    toon = ball.ball()
    clip, part = clip_of(np.stack([toon.frame(t) for t in range(FRAMES)])), toon.parts[0]
    model = models.learn(write.shot_of(toon).parts[0], clip)
    placed = maps.plain(part.affine[:FRAMES], part.pivot)
    track = track_of("ball", model.keyset, placed, np.ones((FRAMES, 1)), np.zeros(FRAMES))
    return model, CartoonMotion((track,), (model.keyset,), np.arange(FRAMES) / 24, 24.0, toon.size), part


def looks(model, motion, noise: float, off: np.ndarray):
    toon = ball.ball(noise=noise)
    clip = clip_of(np.stack([toon.frame(t) for t in range(FRAMES)]))
    course = course_of(motion, model)
    for stack in stacks(model, clip, course, 0, lambda frame: []):
        yield descend(model, stack, course.unknowns[stack.numbers] + off, 0, "cpu")


def test_unknowns_and_maps_are_the_same_thing(learnt):
    model, motion, part = learnt
    placed, alpha = placed_of(course_of(motion, model).unknowns, model)
    assert np.allclose(placed, maps.plain(part.affine[:FRAMES], part.pivot))
    assert alpha.shape == (FRAMES, 0)


def test_the_balls_drawings_are_found_together_from_some_pixels_off(learnt):
    model, motion, part = learnt
    (look,) = looks(model, motion, 0.0, np.array([1.5, -1, 1, 1.5, 3, -3.0]))
    outlines = np.stack([models.outline_at(model, *pose) for pose in zip(*placed_of(look.at, model))])
    off = np.linalg.norm(outlines[:, : part.points.shape[1]] - part.points[:FRAMES], axis=-1)
    assert np.median(off, axis=1).max() < 0.1
    assert look.found.min() > 0.8  # a picture sampled between its pixels is a little softer than the key


def test_the_pictures_say_rightly_how_firmly_they_hold_a_drawing(learnt):
    """Under noise the found poses scatter as the information says: the error bars are neither boast nor modesty."""
    model, motion, _ = learnt
    still, noisy = (next(looks(model, motion, noise, np.zeros(6))) for noise in (0.0, 10.0))
    scatter = noisy.at - still.at
    expected = np.linalg.inv(noisy.information)
    told = np.einsum("gi,gij,gj->g", scatter, np.linalg.inv(expected), scatter) / 6
    print(f"\nscatter over what is told: {np.sqrt(told.mean()):.2f}")
    assert 0.7 < np.sqrt(told.mean()) < 1.5


def test_an_empty_picture_says_nothing(learnt):
    model, motion, _ = learnt
    clip = clip_of(np.tile(ball.ball().background, (FRAMES, 1, 1, 1)))
    course = course_of(motion, model)
    (stack,) = stacks(model, clip, course, 0, lambda frame: [])
    look = descend(model, stack, course.unknowns, 0, "cpu")
    assert look.found.max() < 0.05
    assert np.abs(look.at - course.unknowns).max() < 1


def test_what_is_covered_says_nothing(learnt):
    model, motion, part = learnt
    clip, course = clip_of(np.stack([ball.ball().frame(t) for t in range(FRAMES)])), course_of(motion, model)
    outlines = part.points
    (bare,) = (descend(model, s, course.unknowns, 0, "cpu") for s in stacks(model, clip, course, 0, lambda t: []))
    over = lambda t: [outlines[t] * (0.5, 1) + outlines[t].mean(axis=0) * (0.5, 0) + (30, 0)]  # noqa: E731
    (half,) = (descend(model, s, course.unknowns, 0, "cpu") for s in stacks(model, clip, course, 0, over))
    assert (half.found < 0.9 * bare.found).all()
    whole = lambda t: [(outlines[t] - outlines[t].mean(axis=0)) * 1.4 + outlines[t].mean(axis=0)]  # noqa: E731
    (none,) = (descend(model, s, course.unknowns, 0, "cpu") for s in stacks(model, clip, course, 0, whole))
    assert none.found.max() < 0.05


def test_a_course_counts_held_frames_as_one_drawing():
    course = Course(np.array([0, 3, 4]), np.array([3, 1, 2]), np.zeros((3, 6)), np.ones(3, bool), np.zeros(3))
    assert course.drawing.tolist() == [0, 0, 0, 1, 2, 2]
    assert course.middle.tolist() == [1, 3, 4.5]
