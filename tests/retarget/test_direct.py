"""What a cast says of the staging happens: feet stay, legs bend, a path is gone, the pile is as told."""

import re
from dataclasses import replace

import numpy as np
import pytest

from capture.errors import InputError
from capture.motion import affine, keys, tracks
from capture.motion.tracks import CartoonMotion, track_of
from retarget.characters.casts.castfile import read_cast
from retarget.characters.casts.castlist import Cast, CastKeep, CastPart
from retarget.characters.drawings.drawing import outline_drawing
from retarget.commands.lending import retarget
from retarget.stage import staging
from retarget.stage.direct import direct
from retarget.stage.perform import perform

RED = np.array([1.0, 0, 0, 1])
FRAMES = 24
BODY = {  # what it hangs on, where, and its box
    "torso": ("", (100, 100), (85, 40, 115, 100)),
    "thigh": ("torso", (100, 100), (94, 95, 106, 155)),
    "shin": ("thigh", (100, 150), (95, 145, 105, 204)),
}


def skating(thigh=0.3, speed=3.0):
    """A figure that glides to the right, by pixels a frame, on a leg that is bent and does not move."""
    t = np.arange(FRAMES)
    found, sets = [], []
    for name, (parent, pivot, (x0, y0, x1, y1)) in BODY.items():
        source = keys.keyset(("rest",), np.array([[[x0, y0], [x1, y0], [x1, y1], [x0, y1]]], float), spacing=8)
        angle = {"thigh": -thigh, "shin": 2 * thigh}.get(name, 0.0)
        maps = np.tile([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0]], (FRAMES, 1, 1))
        maps[:, 0, 2] = speed * t if name == "torso" else 0
        pivot = np.array(pivot, float)
        weights, none = np.ones((FRAMES, 1)), np.zeros(FRAMES)
        found.append(
            track_of(
                name, source, affine.about(maps, pivot), weights, none, pivot=pivot, parent=parent, order=len(found)
            )
        )
        sets.append(source)
    return CartoonMotion(tuple(found), tuple(sets), t / 24, 24.0, (320, 240))


def played(motion):
    return perform(motion, [outline_drawing(name, motion.keyset(name), RED) for name in BODY])


def cast(*keep, **more):
    return Cast(tuple(CastPart(name, (), "a.svg") for name in BODY), keep=keep, ground=False, **more)


def mesh(performance, part):
    return staging.role_of(performance, part).mesh()


def nearest(motion, part, point):
    return int(np.linalg.norm(motion.keyset(part).points[0] - point, axis=1).argmin())


def test_a_shin_that_is_kept_bends_its_knee_and_the_torso_glides_on():
    motion = skating()
    before = played(motion)
    after, slid = direct(before, cast(CastKeep("shin", (8, 14), (95.0, 204.0))), motion)
    corner = mesh(after, "shin")[:, nearest(motion, "shin", (95, 204))]
    assert np.ptp(corner[8:15], axis=0).max() < 1e-9
    np.testing.assert_array_equal(mesh(after, "torso"), mesh(before, "torso"))
    assert slid.before == pytest.approx(18) and slid.after < 1e-6  # six frames of 3 pixels
    assert str(slid) == "feet slid by 18.0 px, now by 0.0"


def test_with_no_leg_to_bend_the_whole_figure_is_moved():
    motion = skating()
    before = played(motion)
    for keep in (CastKeep("shin", (8, 14), at=(150.0, 190.0), bend=()), CastKeep("torso", (8, 14), at=(150.0, 90.0))):
        after, _ = direct(before, cast(keep), motion)
        offsets = [mesh(after, part) - mesh(before, part) for part in BODY]
        for offset in offsets:
            np.testing.assert_allclose(offset, np.broadcast_to(offsets[0][:, :1], offset.shape), atol=1e-9)
        lowest = mesh(after, keep.part)[8:15]
        lowest = lowest[np.arange(7), lowest[..., 1].argmax(axis=1)]
        np.testing.assert_allclose(lowest[:, 1], keep.at[1], atol=3)  # a sole is a mean of what is low


def test_a_point_between_mesh_points_is_put_in_its_place():
    motion = skating()
    role = played(motion)
    after, _ = direct(role, cast(CastKeep("torso", (5, 6), (101.3, 71.7), (130.0, 80.0))), motion)
    source, shape = motion.keyset("torso"), mesh(after, "torso")[5]
    place = affine.apply(affine.fit(source.points[0], shape), np.array([[101.3, 71.7]]))
    np.testing.assert_allclose(place, [[130.0, 80.0]], atol=1e-9)


def test_two_keeps_of_one_leg_are_both_kept():
    motion = skating()
    keeps = [CastKeep("shin", (3, 6)), CastKeep("shin", (9, 12))]
    _, slid = direct(played(motion), cast(*keeps), motion)
    assert slid.before == pytest.approx(9) and slid.after < 1e-6


def test_a_keep_without_frames_is_while_the_source_is_on_the_ground():
    motion = skating(speed=2.0)  # slow enough to pass for standing
    (contact,) = staging.contacts(motion)
    assert (contact.part, contact.start, contact.stop) == ("shin", 0, FRAMES)
    after, slid = direct(played(motion), cast(CastKeep("shin", bend=())), motion)
    assert slid.before == pytest.approx(46) and slid.after < 1e-6
    np.testing.assert_allclose(
        mesh(after, "torso"), np.broadcast_to(mesh(after, "torso")[:1], mesh(after, "torso").shape)
    )


