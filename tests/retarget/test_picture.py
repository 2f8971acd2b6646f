"""Pictures on a mesh: the same character from vectors and from pixels is the same picture."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from capture.errors import InputError
from capture.motion import affine, keys
from retarget.characters.drawings.drawing import read_drawing
from retarget.characters.drawings.svg import read_svg
from retarget.characters.photos.picture import outline_of, read_picture
from retarget.stage.draw2d import draw, draw_things
from retarget.stage.perform import perform

GROUND = "#c8e0c8"


@pytest.fixture
def photos(worm, tmp_path):
    """The worm's two keys as PNG files of the same size."""
    files = []
    for file in worm:
        files.append(tmp_path / f"{file.stem}.png")
        Image.fromarray(draw_things(read_svg(file)[0], (320, 240))).save(files[-1])
    return files


def difference(one, other):
    """How far two images differ once half-pixel edges are forgiven: the mean of 3 x 3 pixels, 0-255."""
    import cv2

    return np.abs(cv2.blur(one.astype(np.float32), (3, 3)) - cv2.blur(other.astype(np.float32), (3, 3)))


def worm_outline(by_hand, by):
    rough = np.array([(150, 206), (132, 190), (128, 150), (142, 104), (160, 96)], float)
    return by_hand.lean(np.vstack([rough, [320, 0] + [-1, 1] * rough[::-1][1:]]) + [0, 0], by)


def test_a_still_picture_is_itself(photos, by_hand):
    motion = by_hand.motion(by_hand.still(), [[1.0]], names=("sit",))
    character = read_picture("egg", ("sit",), photos[:1], [None])
    box = character.box
    image = np.array(Image.open(photos[0]))
    size = 100 / (box[1, 1] - box[0, 1])
    shown = draw(perform(motion, [replace(character, height=1 / size)]), 0)
    shift = np.array([160, 200]) - [box[:, 0].mean(), box[1, 1]]
    assert np.abs(shift).max() < 5
    moved = affine.apply(np.column_stack([np.eye(2), shift]), np.argwhere(image[..., 3] > 250)[:, ::-1]).round()
    x, y = moved.astype(int).T
    assert (shown[y, x, 3] > 100).mean() > 0.995
    assert shown[..., 3].mean() == pytest.approx(image[..., 3].mean(), rel=0.01)


def test_vectors_and_pixels_of_one_character_agree(photos, worm, by_hand):
    frames = 5  # turned and moved, not squashed: that would thin the strokes of the pixels alone
    maps = [affine.fit_similarity(by_hand.egg(), affine.apply(m, by_hand.egg()), False) for m in by_hand.tumble(5)]
    motion = by_hand.motion(maps, np.ones((frames, 1)), names=("sit",))
    vector = read_drawing("egg", ("sit",), worm[:1])
    pixels = replace(read_picture("egg", ("sit",), photos[:1], [None]), box=vector.box)
    for t in range(frames):
        one, other = (draw(perform(motion, [target]), t, GROUND) for target in (vector, pixels))
        off = difference(one, other)
        assert off.mean() < 0.3 and np.percentile(off, 99.9) < 40


def test_pictures_of_two_keys_agree_with_vectors_half_way(photos, worm, by_hand):
    """Melted half and half on the mesh, each key's own picture has its features in the same place."""
    outlines = [worm_outline(by_hand, by) for by in (0.0, 60.0)]
    source = by_hand.motion(by_hand.still(), [[0, 0, 0, 0, 1.0]])
    vector = read_drawing("egg", by_hand.names, worm)
    pixels = read_picture("egg", by_hand.names, photos, outlines)
    pixels = replace(pixels, box=vector.box)
    one, other = (draw(perform(source, [target]), 0, GROUND) for target in (vector, pixels))
    off = difference(one, other)
    assert off.mean() < 2 and (off.max(axis=-1) > 90).mean() < 0.01


def test_one_picture_can_serve_all_keys(photos, by_hand):
    outlines = [worm_outline(by_hand, by) for by in (0.0, 60.0)]
    character = read_picture("egg", by_hand.names, [photos[0]] * 2, outlines)
    assert len(character.layers) == 1
    role = perform(by_hand.motion(by_hand.still(), [[0, 1.0]]), [character]).roles[0]
    posed = role.target.posed(role.points[0], role.weights[0], role.scale)[0]
    np.testing.assert_allclose(posed.layers[0][0].points, character.keys.points[0])


def test_a_bent_picture_has_no_seams_and_no_holes(tmp_path, by_hand):
    file = tmp_path / "plain.png"
    Image.new("RGB", (200, 200), (40, 90, 200)).save(file)
    square = np.array([(20, 20), (180, 20), (180, 180), (20, 180)], float)
    bent = by_hand.lean(square, 40.0)
    character = read_picture("egg", by_hand.names, [file] * 2, [square, bent])
    motion = by_hand.motion(by_hand.tumble(3), [[1, 0], [0.5, 0.5], [0, 1]])
    for t in range(3):
        image = draw(perform(motion, [character]), t)
        inside = image[..., 3] > 250
        assert inside.sum() > 5000
        np.testing.assert_array_equal(np.unique(image[inside][:, :3], axis=0), [[40, 90, 200]])
        edge = image[(image[..., 3] > 0) & ~inside][:, :3].astype(int)
        assert np.abs(edge - [40, 90, 200]).max() <= 6  # straight alpha: the border fades and does not darken
        # one piece: whatever is not outside is inside or on the border
        from skimage import measure

        assert measure.label(image[..., 3] < 250, connectivity=1).max() == 1


def test_the_outline_of_a_disc_goes_round_it_two_pixels_out():
    y, x = np.mgrid[:100, :100]
    image = np.zeros((100, 100, 4), np.uint8)
    image[..., 3] = np.clip(30.5 - np.hypot(x - 50, y - 45), 0, 1) * 255
    radius = np.linalg.norm(outline_of(image) - [50, 45], axis=1)
    assert np.abs(radius - 32).max() < 0.6


def test_a_picture_without_transparency_needs_an_outline(tmp_path):
    file = tmp_path / "photo.jpg"
    Image.new("RGB", (50, 50), (9, 9, 9)).save(file)
    with pytest.raises(InputError, match=r"photo\.jpg must have a transparent surrounding"):
        read_picture("egg", ("sit",), [file], [None])
    square = np.array([(5, 5), (45, 5), (45, 45), (5, 45)], float)
    np.testing.assert_allclose(read_picture("egg", ("sit",), [file], [square]).box, [[5, 5], [45, 45]])


def test_pictures_of_several_keys_need_outlines_of_one_length(photos, by_hand):
    outline = worm_outline(by_hand, 0.0)
    for outlines in ([None, None], [outline, outline[:-1]]):
        with pytest.raises(InputError, match="part 'egg': pictures for several keys need an outline each"):
            read_picture("egg", by_hand.names, photos, outlines)


def test_what_is_no_picture_is_refused(tmp_path):
    (tmp_path / "text.png").write_text("text")
    for name in ("text.png", "missing.png"):
        with pytest.raises(InputError, match=name):
            read_picture("egg", ("sit",), [tmp_path / name], [None])


def test_the_mesh_of_a_picture_is_a_key_set_like_any_other(photos):
    character = read_picture("egg", ("sit",), photos[:1], [None])
    assert character.shapes(np.zeros((1, 3))) == pytest.approx(character.keys.points)
    assert isinstance(character.keys, keys.KeySet)
