"""Three laws, for every kind of character that can play a part.

A motion played on its own keys is the captured one.  All weight on a key, under the map that the key itself has against
the first, shows that key as it was drawn.  Where and how large a character lies in its file changes nothing.
"""

import json
from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from capture.fit import action
from capture.motion import affine, keys
from retarget.characters.drawings.bend import read_bent
from retarget.characters.drawings.drawing import outline_drawing, read_drawing
from retarget.characters.figures.puppet import KeyPose, read_puppet
from retarget.characters.figures.skin import sampled, skinned
from retarget.characters.models import lift
from retarget.characters.models.mesh import mesh, read_mesh
from retarget.characters.models.model import Material, Model
from retarget.characters.photos.picture import read_picture
from retarget.stage.perform import perform, placement

FRAMES = 5
PLANE, TALL = (-1.0, 0.4, 1.0), 60.0


@dataclass(frozen=True, eq=False)
class Character:
    """A target, and what its keys are in its own file."""

    target: object
    drawn: NDArray  # (K, M, d) points as they are drawn in each key, in a role's order
    edge: NDArray  # those (n,) of them that its box and its own maps are measured on


def _numbers(scale, shift, points):
    return scale * np.asarray(points, float) + np.asarray(shift, float)[: np.shape(points)[-1]]


def svg_drawing(folder, by_hand, scale=1.0, shift=(0, 0, 0)):
    files = []
    for name, by in zip(by_hand.names, (0.0, 60.0), strict=True):
        head, _, rest = by_hand.worm_svg(by).partition("</defs>")
        moved = (
            f'<g transform="translate({shift[0]} {shift[1]}) scale({scale})">{rest.removesuffix("</svg>")}</g></svg>'
        )
        files.append(folder / f"worm_{name}.svg")
        files[-1].write_text(f"{head}</defs>{moved}")
    target = read_drawing("egg", by_hand.names, files)
    drawn = [np.concatenate([versions[k].points for versions in target.paths]) for k in range(2)]
    mesh_points = affine.apply(target.keys.removed, target.keys.points)  # the file says nothing of these
    return Character(target, np.concatenate([mesh_points, np.stack(drawn)], axis=1), target.keys.outline)


def picture(folder, by_hand, scale=1.0, shift=(0, 0, 0)):
    outlines = [_numbers(scale, shift, by_hand.lean(by_hand.egg(), by)) for by in (0.0, 30.0)]
    size = [int(np.ceil(np.max(corner) + 10)) for corner in np.concatenate(outlines).T]
    Image.new("RGB", size, (200, 90, 40)).save(folder / "photo.png")
    target = read_picture("egg", by_hand.names, [folder / "photo.png"] * 2, [*outlines], keys.straight)
    inside = affine.apply(target.keys.removed, target.keys.points)[:, target.keys.outline.max() + 1 :]
    assert len(target.keys.outline) == target.keys.outline.max() + 1
    ring = np.argsort(target.keys.outline)
    dense = [_cut(outline, len(ring)) for outline in outlines]
    drawn = np.concatenate([np.stack(dense), inside], axis=1)
    return Character(target, drawn, target.keys.outline)


def _cut(outline, count):
    """An outline with each step cut alike, to so many points."""
    parts = count // len(outline)
    s = np.arange(parts)[:, None] / parts
    return ((1 - s) * outline[:, None] + s * np.roll(outline, -1, axis=0)[:, None]).reshape(-1, 2)


def box_model(folder, by_hand, scale=1.0, shift=(0, 0, 0)):
    corners = np.array([(x, y, z) for x in (0, 2) for y in (0, 3) for z in (0, 1)], float)
    shapes = np.stack([corners, corners + [1.0, 0.2, 0.3] * (corners[:, 1:2] > 0) + [0, 0, 0.2] * corners[:, :1]])
    faces = ("1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4")
    files = []
    for name, shape in zip(by_hand.names, _numbers(scale, shift, shapes), strict=True):
        files.append(folder / f"box_{name}.obj")
        text = "".join(f"v {x:.12g} {y:.12g} {z:.12g}\n" for x, y, z in shape)
        files[-1].write_text(text + "".join(f"f {face}\n" for face in faces))
    target = read_mesh("egg", by_hand.names, files, plane=PLANE, depth=lift.keeping_volume)
    named = [int(number) - 1 for face in faces for number in face.split()]
    order = list(dict.fromkeys(named))  # points come as faces name them
    return Character(target, _numbers(scale, shift, shapes)[:, order], target.keys.outline)


