"""Captured people play children's drawings, our tomcat and a fox, made of rubber; the sheets are for a person to see."""

from dataclasses import replace

import numpy as np
import pytest
from skimage.measure import label

from capture.motion import affine
from capture.motion.tracks import total_affine
from capture.pictures.encode import write_picture
from fixtures.write import CHARACTERS
from mocap.bones import cast_marks
from mocap.bvh import read_bvh
from mocap.rubber.rubber import make_rubber, plain
from mocap.to_tracks import to_tracks
from mocap.units import upright
from retarget.characters import rubber_skin
from retarget.characters.hoses import hoses
from retarget.characters.markfiles import read_marked
from retarget.characters.meshfiles import read_model
from retarget.characters.skin import read_skin, sampled, skinned
from retarget.export.rubber import write_rubber
from retarget.stage import draw2d
from retarget.stage.play import play, play_mesh

CLIPS = {"kick": ("cmu21_kick.bvh", 2, 150, 290), "dance": ("ad_rokoko_jesse_dance.bvh", 4, 400, 800)}
DRAWINGS = ("char1", "char2", "char3", "tomcat")


def _rubber(data, clip):
    """A stretch of a clip at about 25 frames a second, exaggerated as much as its limbs bear."""
    name, step, first, stop = CLIPS[clip]
    motion = upright(read_bvh(data / "bvh" / name)).part(first, stop)
    slower = replace(motion, translation=motion.translation[::step], rotation=motion.rotation[::step])
    return make_rubber(replace(slower, fps=motion.fps / step))


def _character(data, name):
    return read_marked(
        CHARACTERS / "tomcat.svg" if name == "tomcat" else data / "drawings" / "animated_drawings" / name
    )


