"""A motion is the same after its file, parts hang on their parents, and a contradiction gets neither in nor out."""

import json
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from capture.errors import InputError
from capture.motion import tracks
from capture.motion.keys import KeySet, align, inbetween_rows, rigid, shapes, straight
from capture.motion.tracks import CartoonMotion, Track
from fixtures import maps

relaxed = settings(deadline=None, max_examples=15, derandomize=True)
SQUARE = np.array([(0, 0), (10, 0), (10, 10), (0, 10)], float)


def make(frames=3, part="body", parent="", pivot=(5.0, 5.0), keys=("low", "high"), **changes):
    """One part: a square, and for a second key the same square with a corner pulled out."""
    drawn = np.stack([SQUARE + np.outer((0, 0, k, 0), (8, 4)) for k in range(len(keys))])
    shapes, removed = align(drawn, np.arange(4))
    rows = inbetween_rows(len(keys), 1)
    weights = np.zeros((frames, len(rows)))
    weights[:, 0] = 1
    own = {
        "part": part,
        "parent": parent,
        "pivot": np.array(pivot),
        "keys": keys,
        "rows": rows,
        "affine": np.tile(np.eye(2, 3), (frames, 1, 1)),
        "weights": weights,
        "residual": np.linspace(0, 0.5, frames),
        "visible": np.arange(frames) % 2 == 0,
        "held": np.arange(frames) % 2 == 1,
        "order": np.arange(frames),
    }
    keyset = KeySet(keys, shapes, np.array([(0, 1, 2), (0, 2, 3)]), np.arange(4), rows, removed)
    return Track(**{**own, **changes}), keyset


def motion_of(*parts, frames=3):
    own, keysets = zip(*(parts or (make(frames),)))
    return CartoonMotion(own, keysets, np.arange(frames) / 24, 24.0, (64, 48))


def same(a, b):
    """Equal in every bit, kind of array included."""
    if isinstance(a, CartoonMotion | Track | KeySet):
        return all(same(getattr(a, field.name), getattr(b, field.name)) for field in fields(a))
    if isinstance(a, tuple):
        return type(a) is type(b) and len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and np.array_equal(a, b)
    return type(a) is type(b) and a == b


# -- the file -------------------------------------------------------------------------------------------------

any_float = st.floats(-1e100, 1e100)


@given(
    placed=arrays(float, (3, 2, 3), elements=any_float),
    points=arrays(float, (2, 4, 2), elements=any_float),
    residual=arrays(float, 3, elements=any_float),
    order=arrays(int, 3, elements=st.integers(-(2**62), 2**62)),
    fps=st.floats(0, exclude_min=True, allow_infinity=False),
    part=st.text(),
    names=st.tuples(st.text(), st.text()),
)
@relaxed
def test_a_motion_that_went_through_its_file_is_the_same_motion(
    tmp_path_factory, placed, points, residual, order, fps, part, names
):
    track, keyset = make(affine=placed, residual=residual, order=order, part=part, keys=names)
    motion = motion_of((track, replace(keyset, points=points)))
    motion = replace(motion, fps=fps, times=np.sort(np.random.default_rng(0).normal(size=3)), space="metres, y up")
    path = tmp_path_factory.mktemp("motion") / "a.motion.json"
    tracks.save(motion, path)
    assert same(tracks.load(path), motion)


def test_a_motion_in_space_goes_through_its_file_too(tmp_path):
    track, keyset = make(pivot=(1.0, 2.0, 3.0), affine=np.tile(np.eye(3, 4), (3, 1, 1)))
    deep = np.concatenate([keyset.points, np.ones((2, 4, 1))], axis=-1)
    motion = motion_of((track, replace(keyset, points=deep, removed=np.tile(np.eye(3, 4), (2, 1, 1)))))
    tracks.save(motion, tmp_path / "a.motion.json")
    assert same(tracks.load(tmp_path / "a.motion.json"), motion)


def test_the_file_can_be_read_by_a_person(tmp_path):
    """A frame, a row or a key is a line; the file is JSON that says what it is in its first line."""
    tracks.save(motion_of(make(frames=50), frames=50), tmp_path / "a.motion.json")
    text = (tmp_path / "a.motion.json").read_text()
    lines = text.splitlines()
    assert json.loads(text)["tooncap"] == "motion" and '"tooncap": "motion"' in lines[1]
    at = next(n for n, line in enumerate(lines) if '"affine"' in line)
    frames = [json.loads(line.rstrip(",")) for line in lines[at + 1 : at + 51]]
    assert frames == np.tile(np.eye(2, 3), (50, 1, 1)).tolist() and lines[at + 51].strip() == "],"


