"""Keys proposed from one drawing: what must hold for every drawing, the frog's own keys, and the files."""

from pathlib import Path

import numpy as np
import pytest
from svgelements import SVG, Shape

from capture.errors import InputError
from capture.motion import affine, keys, tracks
from capture.motion.tracks import CartoonMotion
from fixtures import bunny, frog
from retarget.characters import cast, castfile, paths, proposals
from retarget.characters.drawing import read_drawing
from retarget.characters.paths import DrawnPath
from retarget.characters.propose import Proposal, propose
from retarget.characters.svg import read_svg
from retarget.commands.proposing import propose as command

GREEN, BLACK = np.array([0.4, 0.7, 0.4, 1]), np.array([0, 0, 0, 1.0])


@pytest.fixture(scope="module")
def source() -> keys.KeySet:
    return _frog_keys()


@pytest.fixture(scope="module")
def own(source: keys.KeySet) -> Proposal:
    return propose([_drawn(_shapes(source)[0])], source)


@pytest.fixture(scope="module")
def rabbit() -> list[DrawnPath]:
    return _bunny("sit")


@pytest.fixture(scope="module")
def plain(source: keys.KeySet, rabbit: list[DrawnPath]) -> Proposal:
    return propose(rabbit, source)


@pytest.fixture(scope="module")
def limbed(source: keys.KeySet, rabbit: list[DrawnPath]) -> Proposal:
    return propose(rabbit, source, _limb_pins(rabbit))


def test_the_sources_own_first_key_brings_its_own_keys_back(own: Proposal, source: keys.KeySet):
    shapes = _shapes(source)
    for k, shape in enumerate(shapes):
        found = own.versions[k][0].points[::3][:-1]
        off = np.linalg.norm(_centred(found) - _centred(shape), axis=1)
        assert off.mean() < 0.01 * np.ptp(shapes[0][:, 1]), source.names[k]


def test_the_first_key_is_the_drawing_itself(plain: Proposal, limbed: Proposal, rabbit: list[DrawnPath]):
    for found in (plain, limbed):
        for path, first in zip(rabbit, found.versions[0], strict=True):
            assert np.abs(path.points - first.points).max() < 1e-6


def test_turning_and_scaling_the_drawing_changes_nothing_but_the_place(own: Proposal, source: keys.KeySet):
    c, s = 0.7 * np.cos(0.2), 0.7 * np.sin(0.2)
    place = np.array([[c, -s, 300], [s, c, -40]])
    turned = propose([paths.moved(_drawn(_shapes(source)[0]), place)], source)
    height = 0.7 * np.ptp(_shapes(source)[0][:, 1])
    for there, here in zip(turned.versions, own.versions, strict=True):
        expected = affine.apply(place, here[0].points)
        off = np.linalg.norm(_centred(there[0].points) - _centred(expected), axis=1)
        assert off.mean() < 0.01 * height


def test_every_key_has_the_same_elements_colours_and_strokes(limbed: Proposal, rabbit: list[DrawnPath]):
    for version in limbed.versions:
        for path, first in zip(version, rabbit, strict=True):
            assert (path.name, path.commands, path.width) == (first.name, first.commands, first.width)
            assert len(path.points) == len(first.points)
            assert (path.fill is None) == (first.fill is None) and np.all(path.fill == first.fill)


def test_no_triangle_folds_on_a_plain_shape(own: Proposal):
    assert own.folded.sum() == 0
    assert own.strain.max() < 1.5


def test_what_lies_apart_keeps_its_size_and_stays_near(source: keys.KeySet):
    body = _drawn(_shapes(source)[0])
    fly = paths.moved(body, np.array([[0.05, 0, 60], [0, 0.05, body.points[:, 1].min() - 30]]))
    found = propose([body, fly], source)
    size = np.ptp(fly.points, axis=0).max()
    for version in found.versions:
        assert 0.5 * size < np.ptp(version[1].points, axis=0).max() < 2 * size
        gap = np.linalg.norm(version[0].points[:, None] - version[1].points, axis=-1).min()
        assert gap < 1.5 * np.linalg.norm(body.points[:, None] - fly.points, axis=-1).min()