def _sheet(played, count=10, width=300):
    """Frames side by side in two rows, each as wide as the figure ever is."""
    every = [np.concatenate([role.points[t, :, :2] for role in played.roles]) for t in range(len(played.times))]
    wide = max(np.ptp(points[:, 0]) for points in every) + 16
    zoom = width / wide
    rows = [[], []]
    for k, t in enumerate(np.linspace(0, len(every) - 1, count).astype(int)):
        page = draw2d.draw(played, t, "white", (round(played.size[0] * zoom), round(played.size[1] * zoom)))
        left = round(zoom * (every[t][:, 0].min() + every[t][:, 0].max() - wide) / 2) + width
        cut = np.pad(page, ((1, 1), (width, 2 * width), (0, 0)), constant_values=225)[:, left : left + width]
        rows[k * 2 // count].append(np.pad(cut, ((0, 0), (1, 1), (0, 0)), constant_values=120))
    return np.vstack([np.hstack(row) for row in rows])


def _ends(tracks, marks):
    """Where marked joints go (T, J, 2)."""
    corner = tracks.tracks[0].pivot - marks.places[0]
    names = [track.part for track in tracks.tracks]
    found = []
    for joint, name in enumerate(marks.names):
        last = [part for part in names if part.rpartition(" ")[0] == name or part == name]
        while not last:  # marked in its parent's place
            joint = marks.parents[joint]
            last = [
                part for part in names if part.rpartition(" ")[0] == marks.names[joint] or part == marks.names[joint]
            ]
        found.append(affine.apply(total_affine(tracks, last[-1]), (marks.places[joint] + corner)[None])[:, 0])
    return np.stack(found, axis=1)


@pytest.mark.parametrize("name", DRAWINGS)
@pytest.mark.parametrize("clip", CLIPS)
def test_a_person_plays_a_drawing(data, sheets, clip, name):
    """It stays in one piece and on the ground, its hands and feet go as far as the rubber's do, and its limbs bend."""
    motion, character = _rubber(data, clip), _character(data, name)
    marks = character.marks
    casting = cast_marks(motion, marks)
    assert len(casting.roles) >= 14
    tracks = to_tracks(motion, marks, casting)
    played = play(tracks, character)
    write_picture(sheets / f"{clip}_to_{name}.png", _sheet(played))
    for t in range(0, len(played.times), 9):
        alpha = draw2d.draw(played, t, size=(played.size[0] // 2, played.size[1] // 2))[..., 3] > 127
        sizes = np.sort(np.bincount(label(alpha).ravel())[1:])[::-1]
        assert sizes[0] > 0.97 * sizes.sum()
    ends = _ends(tracks, marks)
    standing = [mark for mark, _ in casting.roles.values()]
    height, lowest = motion.positions[..., 1].min(axis=1), ends[:, standing, 1].max(axis=1)
    height = np.maximum(height - np.percentile(height, 2), 0)
    # the dancer hops, and so do they
    slope, level = np.polyfit(height, lowest, 1)
    assert np.abs(lowest - level - slope * height).max() < 0.04 * np.ptp(marks.places[:, 1])
    at = {joint: marks.names.index(joint) for joint in marks.names}
    shanks = np.linalg.norm(ends[:, at["left_foot"]] - ends[:, at["left_knee"]], axis=1)
    assert np.ptp(shanks) > 0.15 * np.median(shanks)  # rubber
    turns = [affine.turn(total_affine(tracks, f"left_knee {k}")) for k in (1, 4)]
    bend = (turns[1] - turns[0] + np.pi) % (2 * np.pi) - np.pi
    assert np.abs(bend).max() > np.radians(15)  # a hose


def test_feet_that_stand_slide_little_on_a_drawing(data):
    """The kicker's standing foot on the girl: by how much it moves while the captured one stands, against her height."""
    from mocap.contacts import find_contacts

    motion, character = _rubber(data, "kick"), _character(data, "char2")
    contacts = find_contacts(motion.source)
    tracks = to_tracks(motion, character.marks)
    ends, slid, stood = _ends(tracks, character.marks), 0.0, 0.0
    for foot, side in enumerate(("left", "right")):
        place = ends[:, character.marks.names.index(f"{side}_foot"), 0]
        both = contacts[1:, foot] & contacts[:-1, foot]
        slid, stood = slid + np.abs(np.diff(place))[both].sum(), stood + both.sum() / motion.source.fps
    speed = slid / max(stood, 1e-9) / np.ptp(character.marks.places[:, 1]) * 1.5  # metres a second, were she 1.5 m tall
    assert stood > 1.0 and speed < 0.1


@pytest.mark.parametrize(("clip", "plane"), [("kick", "zy"), ("dance", "xy")])
def test_a_body_of_hoses_plays_without_any_drawing(data, sheets, clip, plane):
    motion = _rubber(data, clip)
    model, skin = hoses(motion.subjoints.skeleton, motion.source)
    bound = rubber_skin.rubber_skin(skin, model.points, motion.subjoints)
    points = rubber_skin.posed(bound, model.points, motion)
    played = play_mesh(points, model, motion.source.fps, plane, height=360)
    write_picture(sheets / f"{clip}_of_hoses.png", _sheet(played))
    hands = [motion.subjoints.ends[motion.subjoints.skeleton.names.index(f"{side}Hand")] for side in ("Left", "Right")]
    for hand in hands:
        away = np.linalg.norm(points - motion.positions[:, hand, None], axis=-1).min(axis=1)
        assert away.max() < 0.12  # metres: the glove is round the hand


def test_the_running_fox_is_made_of_rubber(data, sheets, tmp_path):
    """Its own run is kept where nothing is exaggerated; made of rubber it goes further, and out and back as a GLB."""
    path = data / "meshes" / "Fox.glb"
    skin, model = read_skin(path), read_model(path)
    motion = rubber_skin.motion_of(skin, "Run")
    times = np.arange(len(motion)) / motion.fps
    own = skinned(skin, model.points, sampled(skin, "Run", times))
    calm = plain(motion)
    size = np.ptp(model.points, axis=0).max()
    kept = rubber_skin.posed(rubber_skin.rubber_skin(skin, model.points, calm.subjoints), model.points, calm)
    assert np.abs(kept - own).max() < 0.05 * size
    made = make_rubber(motion, omega=3.0, loop=True)
    bound = rubber_skin.rubber_skin(skin, model.points, made.subjoints)
    points = rubber_skin.posed(bound, model.points, made)
    frames = np.concatenate([own, points])
    played = play_mesh(frames, model, motion.fps, "-zy", height=220)
    halves = [np.arange(0, len(own), len(own) // 6)[:6] + start for start in (0, len(own))]
    rows = [np.hstack([draw2d.draw(played, t, "white") for t in half]) for half in halves]
    write_picture(sheets / "fox_of_rubber.png", np.vstack(rows))
    assert 0.03 * size < np.abs(points - own).max() < 0.5 * size
    write_rubber(model, bound, made, tmp_path / "fox.glb", "fox")
    again = read_skin(tmp_path / "fox.glb")
    (animation,) = again.animations
    model_again = read_model(tmp_path / "fox.glb")
    read = skinned(again, model_again.points, sampled(again, animation, times))
    nearest = np.linalg.norm(read[7][:, None] - points[7], axis=-1)
    assert max(nearest.min(axis=0).max(), nearest.min(axis=1).max()) < 1e-4 * size