def figure(folder, by_hand, arm, scale=1.0, shift=(0, 0, 0)):
    content = json.loads(arm.file.read_text())
    content["nodes"].append({"children": [1], "scale": [scale] * 3, "translation": list(shift)})
    content["scenes"] = [{"nodes": [5, 0]}]
    (folder / "moved.gltf").write_text(json.dumps(content))
    poses = [KeyPose("wave", 0.0), KeyPose("wave", 0.8)]
    target = read_puppet("egg", by_hand.names, folder / "moved.gltf", poses)
    drawn = np.concatenate([skinned(target.skin, target.rest, sampled(target.skin, "wave", [p.time])) for p in poses])
    return Character(target, drawn, target.keys.outline)


@pytest.fixture(params=[svg_drawing, picture, box_model, figure], ids=lambda make: make.__name__)
def made(request, tmp_path, by_hand, arm):
    """Makes a character of one kind, larger and elsewhere in its file if asked."""

    def make(**moved):
        more = {"arm": arm} if request.param is figure else {}
        return request.param(tmp_path, by_hand, **more, **moved)

    return make


def captured(by_hand):
    return by_hand.motion(by_hand.tumble(FRAMES), np.random.default_rng(5).dirichlet(np.ones(7), FRAMES))


# Own keys give the captured points back


def test_an_outline_of_the_captured_keys_moves_as_captured(by_hand):
    motion = captured(by_hand)
    for between in (keys.rigid, keys.straight):
        target = replace(outline_drawing("egg", motion.keyset("egg"), np.array([1.0, 0, 0, 1])), between=between)
        (role,) = perform(motion, [target]).roles
        assert np.abs(role.mesh() - motion.points("egg", between)).max() < 1e-6


def test_a_picture_of_the_captured_outlines_moves_as_captured(tmp_path, by_hand):
    motion = captured(by_hand)
    source = motion.keyset("egg")
    Image.new("RGB", (320, 240), (200, 90, 40)).save(tmp_path / "photo.png")
    drawn = affine.apply(source.removed, source.points)[:, source.outline]
    for between in (keys.rigid, keys.straight):
        target = read_picture("egg", by_hand.names, [tmp_path / "photo.png"] * 2, list(drawn), between)
        (role,) = perform(motion, [target]).roles
        truth = motion.points("egg", between)[:, source.outline]
        away = np.linalg.norm(role.mesh()[:, :, None] - truth[:, None], axis=-1)  # its points may be more
        assert away.min(axis=1).max() < (1e-6 if between is keys.straight else 0.3)  # its own mesh bends in its own way


def test_a_body_of_the_captured_outlines_moves_as_captured(by_hand):
    """The outline given some depth, key by key: what is seen of it is the captured outline again."""
    motion = captured(by_hand)
    source = motion.keyset("egg")
    drawn = affine.apply(source.removed, source.points)[:, source.outline] * [1, -1]
    count = drawn.shape[1]
    shapes = np.concatenate([np.dstack([drawn, np.full(drawn.shape[:2], side)]) for side in (-20.0, 20.0)], axis=1)
    here, after = np.arange(count), np.roll(np.arange(count), -1)
    faces = np.concatenate(
        [np.stack([here, after, after + count], -1), np.stack([here, after + count, here + count], -1)]
    )
    model = Model(shapes[0], faces, (Material(),), np.zeros(len(faces), int), np.zeros((len(shapes[0]), 2)))
    truth = motion.points("egg", keys.straight)[:, source.outline]
    for depth in (lift.kept, lift.keeping_volume):
        (role,) = perform(motion, [mesh("egg", by_hand.names, model, shapes, "xy", depth)]).roles
        np.testing.assert_allclose(role.points[:, :count, :2], truth, atol=1e-6)
        np.testing.assert_allclose(role.points[:, count:, :2], truth, atol=1e-6)