def test_an_order_in_the_cast_is_the_place_in_the_pile():
    motion = skating()
    before = played(motion)
    assert [role.target.part for role in sorted(before.roles, key=lambda role: role.order[0])] == list(BODY)
    turned = cast()
    turned = replace(turned, parts=(replace(turned.parts[0], order=7), *turned.parts[1:]))
    after, slid = direct(before, turned, motion)
    last = after.posed(3)[-1].points
    np.testing.assert_array_equal(last, staging.role_of(after, "torso").points[3][-len(last) :])
    assert slid is None


def test_a_path_is_followed_from_the_cast():
    motion = skating()
    before = played(motion)
    after, _ = direct(before, cast(follow=((40.0, 100.0), (240.0, 60.0))), motion)
    middle = mesh(after, "torso").mean(axis=1)
    np.testing.assert_allclose(middle[[0, -1], 0], mesh(after, "torso")[[0, -1], :, 0].mean(axis=1))
    assert middle[-1, 0] - middle[0, 0] == pytest.approx(200)
    assert middle[-1, 1] - middle[0, 1] == pytest.approx(-40)


def test_keeps_that_cannot_be_are_refused():
    motion = skating()
    performance = played(motion)
    for keep, said in (
        (CastKeep("shin", (3, 24)), "frames of the clip, 0 to 23, got 3 to 24"),
        (CastKeep("shin", (3, 4), (400.0, 0.0)), "point must lie on the first key's drawing"),
        (CastKeep("shin", (3, 4), (100.0, 150.0, 0.0)), "point must lie on the first key's drawing"),
        (CastKeep("shin"), "must touch the ground in the source"),
        (CastKeep("shin", (3, 4), bend=("torso", "shin")), "must hang on each other"),
    ):
        with pytest.raises(InputError, match=said):
            direct(performance, cast(keep), motion)
    fewer = perform(motion, [outline_drawing("shin", motion.keyset("shin"), RED)])
    with pytest.raises(InputError, match="parts that bend must be played, thigh and shin are not"):
        direct(fewer, cast(CastKeep("shin", (3, 4), bend=("thigh", "shin"))), motion)
    _, slid = direct(fewer, cast(CastKeep("shin", (3, 6))), motion)  # alone it is moved as a whole
    assert slid.after < 1e-6


def staged(folder, motion, text=""):
    """A motion file and a cast of rectangles in a folder."""
    tracks.save(motion, folder / "skate.motion.json")
    text = f"ground = false\n{text}"
    for name, (_, _, (x0, y0, x1, y1)) in BODY.items():
        svg = f'<svg xmlns="http://www.w3.org/2000/svg"><path d="M{x0},{y0} H{x1} V{y1} H{x0} Z" fill="red"/></svg>'
        (folder / f"{name}.svg").write_text(svg)
        text += f'[[parts]]\nname = "{name}"\ndrawing = "{name}.svg"\n'
    (folder / "skate.cast.toml").write_text(text)
    return folder / "skate.motion.json", folder / "skate.cast.toml"


def test_the_command_says_how_far_feet_slid(tmp_path):
    file, told = staged(tmp_path, skating())
    told.write_text(told.read_text() + '[[keep]]\npart = "shin"\nframes = [8, 14]\npoint = [96, 203]\n')
    assert read_cast(told).keep[0].frames == (8, 14)
    said = retarget(file, tmp_path / "s.svg", cast=told)
    assert said.endswith("drawings play torso, thigh, shin; feet slid by 18.0 px, now by 0.0")


def test_the_command_says_when_a_character_leaves_the_page(tmp_path):
    """Half as tall again, it glides by 12 pixels a frame from 122.5: over the edge at 319.5 by 79 in the last frame."""
    file, told = staged(tmp_path, skating(thigh=0.0, speed=8.0))
    assert "page" not in retarget(file, tmp_path / "s.svg", cast=told)
    told.write_text(told.read_text().replace('drawing = "torso.svg"', 'drawing = "torso.svg"\nheight = 1.5'))
    said = retarget(file, tmp_path / "s.svg", cast=told)
    found = re.search(r"; beyond the page in 7 frames, most in frame 23, by (\d+) px$", said)
    assert found and int(found[1]) == pytest.approx(79, abs=2)  # a mesh is a little larger than what is drawn on it


def test_a_limb_that_something_hid_is_drawn_and_what_was_lost_is_if_asked_for(tmp_path):
    motion = skating()
    seen = ~np.isin(np.arange(FRAMES), [10, 11])
    limb, body = replace(motion.track("thigh"), visible=seen), replace(motion.track("torso"), visible=np.roll(seen, 5))
    file, told = staged(tmp_path, replace(motion, tracks=(body, limb, motion.tracks[2])))

    def count(**more):
        folder = tmp_path / f"frames{len(more)}"
        retarget(file, folder / "0000.svg", cast=told, **more)
        return [(folder / f"{t:04d}.svg").read_text().count("<path") for t in (9, 10, 15)]

    assert count() == [3, 3, 2]  # the body has gone, the thigh of frame 10 has not
    assert count(bridge=True) == [3, 3, 3]