def test_a_newer_motion_is_written_over_an_older_one_whole(tmp_path):
    path = tmp_path / "a.motion.json"
    tracks.save(motion_of(make(frames=50), frames=50), path)
    tracks.save(motion_of(), path)
    assert len(tracks.load(path).times) == 3 and list(tmp_path.iterdir()) == [path]


def stored(tmp_path):
    tracks.save(motion_of(), tmp_path / "good.motion.json")
    return (tmp_path / "good.motion.json").read_bytes()


def assert_refused(path):
    with pytest.raises(InputError) as caught:
        tracks.load(path)
    message = str(caught.value)
    assert "\n" not in message and message.count(str(path)) == 1  # one sentence, and it names the file


def test_a_file_that_is_not_there_is_one_sentence(tmp_path):
    assert_refused(tmp_path / "none.motion.json")


@pytest.mark.parametrize(
    "content",
    [b"", b"{", b"[]", b"3", b"\xff\xfe\x00", b"[" * 100_000, b'{"tooncap": "shot"}', b'{"tooncap": "motion"}'],
)
def test_a_file_that_is_no_motion_is_one_sentence(tmp_path, content):
    (tmp_path / "a.motion.json").write_bytes(content)
    assert_refused(tmp_path / "a.motion.json")


def test_a_file_that_broke_off_is_one_sentence(tmp_path):
    whole = stored(tmp_path)
    for end in range(0, len(whole) - 2, 97):
        (tmp_path / "a.motion.json").write_bytes(whole[:end])
        assert_refused(tmp_path / "a.motion.json")


def test_bytes_that_are_no_text_are_one_sentence(tmp_path):
    (tmp_path / "a.motion.json").write_bytes(stored(tmp_path).replace(b"body", b"bo\xffdy"))
    assert_refused(tmp_path / "a.motion.json")


WRONG = {
    "version": [0, "one", None],
    "fps": [0, -24, "quick", None, [], 10**400],
    "size": [[], [64], [0, 48], "ab", None],
    "times": [[], 3, [0, 1], [0, 2, 1], [0, 0, 1], [0, None, 1], "abc", [[0, 1, 2]]],
    "tracks": [[], None, "abc", [None], [3], {}],
    "keysets": [[], None, [None]],
    "tracks/part": [None, 3],
    "tracks/parent": ["nobody", "body", None],
    "tracks/pivot": [3, [1], [1, 2, 3], [[1, 2], [3, 4]], [None, 1], [10**400, 1]],
    "tracks/keys": [["low"], ["low", "other"], [1, 2], None],
    "tracks/rows": [[], [[0, 0, 0]], [[2, 2, 0]] * 3, [[-1, 0, 0]] * 3, [[0.5, 0, 0]] * 3, [[0, 0]] * 3],
    "tracks/affine": [[], "abc", [[[1, 0, 0], [0, 1]]] * 3, [[1, 0, 0]] * 3, [[[1, 0, 0], [0, 1, None]]] * 3],
    "tracks/weights": [[], [[1, 0, 0]], [[1, 1, 0]] * 3, [["1", "0", "0"]] * 3],
    "tracks/visible": [[True], ["no"] * 3, [0.5] * 3],
    "tracks/order": [[1.5] * 3, [1e30] * 3, [None] * 3],
    "keysets/points": [[], [[[0, 0]] * 4], [[1, 2], [3, 4]], [[[0, None]] * 4] * 2],
    "keysets/faces": [[[0, 1, 4]], [[0, 1, -1]], [[0, 1]], [[0, 1, 1.5]]],
    "keysets/outline": [[0, 1, 99], [[0, 1]]],
    "keysets/removed": [[]],
}


@pytest.mark.parametrize("place", WRONG)
def test_a_wrong_or_missing_value_is_one_sentence(tmp_path, place):
    for value in [*WRONG[place], "missing"]:
        content = json.loads(stored(tmp_path))
        group, _, name = place.rpartition("/")
        owner = content[group][0] if group else content
        owner[name] = value
        if value == "missing":
            del owner[name]
        (tmp_path / "a.motion.json").write_text(json.dumps(content))
        assert_refused(tmp_path / "a.motion.json")


def test_the_same_part_twice_is_refused(tmp_path):
    content = json.loads(stored(tmp_path))
    content["tracks"] *= 2
    content["keysets"] *= 2
    (tmp_path / "a.motion.json").write_text(json.dumps(content))
    assert_refused(tmp_path / "a.motion.json")


@pytest.mark.parametrize("name", ["affine", "weights", "residual", "pivot", "rows"])
def test_no_nan_is_ever_stored(tmp_path, name):
    track, keyset = make()
    broken = getattr(track, name).copy()
    broken.flat[0] = np.nan
    with pytest.raises(InputError, match=r"'body'.*finite"):
        tracks.save(motion_of((replace(track, **{name: broken}), keyset)), tmp_path / "a.motion.json")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["affine", "weights", "residual", "visible", "held", "order"])
