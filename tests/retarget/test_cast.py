"""Casts: written, read, made from file names, and refused in one sentence."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from capture.errors import InputError
from capture.motion import affine
from retarget.characters.casts.cast import backdrop, cast_of, targets
from retarget.characters.casts.castfile import read_cast, write_cast
from retarget.characters.casts.castlist import Cast, CastKeep, CastKey, CastPart
from retarget.characters.models import lift
from retarget.stage.draw2d import draw
from retarget.stage.perform import perform

KEPT = '[[parts]]\nname = "egg"\ndrawing = "a.svg"\n[[keep]]\npart = "egg"\n'

numbers = st.floats(-1e6, 1e6)
places = st.tuples(numbers, numbers)


@pytest.fixture
def motion(by_hand):
    return by_hand.motion(by_hand.tumble(2), np.eye(2))


def two_parts(by_hand):
    egg = by_hand.motion(by_hand.still(), [[1.0]])
    lid = by_hand.motion(by_hand.still(), [[1.0]], names=("sit",), part="lid")
    return replace(egg, tracks=egg.tracks + lid.tracks, keysets=egg.keysets + lid.keysets)


def test_a_cast_read_back_is_the_cast(tmp_path):
    outline = ((1.5, 2.0), (3.0, 4.0), (0.1, 9.0))
    keys = (CastKey("sit", "a b.png", outline), CastKey("lean", 'qu"ote\\é.png', outline))
    parts = (
        CastPart("egg", keys, between="straight", height=1.25, pivot=(3.0, 0.1)),
        CastPart("lid", (), "lid.svg"),
    )
    cast = Cast(parts, "white", tmp_path)
    write_cast(cast, tmp_path / "egg.cast.toml")
    assert read_cast(tmp_path / "egg.cast.toml") == cast


@given(
    name=st.text(st.characters(exclude_categories=["Cs"]), min_size=1),
    follow=st.lists(places, min_size=2, max_size=4),
    first=st.integers(0, 99),
    more=st.integers(0, 99),
    point=st.one_of(st.just(()), places),
    at=st.none() | places,
    bend=st.none() | st.just(()) | st.just(("thigh", 'the "other" shin')),
    stretch=st.floats(0, 2),
    order=st.none() | st.integers(-9, 9),
)
def test_what_a_cast_says_of_the_staging_is_read_back(
    tmp_path_factory, name, follow, first, more, point, at, bend, stretch, order
):
    folder = tmp_path_factory.mktemp("cast")
    keep = CastKeep(name, (first, first + more), point, at, bend, stretch)
    part = CastPart(name, (), "a.svg", order=order)
    cast = Cast((part,), folder=folder, follow=tuple(follow), keep=(keep, CastKeep(name)))
    write_cast(cast, folder / "a.cast.toml")
    assert read_cast(folder / "a.cast.toml") == cast


def test_a_cast_written_elsewhere_names_the_same_files(tmp_path, worm, motion):
    cast = cast_of(worm, motion)
    cast = replace(cast, background=str(tmp_path / "sky.png"))
    path = tmp_path / "deep" / "worm.cast.toml"
    write_cast(cast, path)
    again = read_cast(path)
    assert [key.drawing for key in again.parts[0].keys] == ["../worm_sit.svg", "../worm_lean.svg"]
    assert again.background == "../sky.png"
    for one, other in zip(targets(again, motion), targets(cast, motion), strict=True):
        np.testing.assert_array_equal(one.keys.points, other.keys.points)


def test_keys_play_by_name_whatever_their_order_in_the_file(tmp_path, worm, motion):
    (tmp_path / "worm.cast.toml").write_text(
        '[[parts]]\nname = "egg"\nheight = 1\n'
        '[[parts.keys]]\nname = "lean"\ndrawing = "worm_lean.svg"\n'
        '[[parts.keys]]\nname = "sit"\ndrawing = "worm_sit.svg"\n'
    )
    (target,) = targets(read_cast(tmp_path / "worm.cast.toml"), motion)
    (known,) = targets(cast_of(worm, motion), motion)
    assert target.keys.names == ("sit", "lean")
    np.testing.assert_array_equal(target.keys.points, known.keys.points)


def test_a_folder_is_cast_by_the_ends_of_its_file_names(tmp_path, worm, motion, by_hand):
    assert cast_of(tmp_path, motion) == cast_of([str(file) for file in worm], motion)
    both = two_parts(by_hand)
    for name in ("Worm-egg-sit.svg", "worm egg lean.svg", "worm_lid.svg"):
        (tmp_path / "two").mkdir(exist_ok=True)
        (tmp_path / "two" / name).write_text(by_hand.worm_svg(), encoding="utf-8")
    cast = cast_of(tmp_path / "two", both)
    assert [(part.name, [key.name for key in part.keys]) for part in cast.parts] == [
        ("egg", ["sit", "lean"]),
        ("lid", ["sit"]),
    ]
    assert len(perform(both, targets(cast, both)).posed(0)) == 10


def test_one_drawing_plays_a_part_with_one_key_whatever_its_name(worm, by_hand):
    motion = by_hand.motion(by_hand.still(), [[1.0]], names=("sit",))
    (target,) = targets(cast_of(worm[1], motion), motion)
    assert target.keys.names == ("sit",)


def test_a_part_with_a_drawing_and_no_keys_keeps_its_shape(tmp_path, worm, motion):
    (tmp_path / "c.cast.toml").write_text('[[parts]]\nname = "egg"\ndrawing = "worm_sit.svg"\npivot = [1, 2]\n')
    (target,) = targets(read_cast(tmp_path / "c.cast.toml"), motion)
    assert target.keys.names == ("rest",)
    assert tuple(target.pivot) == (1, 2)
    assert len(perform(motion, [target]).posed(1)) == 5


def test_a_picture_given_to_the_part_serves_every_key_with_its_outline(tmp_path, motion):
    Image.new("RGB", (60, 60)).save(tmp_path / "photo.jpg")
    (tmp_path / "c.cast.toml").write_text(
        '[[parts]]\nname = "egg"\ndrawing = "photo.jpg"\n'
        '[[parts.keys]]\nname = "sit"\noutline = [[5, 5], [50, 5], [50, 50], [5, 50]]\n'
        '[[parts.keys]]\nname = "lean"\noutline = [[9, 5], [58, 5], [50, 50], [5, 50]]\n'
    )
    (target,) = targets(read_cast(tmp_path / "c.cast.toml"), motion)
    assert len(target.layers) == 1 and target.keys.names == ("sit", "lean")


def test_a_background_is_a_colour_or_a_picture_beside_the_cast(tmp_path):
    Image.new("RGB", (4, 3), (9, 8, 7)).save(tmp_path / "sky.png")
    assert backdrop(Cast()) is None
    assert backdrop(Cast(background="#123456")) == "#123456"
    assert backdrop(Cast(background="sky.png", folder=tmp_path)).shape == (3, 4, 4)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("parts = 3", "array"),
        ("[[parts]]\n", "name"),
        ('[[parts]]\nname = "egg"\n', "part 'egg' must have a drawing"),
        (
            '[[parts]]\nname = "egg"\n[[parts.keys]]\nname = "sit"\n',
            "key 'sit' of part 'egg' must have a drawing",
        ),
        (
            '[[parts]]\nname = "egg"\ndrawing = "a.svg"\nbetween = "round"\n',
            "between must be one of rigid, straight",
        ),
        ('[[parts]]\nname = "egg"\ndrawing = "a.svg"\nheight = 0\n', "height must be above 0"),
        ('[[parts]]\nname = "egg"\ndrawing = "a.svg"\nhight = 2\n', "'hight' is no field"),
        ('[[parts]]\nname = "egg"\ndrawing = "a.svg"\npivot = [1]\n', "pivot"),
        ("[[", "cast.toml"),
        ("follow = [[1, 2]]", "follow must be a path of 2 or more points"),
        ("follow = [[1, 2], [nan, 2]]", "follow must be a path"),
        ('[[keep]]\npart = "egg"\n', "keep of part 'egg': the part must be one that is played, name one of none"),
        (KEPT + "frames = [4, 2]", "frames must be the first and the last"),
        (KEPT + "frames = [1, 2, 3]", "frames"),
        (KEPT + "at = [1, 2]", "a place needs the frames"),
        (KEPT + "point = [1]", "point and at must be"),
        (KEPT + 'bend = ["thigh"]', "bend must name two parts"),
        (KEPT + "stretch = -1", "stretch must be 0 or more"),
        (KEPT + "frame = 3", "'frame' is no field"),
    ],
)
def test_a_cast_with_a_slip_is_refused_by_name(tmp_path, text, said):
    path = tmp_path / "odd.cast.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=said) as caught:
        read_cast(path)
    assert "odd.cast.toml" in str(caught.value)


def test_a_missing_cast_and_missing_drawings_are_refused(tmp_path, motion):
    with pytest.raises(InputError, match=r"no .*none\.cast\.toml"):
        read_cast(tmp_path / "none.cast.toml")
    with pytest.raises(InputError, match=r"gone\.svg"):
        cast_of([tmp_path / "gone.svg"], motion)
    cast = Cast((CastPart("egg", (), "gone.svg"),), folder=tmp_path)
    with pytest.raises(InputError, match=r"gone\.svg"):
        targets(cast, motion)


def test_keys_that_do_not_match_the_motions_are_refused(worm, motion):
    keys = (CastKey("sit", str(worm[0])), CastKey("jump", str(worm[1])))
    with pytest.raises(InputError, match="part 'egg': the motion uses keys sit, lean, the target has sit, jump"):
        targets(Cast((CastPart("egg", keys),)), motion)
    with pytest.raises(InputError, match="the target has sit:"):
        targets(cast_of(worm[0], motion), motion)


def test_unknown_parts_names_and_kinds_are_refused(worm, motion, tmp_path):
    with pytest.raises(InputError, match="no part 'tail'"):
        targets(Cast((CastPart("tail", (), "a.svg"),)), motion)
    (tmp_path / "worm_run.svg").write_text("")
    with pytest.raises(InputError, match=r"worm_run\.svg ends in none of egg_sit, sit, egg_lean, lean"):
        cast_of(tmp_path, motion)
    (tmp_path / "other_sit.svg").write_text("")
    with pytest.raises(InputError, match="both end in the name of key 'sit'"):
        cast_of([*worm, tmp_path / "other_sit.svg"], motion)
    with pytest.raises(InputError, match="must all be SVG"):
        targets(Cast((CastPart("egg", (), "a.pdf"),)), motion)
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="it has none"):
        cast_of(tmp_path / "empty", motion)


MODEL = "v 0 0 0\nv 1 0 0\nv 1 2 0\nv 0 2 1\nf 1 2 3\nf 1 3 4\n"


def test_a_model_is_cast_with_its_plane_and_what_depth_does(tmp_path, motion):
    (tmp_path / "fox.obj").write_text(MODEL)
    path = tmp_path / "c.cast.toml"
    path.write_text(
        '[[parts]]\nname = "egg"\ndrawing = "fox.obj"\nplane = "zy"\ndepth = "volume"\ndistance = 3\npivot = [0, 2, 1]\n'
    )
    (target,) = targets(read_cast(path), motion)
    assert target.view[:, :3].tolist() == [[0, 0, 1], [0, -1, 0], [-1, 0, 0]]
    assert target.depth is lift.keeping_volume and target.distance == 3 and target.pivot.tolist() == [0, 2, 1]
    assert draw(perform(motion, [target]), 0)[..., 3].max() == 255


def test_the_cast_of_a_model_read_back_is_that_cast(tmp_path):
    keys = (CastKey("sit", "a.glb"), CastKey("lean", "a.glb", morphs={"Key 1": 0.5, 'qu"ote': -1.0}))
    alone = CastPart("lid", (), "b.obj", plane="-zy", carried=True)
    solid = CastPart("egg", keys, pivot=(1.0, 2.0, 3.0), plane=(-1.0, 0.5, 1.0), depth="even", distance=2.0)
    write_cast(Cast((solid, alone), folder=tmp_path), tmp_path / "egg.cast.toml")
    assert read_cast(tmp_path / "egg.cast.toml").parts == (solid, alone)


def test_a_model_without_keys_can_be_lent_the_sources_bends(tmp_path, motion):
    (tmp_path / "fox.obj").write_text(MODEL)
    (tmp_path / "c.cast.toml").write_text('[[parts]]\nname = "egg"\ndrawing = "fox.obj"\ncarried = true\n')
    (target,) = targets(read_cast(tmp_path / "c.cast.toml"), motion)
    assert target.keys.names == ("sit", "lean")
    drawn = affine.apply(target.keys.removed, target.keys.points)
    assert np.abs(drawn[1] - drawn[0]).max() > 0.01


def test_one_model_plays_all_keys_of_the_one_part(tmp_path, motion):
    (tmp_path / "fox.obj").write_text(MODEL)
    cast = cast_of(tmp_path / "fox.obj", motion)
    assert cast.parts[0].carried and targets(cast, motion)[0].keys.names == ("sit", "lean")


def test_models_named_after_the_keys_are_cast_by_their_names(tmp_path, motion):
    for name, text in (("fox_sit.obj", MODEL), ("fox_lean.obj", MODEL.replace("1 2 0", "2 2 0"))):
        (tmp_path / name).write_text(text)
    (target,) = targets(cast_of(tmp_path, motion), motion)
    assert target.keys.names == ("sit", "lean") and target.keys.points.shape == (2, 4, 3)


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ('drawing = "a.obj"\nplane = "yz"', "a plane must be xy, zy"),
        ('drawing = "a.obj"\ndepth = "deep"', "depth must be one of kept, even, volume"),
        ('drawing = "a.obj"\ndistance = 0.5', "distance must be above 1"),
        ('drawing = "a.svg"\ncarried = true', "carried is for a model without keys"),
        ('drawing = "a.obj"\npivot = [1, 2]', r"pivot must be \[x, y, z\] in a model"),
        ('drawing = "a.svg"\npivot = [1, 2, 3]', r"pivot must be \[x, y\] in a drawing"),
        ('drawing = "a.svg"\nplane = "zy"', "plane, depth and distance are for models"),
    ],
)
def test_a_slip_in_the_fields_of_a_model_is_refused(tmp_path, fields, said):
    (tmp_path / "c.cast.toml").write_text(f'[[parts]]\nname = "egg"\n{fields}\n')
    with pytest.raises(InputError, match=said):
        read_cast(tmp_path / "c.cast.toml")


def test_a_cast_stands_on_the_ground_unless_it_says_otherwise(tmp_path, worm, motion):
    path = tmp_path / "worm.cast.toml"
    write_cast(cast_of(worm, motion), path)
    assert read_cast(path).ground
    assert "ground" not in path.read_text(encoding="utf-8")
    write_cast(replace(cast_of(worm, motion), ground=False), path)
    assert not read_cast(path).ground
    path.write_text('ground = "yes"\n' + path.read_text(encoding="utf-8").replace("ground = false\n", ""))
    with pytest.raises(InputError, match=r"Expected `bool`.*ground"):
        read_cast(path)
