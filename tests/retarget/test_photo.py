"""Photographs: cut out by a box, bent as the captured keys are, and no larger than can be bent."""

import numpy as np
import pytest
from PIL import Image

from capture.errors import InputError
from capture.motion import affine, keys, tracks
from capture.pictures.decode import read_clip
from retarget.characters.casts import cast as casting
from retarget.characters.casts import castfile
from retarget.characters.casts.castlist import Cast, CastPart
from retarget.characters.photos import photo
from retarget.characters.photos.picture import outline_of, read_picture
from retarget.characters.proposed.carried import carried_outline
from retarget.cli import main
from retarget.stage.draw2d import draw
from retarget.stage.perform import perform

TEAL = (20, 130, 140)


def plum(size=(300, 200), centre=(150, 100), radius=60):
    """A disc with a lit side before a grainy table, its true mask beside it."""
    rng = np.random.default_rng(0)
    y, x = np.mgrid[: size[1], : size[0]]
    away = np.hypot(x - centre[0], y - centre[1])
    share = np.clip(radius + 0.5 - away, 0, 1)[..., None]
    light = np.clip((x - centre[0] - y + centre[1]) / (4 * radius), -0.4, 0.4)[..., None]
    table = np.array([190, 160, 120]) + rng.normal(0, 6, (size[1], size[0], 1))
    picture = share * (np.array([110, 30, 120]) * (1 + light)) + (1 - share) * table
    return np.clip(picture, 0, 255).astype(np.uint8), away <= radius


@pytest.fixture
def plum_file(tmp_path):
    Image.fromarray(plum()[0]).save(tmp_path / "plum.png")
    return tmp_path / "plum.png"


def test_what_a_box_is_drawn_round_is_cut_out_and_nothing_shines_in(plum_file):
    truth = plum()[1]
    cut = photo.cut_out(photo.read_photo(plum_file), (75, 30, 150, 140))
    solid = cut.pixels[..., 3] > 127
    assert (solid & truth).sum() / (solid | truth).sum() > 0.97
    rim = cut.pixels[(cut.pixels[..., 3] > 20) & (cut.pixels[..., 3] < 235)][:, :3].astype(int)
    assert len(rim) > 50
    assert (rim[:, 1] < 70).all()  # the table's green is 160


def test_a_larger_photograph_is_cut_at_the_same_place(tmp_path):
    """Cut at the working size and enlarged, the rim is where it is, in the picture's own pixels."""
    picture, truth = plum((1500, 1000), (700, 500), 320)
    Image.fromarray(picture).save(tmp_path / "large.png")
    cut = photo.cut_out(photo.read_photo(tmp_path / "large.png"), (350, 150, 700, 700))
    outline = outline_of(cut.pixels)
    radius = np.hypot(*(outline - [700, 500]).T)
    assert np.abs(radius - 322).max() < 8
    assert ((cut.pixels[..., 3] > 127) != truth).sum() < 0.02 * truth.sum()


def test_a_box_outside_the_picture_is_refused(plum_file):
    for box in ((200, 100, 200, 50), (10, 10, 0, 5), (-20, 0, 100, 100)):
        with pytest.raises(InputError, match="must lie inside the 300 x 200 picture"):
            photo.cut_out(photo.read_photo(plum_file), box)


def test_a_large_photograph_is_scaled_down_and_that_is_said(tmp_path, monkeypatch):
    monkeypatch.setattr(photo, "LARGEST", 20_000)
    for name in ("large.png", "large.jpg"):
        Image.new("RGB", (600, 400), TEAL).save(tmp_path / name)
        read = photo.read_photo(tmp_path / name)
        assert read.size == (600, 400) and read.pixels.shape[0] * read.pixels.shape[1] <= 20_000
        assert "600 x 400" in read.notes[0] and "scaled down" in read.notes[0]
        there = np.array([[-0.5, -0.5], [599.5, 399.5]])
        np.testing.assert_allclose(read.from_own(there), [[-0.5, -0.5], np.array(read.pixels.shape[1::-1]) - 0.5])
        np.testing.assert_allclose(read.to_own(read.from_own(there)), there)


def test_a_hundred_megapixels_are_read_and_kept_small(tmp_path):
    Image.new("L", (10_000, 10_000), 90).save(tmp_path / "huge.png")
    read = photo.read_photo(tmp_path / "huge.png")
    assert read.size == (10_000, 10_000) and read.pixels.size <= 4 * photo.LARGEST
    assert "100 megapixels" in read.notes[0]


def test_a_scaled_down_photograph_plays_as_the_whole_one_does(tmp_path, by_hand, monkeypatch):
    """Outlines and pivots are in the picture's own pixels, however few of them are kept."""
    y, x = np.mgrid[:400, :600]
    picture = np.stack([x * 255 / 600, y * 255 / 400, 0 * x + 90], axis=-1).astype(np.uint8)
    Image.fromarray(picture).save(tmp_path / "photo.png")
    square = np.array([(150, 80), (450, 80), (450, 340), (150, 340)], float)
    motion = by_hand.motion(by_hand.tumble(3), np.ones((3, 1)), names=("sit",))
    seen = []
    for largest in (8_000_000, 30_000):
        monkeypatch.setattr(photo, "LARGEST", largest)
        actor = read_picture("egg", ("sit",), [tmp_path / "photo.png"], [square])
        assert bool(actor.notes) == (largest < 240_000)
        seen.append(draw(perform(motion, [actor]), 1).astype(int))
    inside = seen[0][..., 3] == 255
    assert inside.sum() > 3000
    assert np.abs(seen[0] - seen[1])[inside].max() <= 8
    np.testing.assert_array_equal(seen[0][..., 3], seen[1][..., 3])


