"""Where else a part may be: the places that a search proposes."""

import numpy as np
import pytest

from capture.fit.pixels import cover, search
from capture.fit.pixels import model as models
from capture.fit.pixels.descend import Evidence, evidence, worth
from capture.fit.pixels.sighting import Pose, is_sane, outline
from capture.pictures.clip import clip_of
from capture.pictures.shot import KeyDrawing, Part
from fixtures import ball, maps

NONE = np.zeros(0)


@pytest.fixture(scope="module")
def toon():
    return ball.ball(busy=True)


@pytest.fixture(scope="module")
def model(toon):
    key = KeyDrawing("round", 0, tuple(map(tuple, toon.parts[0].points[0].tolist())))
    return models.learn(Part("ball", (key,)), clip_of(toon.frame(0)[None]))


def far_off(model) -> Pose:
    return Pose(maps.place(maps.turn(2.0), (78, 250), (560, 60)), NONE)


@pytest.mark.parametrize("t", [15, 30, 45, 60])
def test_one_of_the_proposed_starts_is_near_the_part_wherever_it_is(toon, model, t):
    found = search.starts(toon.frame(t), np.zeros((480, 640), np.uint8), model, model.colors, [far_off(model)])
    true = toon.parts[0].points[t].mean(axis=0)
    gaps = [np.linalg.norm(outline(model, pose).mean(axis=0) - true) for pose in found]
    assert len(found) <= 3 and min(gaps) < 30  # pixels: a third of its size, from where a descent finds home


def test_the_same_picture_gives_the_same_starts(toon, model):
    calls = [
        search.starts(toon.frame(20), np.zeros((480, 640), np.uint8), model, model.colors, [far_off(model)])
        for _ in range(2)
    ]
    for one, other in zip(*calls):
        assert np.array_equal(one.placed, other.placed)


def test_only_the_true_pose_scores_well(toon, model):
    """Mirrored it fits less well, however round it is; collapsed, out of the picture or in an empty place, not at all."""
    image = toon.frame(0)
    whole = search.whole_picture(image, np.zeros((480, 640), np.uint8), model, model.colors)
    middle = toon.parts[0].points[0].mean(axis=0)
    wrong = {
        "mirrored": maps.place(np.diag([-1.0, 1.0]), middle, middle),
        "collapsed": maps.place(np.diag([0.05, 0.05]), middle, middle),
        "a line": maps.place(np.diag([1.0, 0.05]), middle, middle),
        "outside": maps.place(np.eye(2), middle, (-300, -300)),
        "empty": maps.place(np.eye(2), middle, (330, 60)),
    }
    placed = np.stack([np.eye(2, 3), *wrong.values()])
    score = search.scores(model, whole, placed, NONE, len(whole.levels) - 2)
    assert score[0] > 0.9
    assert score[1] < score[0] - 0.1
    assert (score[2:] < 0.4).all()


def test_a_hidden_place_is_worth_nothing(toon, model):
    hidden = np.ones((480, 640), np.uint8)
    whole = search.whole_picture(toon.frame(0), hidden, model, model.colors)
    assert search.scores(model, whole, np.eye(2, 3)[None], NONE, 2) == pytest.approx(0)


def test_evidence_is_all_for_the_part_and_nothing_for_an_empty_place(toon, model):
    image, hidden = toon.frame(0), np.zeros((480, 640), np.uint8)
    pose = Pose(np.eye(2, 3), NONE)
    for picture, least, most in ((image, 0.95, 1.0), (toon.background, -1.0, 0.05)):
        cut = cover.cutout(picture, hidden, [], model.colors, model, pose, 64)
        seen = evidence(model, cover.as_layer(model.view, cut), pose)
        assert seen.known == 1 and least <= seen.shown <= most


def test_evidence_counts_only_what_is_in_sight(toon, model):
    hidden = np.zeros((480, 640), np.uint8)
    hidden[:, : int(toon.parts[0].points[0].mean(axis=0)[0])] = 1
    pose = Pose(np.eye(2, 3), NONE)
    cut = cover.cutout(toon.frame(0), hidden, [], model.colors, model, pose, 64)
    seen = evidence(model, cover.as_layer(model.view, cut), pose)
    assert 0.35 < seen.known < 0.65 and seen.shown > 0.9


def test_what_disagrees_takes_from_a_fits_worth():
    assert worth(Pose(np.eye(2, 3), NONE, agreeing=0.5), Evidence(0.8, 1.0)) == pytest.approx(0.4)
    assert worth(Pose(np.eye(2, 3), NONE), Evidence(-0.8, 1.0)) == 0


@pytest.mark.parametrize(
    "linear", [np.diag([-1.0, 1.0]), np.diag([0.1, 0.1]), np.diag([3.0, 3.0]), np.diag([4.0, 0.3]), np.eye(2) * np.nan]
)
def test_degenerate_maps_are_known(model, linear):
    assert not is_sane(model, Pose(np.column_stack([linear, [0, 0]]), NONE))
    assert is_sane(model, Pose(maps.place(maps.turn(3.0), (0, 0), (40, 60)), NONE))