def test_a_pin_is_obeyed(source: keys.KeySet, rabbit: list[DrawnPath]):
    nose = np.array([375.0, 237.0])
    found = propose(rabbit, source, [(0, nose)])
    assert np.linalg.norm(found.places[0] - nose) < 6  # the nose is a little inside of the outline of all


def test_limbs_come_nearer_to_the_keys_that_were_drawn_by_hand(plain: Proposal, limbed: Proposal, source: keys.KeySet):
    """On average over the keys; 'affine' is the drawing under what the source's key turned and stretched as a whole."""
    off = {"affine": [], "plain": [], "limbed": []}
    rest = _middles(_bunny("sit"))
    for k, name in enumerate(source.names[1:], 1):
        drawn = _middles(_bunny(name))
        source_map = affine.apply(source.removed[k], rest)
        for label, found in (
            ("affine", source_map), ("plain", _middles(plain.versions[k])), ("limbed", _middles(limbed.versions[k]))
        ):  # fmt: skip
            off[label].append(np.linalg.norm(_centred(found) - _centred(drawn), axis=1).mean() / np.ptp(rest[:, 1]))
    mean = {label: float(np.mean(each)) for label, each in off.items()}
    print("\nbunny's points from the hand-made keys, share of the height:", {k: f"{v:.3f}" for k, v in mean.items()})
    assert mean["limbed"] < 0.9 * mean["affine"]
    assert mean["limbed"] < 0.9 * mean["plain"]


def test_limbs_stay_joined(limbed: Proposal, rabbit: list[DrawnPath]):
    """The far end of each limb's piece lies in the next one, in every key, as it does in the drawing."""
    import shapely

    number = _numbers(rabbit)
    for upper, lower in (
        ("leg_near_thigh", "leg_near_shank"),
        ("leg_near_shank", "leg_near_foot"),
        ("body", "arm_near"),
    ):
        for version in limbed.versions:
            one, other = (paths.painted(version[number[name]]) for name in (upper, lower))
            assert one.intersection(other).area > 0.05 * min(one.area, other.area), (upper, lower)
            assert not shapely.is_empty(one)


def test_the_files_are_read_back_as_drawings_of_the_same_elements(tmp_path: Path, by_hand):
    """A worm with curves, straight sides, a hole and a gradient, as the keys of an egg that leans."""
    drawing, folder = tmp_path / "worm.svg", tmp_path / "keys"
    drawing.write_text(by_hand.worm_svg(), encoding="utf-8")
    motion = by_hand.motion(by_hand.still(), [[1.0]])
    tracks.save(motion, tmp_path / "egg.motion.json")
    said = command(tmp_path / "egg.motion.json", folder, drawing=(drawing,))
    assert "2 key drawings" in said and (tmp_path / "keys.png").exists()
    files = [folder / f"worm_{name}.svg" for name in by_hand.names]
    found = read_drawing("egg", by_hand.names, files)
    first = read_svg(drawing)[0]
    assert [path.name for path in first] == [versions[0].name for versions in found.paths]
    again = read_svg(files[0])[0]
    for path, there in zip(first, again, strict=True):
        ends = [np.concatenate(paths.flatten(one)) for one in (path, there)]
        far = np.linalg.norm(ends[0][:, None] - ends[1], axis=-1)
        assert max(far.min(axis=0).max(), far.min(axis=1).max()) < 1e-6
    shapes = [[one for one in SVG.parse(str(file)).elements() if isinstance(one, Shape)] for file in files]
    assert (
        [one.id for one in shapes[0]] == [one.id for one in shapes[1]] == ["body", "stripe", "ring", "mouth", "cheek"]
    )
    assert again[4].fill.offsets.tolist() == [0, 1]
    played = cast.targets(castfile.read_cast(folder / "worm.cast.toml"), motion)
    assert played[0].keys.names == by_hand.names