def test_a_figure_in_the_captured_poses_stands_as_captured(tmp_path, by_hand, arm):
    """The flat arm's own silhouettes are the captured keys; between them a figure goes round by its joints."""
    content = json.loads(arm.file.read_text())
    del content["nodes"][4]["mesh"]
    (tmp_path / "bare.gltf").write_text(json.dumps(content))
    target = read_puppet("egg", by_hand.names, tmp_path / "bare.gltf", [KeyPose("wave", 0.0), KeyPose("wave", 0.8)])
    poses = skinned(target.skin, target.rest, sampled(target.skin, "wave", np.array([0.0, 0.8])))[..., :2]
    ring = np.concatenate([np.arange(0, 18, 2), np.arange(17, 0, -2)])  # up the one side, down the other
    outlines = (poses * [20, -20] + [60, 200])[:, ring]
    motion = captured(by_hand)
    source = keys.keyset(by_hand.names, outlines)
    weights = np.zeros((FRAMES, len(source.rows)))
    lean = next(d for d, row in enumerate(source.rows) if tuple(row) == (1, 1, 0))
    weights[np.arange(FRAMES), [0, lean, 0, lean, lean]] = 1
    track = replace(motion.tracks[0], rows=source.rows, weights=weights)
    motion = replace(motion, tracks=(track,), keysets=(source,))
    (role,) = perform(motion, [target]).roles
    np.testing.assert_allclose(role.points[:, ring, :2], motion.points("egg")[:, : len(ring)], atol=1e-6)


def test_a_drawing_on_its_own_captured_line_stays_on_it(tmp_path, by_hand):
    (tmp_path / "worm.svg").write_text(by_hand.worm_svg())
    up = np.linspace(0, 1, 30)
    lines = np.array([np.stack([160 + 30 * t * up**2, 200 - 100 * up], -1) for t in range(FRAMES)])
    motion = action.capture_line(lines, part="egg")
    (role,) = perform(motion, [read_bent("egg", motion.keysets[0], tmp_path / "worm.svg")]).roles
    assert np.abs(role.mesh() - motion.points("egg")).max() < 1e-6


# All weight on a key shows that key


def test_all_weight_on_a_key_under_the_keys_own_map_shows_that_key(made, by_hand):
    character = made()
    target = character.target
    solid = character.drawn.shape[-1] == 3
    seen = (character.drawn @ target.view[:, :3].T)[..., :2] if solid else character.drawn
    motion = by_hand.motion(by_hand.still(1), [[1.0]])
    place = placement(motion, target)
    for key, drawn in enumerate(character.drawn):
        own = affine.fit(seen[0, character.edge], seen[key, character.edge])  # eq. 5
        onstage = affine.compose(place, affine.compose(own, affine.invert(place)))
        weights = np.eye(2)[[key]]
        played = by_hand.motion([affine.from_about(onstage, motion.tracks[0].pivot)], weights)
        (role,) = perform(played, [target]).roles
        space = affine.compose(lift.lifted(place, place[0, 0]), target.view) if solid else place
        np.testing.assert_allclose(role.points[0], affine.apply(space, drawn), atol=1e-6)


# Where a character lies in its file changes nothing


@pytest.mark.parametrize(("scale", "shift"), [(1.0, (30, 20, -7)), (2.5, (0, 0, 0)), (0.4, (100, 60, 11))])
def test_a_character_drawn_larger_or_elsewhere_plays_the_same(made, by_hand, scale, shift):
    motion = captured(by_hand)
    (one,), (other,) = (
        perform(motion, [character.target]).roles for character in (made(), made(scale=scale, shift=shift))
    )
    np.testing.assert_allclose(other.points, one.points, atol=1e-4)
    assert other.scale == pytest.approx(one.scale / scale, rel=1e-4)
    assert np.ptp(one.points[..., :2], axis=1).max() > TALL


@pytest.mark.parametrize(("scale", "shift"), [(1.0, (30, 20)), (2.5, (0, 0)), (0.4, (100, 60))])
def test_a_bent_drawing_drawn_larger_or_elsewhere_plays_the_same(tmp_path, by_hand, scale, shift):
    up = np.linspace(0, 1, 30)
    lines = np.array([np.stack([160 + 30 * t * up**2, 200 - 100 * up], -1) for t in range(FRAMES)])
    motion = action.capture_line(lines, part="egg")
    shown = []
    for moved in ({}, {"scale": scale, "shift": shift}):
        svg_drawing(tmp_path, by_hand, **moved)
        performance = perform(motion, [read_bent("egg", motion.keysets[0], tmp_path / "worm_sit.svg")])
        shown.append([np.concatenate([path.points for path in performance.posed(t)]) for t in range(FRAMES)])
    np.testing.assert_allclose(shown[1], shown[0], atol=0.01)
