"""A BVH written by hand, with the habits of real ones; where its joints are is worked out by hand."""

import re
import warnings

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from capture.errors import InputError
from mocap.skeletons.bvh import read_bvh, write_bvh
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion

LEG = """HIERARCHY
ROOT Hip
{
  OFFSET 1 2 3
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Left Knee
  {
    OFFSET 0 -4.5 0
    CHANNELS 3 Xrotation Yrotation Zrotation
    End Site
    {
      OFFSET 0 -3.0 0
    }
  }
}
MOTION
Frames: 4
Frame Time: 0.04
0.0 10.0 0.0 0.0 0.0 0.0 0.0 0.0 0.0
0.0 10.0 5.0 90.0 90.0 0.0 -90.0 0.0 0.0
0.0 10.5 5.0 0.0 90.0 0.0 -90.0 0.0 0.0
0.0 10.5 5.0 0.0 90.0 0.0 0.0 0.0 0.0
"""
# a position replaces the offset; in frame 1 the hip turns about z, then about its own x, which the knee undoes
HIPS = np.array([[0, 10, 0], [0, 10, 5], [0, 10.5, 5], [0, 10.5, 5]])
KNEES = HIPS + [[0, -4.5, 0], [0, 0, -4.5], [0, 0, -4.5], [0, 0, -4.5]]
TOES = KNEES + [[0, -3, 0], [3, 0, 0], [0, -3, 0], [0, 0, -3]]
PLACES = np.stack([HIPS, KNEES, TOES], axis=1)


@pytest.fixture
def written(tmp_path):
    """Puts text or bytes into a file."""

    def write(text):
        path = tmp_path / "leg.bvh"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write


def test_joints_go_where_their_channels_say(written):
    motion = read_bvh(written(LEG), strict=True)
    assert motion.skeleton.names == ("Hip", "Left Knee", "Left Knee end") and motion.skeleton.parents == (-1, 0, 1)
    assert motion.fps == 25 and motion.notes == ()
    np.testing.assert_allclose(motion.positions(), PLACES, atol=1e-12)


def _no_blanks_before_minus(text):
    return text.replace(" -", "-")


def _wrapped(text):
    head, frames = text.split("0.04\n")
    words = frames.split()
    return head + "0.04\n" + "\n".join(" ".join(words[i : i + 4]) for i in range(0, len(words), 4)) + "\n"


HABITS = {  # a file's habit, what is done to a good file, and what the notes must speak of
    "a byte order mark": (lambda t: b"\xef\xbb\xbf" + t.encode(), None),
    "UTF-16": (lambda t: t.encode("utf-16"), None),
    "Latin-1": (lambda t: t.replace("Left", "Fuß").encode("latin-1"), "Latin-1"),
    "CR only": (lambda t: t.replace("\n", "\r"), None),
    "CR and LF": (lambda t: t.replace("\n", "\r\n"), None),
    "tabs": (lambda t: t.replace("  ", "\t").replace(": ", ":\t"), None),
    "lower case": (lambda t: re.sub("HIERARCHY|ROOT|JOINT|End Site|OFFSET|CHANNELS|MOTION", _lower, t), None),
    "channels in capitals": (lambda t: re.sub("position|rotation", _upper, t), None),
    "a brace on the joint's line": (lambda t: re.sub(r"\n\s*\{", " {", t), None),
    "a brace stuck to the name": (lambda t: re.sub(r"\n\s*\{", "{", t), None),
    "all joints on one line": (lambda t: t.replace("\n", " ", 15), None),
    "a name with a colon": (lambda t: t.replace("Left Knee", "mixamorig:Left Knee"), None),
    "a name that is a keyword": (lambda t: t.replace("Left Knee", "MOTION"), None),
    "no blank before a minus": (_no_blanks_before_minus, "blanks lack"),
    "wrapped lines": (_wrapped, None),
    "all frames on one line": (lambda t: t.replace(".0\n0", ".0 0"), None),
    "trailing and double blanks": (lambda t: t.replace("\n", "  \n").replace(" 0.0", "   0.0"), None),
    "empty lines between frames": (lambda t: t.replace(".0\n", ".0\n\n"), None),
    "no line end at the end": (lambda t: t.rstrip(), None),
    "decimal commas": (lambda t: re.sub(r"(\d)\.(\d)", r"\1,\2", t), "decimal commas"),
    "commas between numbers": (lambda t: re.sub(r"(\d) (?=[-\d])", r"\1, ", t), "divided by commas"),
    "exponents": (lambda t: t.replace("10.5", "1.05e+01"), None),
    "too many frames promised": (lambda t: t.replace("Frames: 4", "Frames: 99999999"), "there are 4"),
    "too few frames promised": (lambda t: t.replace("Frames: 4", "Frames: 2"), "there are 4"),
    "no frame count": (lambda t: t.replace("Frames: 4\n", ""), "how many frames"),
    "no colons": (lambda t: t.replace("Frames:", "Frames").replace("Time:", "Time"), None),
    "a truncated last line": (lambda t: t + "0.0 10.5 5.0 0.0", "4 numbers of 9"),
    "a brace too few": (lambda t: t.replace("}\nMOTION", "MOTION"), "{ more than }"),
    "a brace too many": (lambda t: t.replace("}\nMOTION", "}\n}\nMOTION"), "} more than {"),
    "a wrong channel count": (lambda t: t.replace("CHANNELS 3", "CHANNELS 6"), "says 6, 3 channels are named"),
    "text before HIERARCHY": (lambda t: "made by hand\n" + t, "before HIERARCHY"),
    "a number that is none": (lambda t: t.replace("10.5 5.0 0.0 90.0 0.0 0", "10.5 nan 0.0 90.0 0.0 0"), "1 numbers of 36"),
    "a Windows NaN": (lambda t: t.replace("10.5 5.0 0.0 90.0 0.0 0", "10.5 -1.#IND 0.0 90.0 0.0 0"), "1 numbers of 36"),
}  # fmt: skip