def test_a_track_with_a_frame_too_few_is_refused(name):
    track, keyset = make()
    with pytest.raises(InputError, match=f"'body': {name} must have shape"):
        tracks.check(motion_of((replace(track, **{name: getattr(track, name)[1:]}), keyset)))


def test_checking_returns_the_motion_itself():
    motion = motion_of()
    assert tracks.check(motion) is motion


# -- parts, parents and points --------------------------------------------------------------------------------


def test_points_are_the_mixed_shape_placed_by_the_map_about_the_pivot():
    weights = np.array([(1, 0, 0), (0.25, 0.75, 0), (0, 0, 1.0)])
    quarter = np.array([[0, -1, 100], [1, 0, 0]], float)
    motion = motion_of(make(weights=weights, affine=np.tile(quarter, (3, 1, 1))))
    for rule in (rigid, straight):
        low, high, middle = shapes(motion.keysets[0], rule)
        for found, shape in zip(motion.points("body", rule), (low, 0.25 * low + 0.75 * high, middle), strict=True):
            assert np.allclose(found, (shape - 5) @ [[0, 1], [-1, 0]] + 5 + (100, 0))
    assert np.allclose(motion.outline("body"), motion.points("body"))  # all of a square's corners are on its outline


def chain():
    """A body that turns and travels, an arm on it, a hand on the arm."""
    rng = np.random.default_rng(2)

    def moving():
        return np.stack([np.column_stack([maps.turn(rng.normal()), rng.normal(size=2)]) for _ in range(3)])

    arm, hand = {"pivot": (10.0, 0.0)}, {"pivot": (30.0, 2.0)}
    return motion_of(
        make(part="hand", parent="arm", affine=moving(), **hand),  # children may come before their parents
        make(affine=moving()),
        make(part="arm", parent="body", affine=moving(), **arm),
    )


def test_a_part_is_moved_by_its_own_map_then_by_its_parents():
    motion = chain()
    hand, body, arm = motion.tracks

    def act(track, points):
        return maps.move(track.affine, points - track.pivot) + track.pivot

    assert np.allclose(motion.points("hand"), act(body, act(arm, act(hand, np.stack([SQUARE] * 3)))))
    assert np.allclose(motion.points("arm"), act(body, act(arm, np.stack([SQUARE] * 3))))


def test_a_target_brings_its_own_pivots_and_size():
    motion = chain()
    hand, body, arm = motion.tracks
    pivots = {"hand": np.array([60.0, 0]), "arm": np.array([20.0, 0]), "body": np.array([0.0, 0])}

    def act(track, points):
        pivot = pivots[track.part]
        return (points - pivot) @ track.affine[:, :, :2].swapaxes(1, 2) + pivot + 2.5 * track.affine[:, None, :, 2]

    total = tracks.total_affine(motion, "hand", pivots, scale=2.5)
    assert np.allclose(maps.move(total, SQUARE), act(body, act(arm, act(hand, np.stack([SQUARE] * 3)))))


def test_parts_in_a_circle_and_strangers_are_refused():
    circle = motion_of(make(part="a", parent="b"), make(part="b", parent="a"))
    with pytest.raises(InputError, match="its own parent"):
        tracks.total_affine(circle, "a")
    with pytest.raises(InputError, match="its own parent"):
        tracks.check(circle)
    with pytest.raises(InputError, match=r"body.*'tail'"):
        motion_of().points("tail")


def test_weights_are_folded_onto_keys():
    weights = np.array([(1, 0, 0), (0.25, 0.75, 0), (0, 0, 1.0)])
    assert np.allclose(make(weights=weights)[0].key_weights(), [(1, 0), (0.25, 0.75), (0.5, 0.5)])


def test_the_summary_names_the_worst_frame_and_part():
    shaky = make(part="arm", residual=np.array([0.1, 2.34, 0.2]), visible=np.array([True, False, True]))
    seen = make(visible=np.ones(3, bool))
    assert tracks.summary(motion_of(seen, shaky)) == "2 parts, 3 frames, worst misfit 2.3 px at frame 1 (arm), 1 lost"
    assert tracks.summary(motion_of(seen)) == "1 part, 3 frames, worst misfit 0.5 px at frame 2 (body)"
    assert tracks.worst(shaky[0]) == 1


def test_a_trimmed_motion_is_the_same_motion_for_a_shorter_time():
    motion = chain()
    short = tracks.check(tracks.trim(motion, 1, 3))
    assert np.allclose(short.points("hand"), motion.points("hand")[1:])
    assert np.allclose(short.times, [0, 1 / 24]) and len(short.tracks[0]) == 2
    assert len(motion.times) == 3