def test_a_corrected_key_is_kept(tmp_path: Path, by_hand):
    drawing, folder = tmp_path / "worm.svg", tmp_path / "keys"
    drawing.write_text(by_hand.worm_svg(), encoding="utf-8")
    tracks.save(by_hand.motion(by_hand.still(), [[1.0]]), tmp_path / "egg.motion.json")
    command(tmp_path / "egg.motion.json", folder, drawing=(drawing,))
    corrected, other = folder / "worm_lean.svg", folder / "worm_sit.svg"
    text = other.read_text()
    corrected.write_text("corrected")
    other.unlink()
    said = command(tmp_path / "egg.motion.json", folder, drawing=(drawing,))
    assert corrected.read_text() == "corrected" and other.read_text() == text
    assert "1 key drawing" in said and "kept" in said
    command(tmp_path / "egg.motion.json", folder, drawing=(drawing,), again=True)
    assert corrected.read_text() != "corrected"


def test_keys_of_a_drawing_of_the_first_key_are_named_after_the_character(tmp_path: Path, by_hand):
    drawing = tmp_path / "worm_sit.svg"
    drawing.write_text(by_hand.worm_svg(), encoding="utf-8")
    found = proposals.castings([drawing], by_hand.motion(by_hand.still(), [[1.0]]))
    assert found[0].stem == "worm"


def test_one_drawing_with_a_group_for_each_part_plays_all_parts(tmp_path: Path, by_hand):
    one, other = (
        by_hand.motion(by_hand.still(), [[1.0]], part="egg"),
        by_hand.motion(by_hand.still(), [[1.0]], part="hat"),
    )
    motion = CartoonMotion(one.tracks + other.tracks, one.keysets + other.keysets, one.times, one.fps, one.size)
    egg, hat = (f'<g id="{name}">{_inside(by_hand.worm_svg())}</g>' for name in ("egg", "hat"))
    file = tmp_path / "two.svg"
    hat = hat.replace('id="hat"', 'id="hat" transform="scale(0.5)"')
    file.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" width="320" height="240">{egg}{hat}</svg>')
    found = proposals.castings([file], motion)
    assert [(casting.part, casting.stem) for casting in found] == [("egg", "two_egg"), ("hat", "two_hat")]
    made = [proposals.proposal(casting, motion) for casting in found]
    written, _ = proposals.write(tmp_path, found, made, motion)
    assert {"two_egg_sit.svg", "two_hat_lean.svg"} <= {file.name for file in written}
    parts = castfile.read_cast(written[-1]).parts
    assert parts[1].height == pytest.approx(0.5 * parts[0].height, rel=0.02)


def test_a_picture_gets_an_outline_for_each_key(tmp_path: Path, by_hand):
    """A disc cut out of a transparent picture: its cast plays the egg's keys."""
    from PIL import Image

    y, x = np.mgrid[:120, :100]
    alpha = np.where((x - 50) ** 2 + (y - 60) ** 2 < 40**2, 255, 0)
    Image.fromarray(np.dstack([x + 50, y + 90, x, alpha]).astype(np.uint8)).save(tmp_path / "moon.png")
    motion = by_hand.motion(by_hand.still(), [[1.0]])
    tracks.save(motion, tmp_path / "egg.motion.json")
    said = command(tmp_path / "egg.motion.json", tmp_path / "keys", drawing=(tmp_path / "moon.png",))
    assert "2 outlines of moon.png" in said
    part = castfile.read_cast(tmp_path / "keys" / "moon.cast.toml").parts[0]
    first, lean = (np.array(key.outline) for key in part.keys)
    assert np.abs(np.linalg.norm(first - (50, 60), axis=1) - 41.5).max() < 2
    assert np.linalg.norm(_centred(lean) - _centred(first), axis=1).max() > 4
    played = cast.targets(castfile.read_cast(tmp_path / "keys" / "moon.cast.toml"), motion)
    assert played[0].keys.names == by_hand.names