def _lower(found):
    return found[0].lower()


def _upper(found):
    return found[0].upper()


@pytest.mark.parametrize("habit", HABITS)
def test_each_habit_of_real_files_is_read_like_a_good_file(habit, written):
    bent, spoken = HABITS[habit]
    path = written(bent(LEG))
    motion = read_bvh(path)
    np.testing.assert_allclose(motion.positions(), PLACES, atol=1e-12)
    assert motion.fps == 25 and len(motion.skeleton) == 3
    if spoken is None:
        assert motion.notes == () and read_bvh(path, strict=True).notes == ()
    else:
        assert any(spoken in note for note in motion.notes)
        with pytest.raises(InputError, match="without a fault"):
            read_bvh(path, strict=True)


def test_a_frame_of_the_wrong_length_holds_the_one_before(written):
    short = LEG.replace("0.0 10.5 5.0 0.0 90.0 0.0 -90.0 0.0 0.0", "0.0 10.5 5.0")
    motion = read_bvh(written(short))
    np.testing.assert_allclose(motion.positions(), PLACES[[0, 1, 1, 3]], atol=1e-12)
    assert "the first is 2" in " ".join(motion.notes)


def test_a_number_that_is_none_at_the_start_is_the_first_that_is_one(written):
    motion = read_bvh(written(LEG.replace("0.0 10.0 0.0 0.0 0.0 0.0 0.0", "0.0 nan 0.0 0.0 0.0 0.0 0.0")))
    np.testing.assert_allclose(motion.positions(), PLACES, atol=1e-12)
    nowhere = read_bvh(written(re.sub(r"(?m)^0.0 10.[05] ", "0.0 x ", LEG)))  # the OFFSET stands for what is nowhere
    np.testing.assert_allclose(nowhere.positions()[:, 0, 1], 2)


@pytest.mark.parametrize("step", ["0", "-0.04", "nan", "soon", ""])
def test_a_frame_time_that_says_nothing_is_asked_for(step, written):
    path = written(LEG.replace("Frame Time: 0.04", f"Frame Time: {step}"))
    motion = read_bvh(path)
    assert motion.fps == 30 and "30 frames a second were assumed" in motion.notes[0]
    given_rate = read_bvh(path, fps=12, strict=True)
    assert given_rate.fps == 12
    np.testing.assert_allclose(given_rate.positions(), PLACES, atol=1e-12)


@pytest.mark.parametrize(
    ("said", "fps"),
    [(".033333", 30), ("0.0083333", 120), ("0.016666", 60), ("0.0333", 30), ("0,04", 25), ("0.5", 2), ("4e-2", 25)]
    + [("0.0333667", 29.97), ("0.041708", 23.976)],
)
def test_a_rounded_frame_time_is_the_rate_that_was_meant(said, fps, written):
    assert read_bvh(written(LEG.replace("0.04", said))).fps == pytest.approx(fps, rel=1e-5)


