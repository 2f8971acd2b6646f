"""Captured skeletons, a fox and children's drawings dance; the sheets are for a person to see, a row a dancer."""

import numpy as np
import pytest

from capture.pictures.decode import read_clip
from capture.pictures.encode import write_picture
from mocap import sticks
from mocap.body import find_body
from mocap.posing import beats
from mocap.posing.choreography import unrolled
from mocap.posing.dance import danced
from mocap.posing.invent import invented
from mocap.posing.postures import posed
from mocap.posing.starting import kind_of, starting_pool
from retarget import cli
from retarget.characters.dancer import read_dancer

MUSIC = beats.steady(112, 16 * 60 / 112)


def _dance(dancer, seed=4):
    pool = starting_pool(dancer.skeleton, dancer.rest)
    dance = invented(pool, dancer.skeleton, 16, seed, dancer.rest)
    return dance, danced(dancer.skeleton, pool, dance, MUSIC, rest=dancer.rest)


def test_every_captured_skeleton_dances_on_its_feet(data, sheets):
    rows = []
    for path in sorted((data / "bvh").glob("*.bvh")):
        dancer = read_dancer(str(path))
        skeleton = dancer.skeleton
        assert kind_of(skeleton, dancer.rest) == "human", path.name
        dance, motion = _dance(dancer)
        places = motion.positions()
        body = find_body(skeleton, posed(skeleton, np.zeros((1, len(skeleton), 3)), 1.0, dancer.rest).positions())
        feet, tall = places[:, list(body.feet), 1], np.ptp(places[0, :, 1])
        on = np.rint(MUSIC.at(np.unique([step.beat for step in unrolled(dance, 15)])) * 24).astype(int)
        assert np.abs(feet[on].min(axis=1)).max() < 0.03 * tall, path.name  # the lowest foot is on the floor
        assert np.isfinite(places).all() and np.ptp(places, axis=0).max() > 0.25 * tall
        view = sticks.view_of(places, (150, 170), 0.45, follow=False)
        still = sticks.View(view.size, view.scale, view.middle[:1], view.turn)
        frames = np.rint(MUSIC.at(np.arange(8)) * 24).astype(int)
        colors, thick = sticks.sides(skeleton.names), 0.017 * tall
        rows.append(np.hstack(list(sticks.draw(places[frames], skeleton.parents, still, thick, colors))))
    write_picture(sheets / "danced_skeletons.png", np.vstack(rows))


@pytest.mark.parametrize("who", ["fox", "char1", "char2", "char3"])
def test_a_fox_and_drawings_dance_in_a_film(data, sheets, tmp_path, who):
    fox, drawing = data / "meshes" / "Fox.glb", data / "drawings" / "animated_drawings" / who
    given = ["--skeleton", str(fox)] if who == "fox" else ["--drawing", str(drawing), "--seed", "7"]
    film = tmp_path / "film.gif"
    assert cli.main(["mocap", "dance", "--beats", "8", "--rate", "12", "--size", "240", "-o", str(film), *given]) == 0
    clip = read_clip(film)
    assert len(clip) == 48
    frames = [clip[t] for t in range(0, 48, 3)]
    write_picture(sheets / f"danced_{who}.png", np.vstack([np.hstack(frames[:8]), np.hstack(frames[8:])]))
    assert np.abs(frames[0].astype(int) - frames[4].astype(int)).max() > 100


def test_a_fox_keeps_its_legs_on_the_ground(data):
    dancer = read_dancer(str(data / "meshes" / "Fox.glb"))
    assert kind_of(dancer.skeleton, dancer.rest) == "quadruped"
    _, motion = _dance(dancer)
    feet = find_body(dancer.skeleton).feet
    places = motion.positions()[:, list(feet)]
    assert places[..., 1].min() > -0.05 * np.ptp(motion.positions()[0, :, 1])