def test_a_photograph_on_its_side_is_turned_upright(tmp_path):
    lying = Image.new("RGB", (60, 40), TEAL)
    exif = lying.getexif()
    exif[0x0112] = 6
    lying.save(tmp_path / "side.jpg", exif=exif)
    read = photo.read_photo(tmp_path / "side.jpg")
    assert read.size == (40, 60) and read.pixels.shape == (60, 40, 4) and not read.notes


def test_carried_keys_do_to_another_outline_what_the_source_does_to_its_own(by_hand):
    """A lean by the square of the height, on an egg, leans a picture of another size and shape likewise."""
    source = keys.keyset(by_hand.names, np.stack([by_hand.egg(), by_hand.lean(by_hand.egg(), 40.0)]))
    egg = by_hand.egg()
    laid = (egg - [120, 100]) / [80, 100]  # box on unit box
    other = laid * [160, 300] + [10, 20]
    carried = carried_outline(other, source)
    np.testing.assert_allclose(carried[0], other)
    truth = (by_hand.lean(egg, 40.0) - [120, 100]) / [80, 100] * [160, 300] + [10, 20]
    assert np.abs(carried[1] - truth).max() < 2.0
    drawn = affine.apply(source.removed, source.points)[:, source.outline]
    np.testing.assert_allclose(drawn[1], by_hand.lean(egg, 40.0), atol=1e-6)


def test_one_photograph_without_outlines_plays_all_keys(plum_file, by_hand, tmp_path):
    from skimage import measure

    motion = by_hand.motion(by_hand.still(3), [[1, 0], [0.5, 0.5], [0, 1]])
    chosen = casting.cast_of(plum_file, motion)
    chosen = Cast((CastPart("egg", chosen.parts[0].keys, str(plum_file), box=(75, 30, 150, 140)),))
    castfile.write_cast(chosen, tmp_path / "plum.cast.toml")
    assert castfile.read_cast(tmp_path / "plum.cast.toml").parts[0].box == (75, 30, 150, 140)
    performance = perform(motion, casting.targets(chosen, motion))
    frames = [draw(performance, t) for t in range(3)]
    role, source = performance.roles[0], motion.outline("egg")
    mine = role.points[:, role.target.keys.outline]
    moved = [
        [_at_height(points[t], y) - _at_height(points[0], y) for t in (1, 2) for y in (115, 150, 185)]
        for points in (mine, source)
    ]
    np.testing.assert_allclose(moved[0], 1.12 * np.array(moved[1]), atol=0.8)  # as far, or 1.25 times, being as wide
    assert np.abs(moved[1]).max() > 4
    for frame in frames:
        assert measure.label(frame[..., 3] < 250, connectivity=1).max() == 1
        seen = frame[frame[..., 3] > 200][:, :3].astype(int)
        assert (seen[:, 1] < 70).mean() > 0.999  # nothing of the table


def test_an_outline_that_would_cross_itself_is_refused():
    """A bar that curls up twice over lies on itself."""

    def bar(curl):
        turn = curl * np.linspace(0, 1, 60)
        middle = 5 * np.stack([np.cumsum(np.cos(turn)), np.cumsum(np.sin(turn))], axis=-1)
        aside = 10 * np.stack([-np.sin(turn), np.cos(turn)], axis=-1)
        return np.concatenate([middle - aside, (middle + aside)[::-1]]) + 200

    source = keys.keyset(("sit", "lean"), np.stack([bar(0.0), bar(4 * np.pi)]))
    with pytest.raises(InputError, match="must have an outline for key 'lean'"):
        carried_outline(bar(0.0), source)


def test_the_command_cuts_a_photograph_by_a_box_and_says_when_it_is_too_large(
    plum_file, by_hand, tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr(photo, "LARGEST", 30_000)
    tracks.save(by_hand.motion(by_hand.still(4), np.ones((4, 1)), names=("sit",)), tmp_path / "egg.motion.json")
    asked = ["retarget", str(tmp_path / "egg.motion.json"), "--drawing", str(plum_file)]
    asked += ["--box", "75", "30", "150", "140", "--background", "white", "-o", str(tmp_path / "out")]
    assert main(asked) == 0
    assert "plum.png: 300 x 200 pixels (0 megapixels) are scaled down" in capsys.readouterr().err
    frame = read_clip(tmp_path / "out")[0]
    assert tuple(frame[0, 0, :3]) == (255, 255, 255) and frame[150, 160, 1] < 80


def _at_height(outline, y):
    """The middle, across, of an outline (B, 2) at a height."""
    after = np.roll(outline, -1, axis=0)
    cut = (outline[:, 1] > y) != (after[:, 1] > y)
    share = (y - outline[cut, 1]) / (after[cut, 1] - outline[cut, 1])
    return (outline[cut, 0] + share * (after[cut, 0] - outline[cut, 0])).mean()