def test_roots_hinges_and_joints_without_channels_are_read(written):
    """A door that turns about y on a frame without channels, and a ball beside it that only moves."""
    text = """HIERARCHY
    ROOT frame { OFFSET 2 0 0 JOINT door { OFFSET 1 0 0 CHANNELS 1 Yrotation End Site { OFFSET 1 0 0 }
    End Site { OFFSET 0 5 0 } } }
    ROOT ball { OFFSET 7 7 7 CHANNELS 2 Zposition Xposition }
    MOTION Frames: 2 Frame Time: 1
    0 1 2
    90 3 4"""
    motion = read_bvh(written(text), strict=True)
    assert motion.skeleton.names == ("frame", "door", "door end", "door end 2", "ball")
    assert motion.skeleton.parents == (-1, 0, 1, 1, -1)
    np.testing.assert_allclose(motion.positions()[0], [[2, 0, 0], [3, 0, 0], [4, 0, 0], [3, 5, 0], [2, 7, 1]])
    np.testing.assert_allclose(
        motion.positions()[1], [[2, 0, 0], [3, 0, 0], [3, 0, -1], [3, 5, 0], [4, 7, 3]], atol=1e-12
    )


@pytest.mark.parametrize(
    "text",
    ["", "HIERARCHY", LEG[:90], "HIERARCHY\nMOTION\nFrames: 1\nFrame Time: 1\n1", LEG.split("0.0 10.0 0.0")[0]]
    + [LEG.replace("  JOINT Left Knee", ""), LEG.replace("0.0\n", "0.0 7.0 7.0\n"), LEG.split("10.0 0.0")[0]]
    + [LEG.replace(".0 ", "o "), LEG.replace("ROOT Hip\n{", ""), "\0\1\2" * 99],
)
def test_what_is_not_a_bvh_is_refused_in_one_sentence(text, written):
    with pytest.raises(InputError, match=r"must be a BVH file of joints and frames, it cannot be read: \w"):
        read_bvh(written(text))


def test_a_file_that_is_not_there_or_a_folder_is_refused(tmp_path):
    with pytest.raises(InputError, match="there is no"):
        read_bvh(tmp_path / "none.bvh")
    with pytest.raises(InputError, match="can be read"):
        read_bvh(tmp_path)


@st.composite
def skeleton_motions(draw):
    """Any topology: several roots, end sites, joints that move against their parents, any turn."""
    count = draw(st.integers(1, 9))
    parents = [-1] + [draw(st.integers(-1, joint - 1)) for joint in range(1, count)]
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    size, frames = 10.0 ** draw(st.integers(-2, 3)), draw(st.integers(1, 5))
    names = [f"{draw(st.sampled_from(['arm', 'Left Knee', 'b:tail', 'Σ', 'end']))} {joint}" for joint in range(count)]
    offsets = rng.normal(0, size, (count, 3)) * rng.integers(0, 2, (count, 1))
    moving = rng.integers(0, 2, (count, 1))
    turns = Rotation.random(frames * count, rng=rng).as_quat().reshape(frames, count, 4)
    for joint, parent in enumerate(parents):
        if joint not in parents and parent >= 0 and draw(st.booleans()):
            names[joint], moving[joint], turns[:, joint] = f"{names[parent]} end", 0, [0, 0, 0, 1]
    translation = offsets + moving * rng.normal(0, size, (frames, count, 3))
    fps = draw(st.sampled_from([12.0, 24000 / 1001, 30.0, 119.88, 240.0]))
    return SkeletonMotion(Skeleton(tuple(names), tuple(parents), offsets), translation, turns, fps)


@given(skeleton_motions())
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_what_is_written_is_read_back(tmp_path, motion):
    write_bvh(motion, tmp_path / "any.bvh")
    again = read_bvh(tmp_path / "any.bvh")
    assert sorted(_base(again.skeleton.names)) == sorted(_base(motion.skeleton.names))
    assert again.fps == pytest.approx(motion.fps, rel=1e-9) and len(again) == len(motion)
    size = np.abs(motion.positions()).max() + 1e-9
    for joint, name in enumerate(motion.skeleton.names):
        parent = motion.skeleton.parents[joint]
        # two end sites of one joint are numbered; their places tell them apart
        same = [j for j, other in enumerate(again.skeleton.names) if _base([other]) == _base([name])]
        gaps = [np.abs(again.positions()[:, j] - motion.positions()[:, joint]).max() for j in same]
        found = same[int(np.argmin(gaps))]
        assert min(gaps) < 1e-5 * size
        above = again.skeleton.parents[found]
        assert (above < 0) if parent < 0 else again.skeleton.names[above] == motion.skeleton.names[parent]
        turned = np.abs((again.rotation[:, found] * motion.rotation[:, joint]).sum(axis=-1))
        np.testing.assert_allclose(turned, 1, atol=1e-9)