@pytest.mark.parametrize("turned", [False, True])
def test_a_drawing_that_looks_the_other_way_is_told(tmp_path: Path, source: keys.KeySet, capsys, turned: bool):
    """The source's own first key, and the same in a mirror."""
    shape = _shapes(source)[0]
    shape = (shape - shape.mean(axis=0)) * (-1 if turned else 1, 1) + 400
    d = "M" + " L".join(f"{x:.2f},{y:.2f}" for x, y in shape) + " Z"
    text = f'<svg xmlns="http://www.w3.org/2000/svg" width="800" height="800"><path d="{d}" fill="green"/></svg>'
    (tmp_path / "it.svg").write_text(text)
    still = {"affine": np.tile(affine.identity(), (2, 1, 1)), "weights": np.eye(2, len(source.rows))}
    track = tracks.track_of("frog", source, still["affine"], still["weights"], np.zeros(2))
    motion = CartoonMotion((track,), (source,), np.arange(2) / 24, 24.0, (800, 800))
    tracks.save(motion, tmp_path / "frog.motion.json")
    for mirror in (False, True):
        command(tmp_path / "frog.motion.json", tmp_path / f"{mirror}", drawing=(tmp_path / "it.svg",), mirror=mirror)
        told = capsys.readouterr().err
        assert ("may look the other way" in told) == (turned and not mirror)


def test_what_cannot_be_used_is_refused_in_a_sentence(tmp_path: Path, by_hand):
    drawing = tmp_path / "worm.svg"
    drawing.write_text(by_hand.worm_svg(), encoding="utf-8")
    motion = tmp_path / "egg.motion.json"
    tracks.save(by_hand.motion(by_hand.still(), [[1.0]]), motion)
    for changes, said in (
        ({}, "needs --drawing"),
        ({"drawing": (tmp_path / "cup.glb",)}, "an SVG or a picture"),
        ({"drawing": (drawing,), "pin": ("nose",)}, "PLACE=X,Y"),
        ({"drawing": (drawing,), "pin": ("3=#wing",)}, "its ids are body, stripe"),
        ({"drawing": (drawing,), "pin": ("3=#ring", "9=#ring")}, "pinned to two"),
        ({"drawing": (drawing,), "pin": ("300=#ring",)}, "numbered from 0 to 47"),
        ({"drawing": (drawing,), "pin": tuple(f"3=#{n}" for n in range(1, 6))}, "a trunk"),
        ({"drawing": (drawing,), "pin": ("2=140,200", "20=160,100", "10=180,200", "30=130,150")}, "same order"),
    ):
        with pytest.raises(InputError, match=said):
            command(motion, tmp_path / "keys", **changes)
    assert not (tmp_path / "keys").exists() or not list((tmp_path / "keys").iterdir())


def _frog_keys() -> keys.KeySet:
    part = frog.frog().parts[0]
    return keys.keyset(part.key_names, part.points[part.key_frames])


def _shapes(source: keys.KeySet) -> np.ndarray:
    return affine.apply(source.removed, source.points)[:, source.outline]


def _drawn(outline: np.ndarray) -> DrawnPath:
    ring = np.vstack([outline, outline[:1]])
    thirds = ring[:-1, None] + np.arange(1, 4)[:, None] / 3 * (ring[1:] - ring[:-1])[:, None]
    points = np.vstack([ring[:1], thirds.reshape(-1, 2)])
    commands = "M" + "L" * (len(outline) - 1) + "Z"
    return DrawnPath("frog", commands, points, np.array([0, len(points)]), np.array([True]), GREEN, BLACK)


def _bunny(name: str) -> list[DrawnPath]:
    return read_svg(Path(bunny.__file__).parent / "characters" / f"bunny_{name}.svg")[0]


def _numbers(drawn: list[DrawnPath]) -> dict[str, int]:
    return {path.name.partition("(")[2][:-1]: number for number, path in enumerate(drawn)}


def _limb_pins(drawn: list[DrawnPath]) -> list[tuple[int, int]]:
    """Thighs, shanks, feet and arms go as the middle of the frog's: by numbers of its outline."""
    number = _numbers(drawn)
    places = {"leg_{}_thigh": 72, "leg_{}_shank": 41, "leg_{}_foot": 52, "arm_{}": 96}
    return [(place, number[name.format(side)]) for side in ("near", "far") for name, place in places.items()]


def _middles(drawn: list[DrawnPath]) -> np.ndarray:
    return np.concatenate([paths.along(paths.pieces(path), (0.0, 0.5)).reshape(-1, 2) for path in drawn])


def _centred(points: np.ndarray) -> np.ndarray:
    return points - points.mean(axis=0)


def _inside(svg: str) -> str:
    return svg[svg.index("<defs>") : svg.rindex("</svg>")]