def _base(names):
    return [re.sub(r" end \d+$", " end", name) for name in names]


@given(st.lists(st.tuples(st.floats(0, 1), st.integers(0, 6), st.integers(0, 255)), min_size=1, max_size=5))
@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_damage_is_mended_or_refused_and_never_worse(written, damage):
    raw = LEG.encode()
    for where, kind, byte in damage:
        at = int(where * len(raw))
        words = [bytes([byte]), b"", b"{", b"}", b"MOTION", b"1e308", raw[at : at + 60]]
        raw = raw[:at] + words[kind] + raw[at + (kind < 2) :]
    try:
        motion = read_bvh(written(raw))
    except InputError as error:
        assert "\n" not in str(error)
    else:
        assert np.isfinite(motion.positions()).all() and len(motion) >= 1 and motion.fps > 0


def test_a_rubber_limb_keeps_its_stretch_on_file(tmp_path):
    """Joints that move against their parents get position channels, the others do not."""
    skeleton = Skeleton(("hip", "knee", "foot"), (-1, 0, 1), np.array([[0, 0, 0], [0, -1.0, 0], [0, -1.0, 0]]))
    translation = np.tile(skeleton.offsets, (3, 1, 1))
    translation[:, 1, 1] = [-1, -1.6, -0.8]
    write_bvh(SkeletonMotion(skeleton, translation, np.tile([0, 0, 0, 1.0], (3, 3, 1)), 25), tmp_path / "rubber.bvh")
    text = (tmp_path / "rubber.bvh").read_text()
    assert re.findall(r"CHANNELS (\d)", text) == ["6", "6", "3"] and "Frame Time: 0.04\n" in text
    again = read_bvh(tmp_path / "rubber.bvh", strict=True)
    np.testing.assert_allclose(again.positions()[:, 2, 1], [-2, -2.6, -1.8], atol=1e-8)


def test_who_spins_has_angles_that_go_on(tmp_path):
    """Programs mix the angles of neighbouring frames: two whole turns must not be told as four half turns and back."""
    turns = Rotation.from_euler("z", np.arange(0, 721, 30.0)[:, None], degrees=True).as_quat()[:, None]
    skeleton = Skeleton(("wheel",), (-1,), np.zeros((1, 3)))
    write_bvh(SkeletonMotion(skeleton, np.zeros((25, 1, 3)), turns, 25), tmp_path / "wheel.bvh")
    rows = (tmp_path / "wheel.bvh").read_text().split("Frame Time: 0.04\n")[1].split("\n")
    angles = [float(row.split()[3]) for row in rows if row]
    np.testing.assert_allclose(np.diff(angles), 30, atol=1e-6)


def test_another_reader_reads_what_was_written(tmp_path):
    """Joints that move, leaves without an end site, an end site: as bvhio has them."""
    with warnings.catch_warnings():  # it imports its geometry by a name that is going to change
        warnings.simplefilter("ignore")
        bvhio = pytest.importorskip("bvhio", reason="bvhio, the oracle, is not installed")
    rng = np.random.default_rng(5)
    skeleton = Skeleton(("hip", "knee", "knee end", "arm", "tail"), (-1, 0, 1, 0, 0), rng.normal(size=(5, 3)))
    turns = Rotation.random(20, rng=rng).as_quat().reshape(4, 5, 4)
    turns[:, 2] = [0, 0, 0, 1]
    translation = np.tile(skeleton.offsets, (4, 1, 1))
    translation[:, [0, 3]] += rng.normal(size=(4, 2, 3))
    motion = SkeletonMotion(skeleton, translation, turns, 24.0)
    write_bvh(motion, tmp_path / "any.bvh")
    root = bvhio.readAsHierarchy(str(tmp_path / "any.bvh"))
    joints = [joint for joint, _, _ in root.layout()]
    assert [joint.Name for joint in joints] == ["hip", "knee", "arm", "tail"]
    for frame, truth in enumerate(motion.positions()[:, [0, 1, 3, 4]]):
        root.loadPose(frame)
        np.testing.assert_allclose([tuple(joint.PositionWorld) for joint in joints], truth, atol=1e-5)
