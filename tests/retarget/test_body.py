"""One drawing plays several parts: it bends where they meet, moves as a whole with them, and never opens."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from capture.errors import InputError
from capture.motion import affine, keys, parts, tracks, triangulate
from capture.motion.tracks import CartoonMotion, track_of
from retarget.characters.bodies.body import Limb, body
from retarget.characters.bodies.shares import shares_by_lines
from retarget.characters.casts.cast import cast_of, targets
from retarget.characters.casts.castfile import read_cast, write_cast
from retarget.characters.casts.castlist import Cast, CastBody, CastKeep, CastLimb
from retarget.characters.drawings.drawing import outline_drawing
from retarget.commands.lending import retarget
from retarget.stage import staging
from retarget.stage.direct import direct, stays_of
from retarget.stage.draw2d import draw
from retarget.stage.folds import folds
from retarget.stage.perform import perform

RED = np.array([1.0, 0, 0, 1])
FRAMES = 9
UPPER, LOWER, ELBOW = (80, 60, 120, 120), (80, 120, 120, 200), np.array([100.0, 120])


def box(x0, y0, x1, y1):
    """A box's outline (B, 2), a point every five pixels or so."""
    return triangulate.resample(
        np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]], float), int(x1 - x0 + y1 - y0) * 2 // 5
    )


def turns(angles):
    c, s = np.cos(angles), np.sin(angles)
    linear = np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2)
    return np.concatenate([linear, np.zeros((len(angles), 2, 1))], axis=-1)


def motion_of(outlines, maps, pivots, parents):
    """Parts with given outlines, maps about their pivots (T, 2, 3) and parents."""
    found, sets = [], []
    for number, (name, outline) in enumerate(outlines.items()):
        source = keys.keyset(("rest",), np.asarray(outline, float)[None], spacing=8)
        count = len(maps[name])
        plain = affine.about(maps[name], pivots[name])
        weights, none = np.ones((count, 1)), np.zeros(count)
        found.append(
            track_of(name, source, plain, weights, none, pivot=pivots[name], parent=parents.get(name, ""), order=number)
        )
        sets.append(source)
    return CartoonMotion(tuple(found), tuple(sets), np.arange(count) / 24, 24.0, (240, 260))


def bending(most=0.6, frames=FRAMES):
    """An arm that stands on its hand and bends at the elbow; in frame 0 it is straight."""
    maps = {"upper": turns(np.zeros(frames)), "lower": turns(np.linspace(0, most, frames))}
    maps["upper"][:, 0, 2] = np.linspace(0, 30, frames)
    outlines = {"upper": box(*UPPER), "lower": box(*LOWER)}
    return motion_of(outlines, maps, {"upper": np.array([100.0, 60]), "lower": ELBOW}, {"lower": "upper"})


def whole():
    """The whole arm as one drawing."""
    return outline_drawing("arm", keys.keyset(("rest",), box(80, 60, 120, 200)[None], spacing=5), RED)


def areas(mesh, faces):
    corners = mesh[..., faces, :]
    edges = corners[..., 1:, :] - corners[..., :1, :]
    return edges[..., 0, 0] * edges[..., 1, 1] - edges[..., 0, 1] * edges[..., 1, 0]


def test_shares_sum_to_1_and_each_part_has_what_is_far_from_the_seam():
    lines = {
        "upper": Limb(line=np.array([[100.0, 62], [100, 110]])),
        "lower": Limb(line=np.array([[100.0, 122], [100, 198]])),
    }
    regions = {"upper": Limb(region=box(*UPPER)), "lower": Limb(region=box(*LOWER))}
    for told in (None, lines, regions):
        made = body(whole(), bending(), told, seam=20.0)
        points = made.shapes(np.zeros((1, 3)))[0]
        np.testing.assert_allclose(made.shares.sum(axis=1), 1, atol=1e-12)
        assert made.shares.min() >= 0 and made.parts == ("upper", "lower")
        middle = 120 if told is not lines else 116  # half-way between the lines' ends
        above, below = points[:, 1] < middle - 21, points[:, 1] > middle + 21
        np.testing.assert_allclose(made.shares[above, 0], 1, atol=1e-9)
        np.testing.assert_allclose(made.shares[below, 1], 1, atol=1e-9)
        near = np.abs(points[:, 1] - middle) < 4
        assert (made.shares[near].max(axis=1) < 0.95).all()


def test_a_seam_never_opens_nor_folds_in_a_moderate_bend():
    motion = bending(0.6)
    performance = perform(motion, [body(whole(), motion, seam=30.0)])
    doubled = areas(performance.roles[0].mesh(), whole().keys.faces)
    assert (doubled * np.sign(doubled[0]) > 0).all()


def test_a_body_that_turns_inside_out_is_told():
    """Were its left half the lower arm, from top to bottom, it would swing through the right half."""
    motion = bending(1.5)
    sides = {"upper": Limb(region=box(100, 60, 120, 200)), "lower": Limb(region=box(80, 60, 100, 200))}
    (found,) = folds(perform(motion, [body(whole(), motion, sides, seam=20.0)]))
    assert folds(perform(bending(0.6), [body(whole(), bending(0.6), seam=30.0)])) == []
    assert found.worst == FRAMES - 1 and found.share > 0.06 and "arm: it folds over itself in" in str(found)


def test_parts_that_lie_apart_move_as_if_each_played_its_own():
    """Two boxes in one drawing, each a part: shares are 0 and 1, and the result is that of two drawings."""
    motion = motion_of(
        {"left": box(40, 100, 80, 180), "right": box(140, 100, 180, 180)},
        {"left": turns(np.linspace(0, 1.2, 5)), "right": turns(np.linspace(0, -0.7, 5))},
        {"left": np.array([60.0, 100]), "right": np.array([160.0, 180])},
        {"right": "left"},
    )
    apart = [motion.keyset(part) for part in ("left", "right")]
    count = apart[0].points.shape[1]
    both = replace(
        apart[0],
        points=np.concatenate([one.points for one in apart], axis=1),
        faces=np.concatenate([apart[0].faces, apart[1].faces + count]),
        outline=np.concatenate([apart[0].outline, apart[1].outline + count]),
    )
    one = perform(motion, [body(outline_drawing("both", both, RED), motion, seam=5.0)]).roles[0].mesh()
    each = [
        role.mesh()
        for role in perform(motion, [outline_drawing(p, motion.keyset(p), RED) for p in ("left", "right")]).roles
    ]
    np.testing.assert_allclose(one, np.concatenate(each, axis=1), atol=1e-9)


def test_a_similarity_of_all_parts_moves_the_body_as_a_whole():
    still = bending(0.0)
    turn = turns(np.linspace(0, 2, FRAMES)) * np.linspace(1, 1.4, FRAMES)[:, None, None]
    turn[:, :, 2] = [[7.0, -3.0]] * FRAMES
    turn[0] = np.eye(2, 3)
    upper = replace(still.tracks[0], affine=affine.from_about(affine.about(turn, [100.0, 60]), still.tracks[0].pivot))
    motion = replace(still, tracks=(upper, still.tracks[1]))
    made = body(whole(), motion, seam=30.0)
    moved = perform(motion, [made]).roles[0].points
    place = affine.fit_similarity(moved[0], moved)
    np.testing.assert_allclose(moved, affine.apply(place, moved[0]), atol=1e-9)
    np.testing.assert_allclose(place[:, :, :2], turn[:, :, :2], atol=1e-9)


def test_what_is_drawn_is_the_equation_of_shares_shapes_and_maps():
    """On the source's own mesh the body is what `parts.body` says, which capture is made by."""
    motion = bending()
    mesh = keys.keyset(("rest",), box(80, 60, 120, 200)[None], spacing=5)
    made = body(outline_drawing("arm", mesh, RED), motion, seam=30.0)
    shares = made.shares[: mesh.points.shape[1]]
    known = parts.body(replace(motion, keysets=(mesh, mesh)), shares)
    np.testing.assert_allclose(perform(motion, [made]).roles[0].mesh(), known, atol=1e-9)


def test_the_pose_it_is_drawn_in_can_be_any_frame_of_the_source():
    motion = bending()
    straight = perform(motion, [body(whole(), motion, seam=30.0)]).roles[0].mesh()
    shape = keys.KeySet(
        ("rest",), straight[5][None], whole().keys.faces, whole().keys.outline, np.zeros((1, 3)), np.eye(2, 3)[None]
    )
    bent = outline_drawing("arm", shape, RED)
    again = perform(motion, [body(bent, motion, seam=30.0, frame=5)]).roles[0].mesh()
    np.testing.assert_allclose(again[5], straight[5], atol=2)  # its box is not quite the source's
    far = [100.0, 195.0]
    end = int(np.linalg.norm(straight[0] - far, axis=1).argmin())
    np.testing.assert_allclose(again[:, end] - again[5, end], straight[:, end] - straight[5, end], atol=0.5)
    assert body(whole(), motion).frame == 0  # told by the keys


def test_limbs_can_be_turned_to_lie_as_the_sources_do():
    """A drawing with its lower half bent by 40 degrees hangs as straight as the source, where its lines are turned."""
    motion, angle = bending(), np.radians(40)
    mesh = keys.keyset(("rest",), box(80, 60, 120, 200)[None], spacing=5)
    below = np.clip((mesh.points[0, :, 1:] - 110) / 20, 0, 1)
    turned = affine.apply(affine.about(turns(np.array([angle]))[0], ELBOW), mesh.points[0])
    bent = replace(mesh, points=((1 - below) * mesh.points[0] + below * turned)[None])
    end = affine.apply(affine.about(turns(np.array([angle]))[0], ELBOW), np.array([[100.0, 198]]))[0]
    told = {"upper": Limb(line=np.array([[100.0, 62], [100, 118]])), "lower": Limb(line=np.array([ELBOW, end]))}
    drawn = outline_drawing("arm", bent, RED)
    low = mesh.points[0, :, 1] > 150
    axis = []
    for turn in (False, True):
        shown = perform(motion, [body(drawn, motion, told, seam=20.0, turned=turn)]).roles[0].mesh()[0, low]
        axis.append(affine.turn(affine.fit_similarity(mesh.points[0, low], shown)))
    np.testing.assert_allclose(axis, [angle, 0], atol=1e-6)


def test_an_arm_that_hangs_beside_its_body_is_not_divided_as_the_crow_flies():
    """A U: two uprights 10 apart, joined below; each line's upright is its own, however near the other is."""
    ring = np.array([[0, 0], [30, 0], [30, 160], [40, 160], [40, 0], [60, 0], [60, 200], [0, 200]], float)
    mesh = keys.keyset(("rest",), ring[None], spacing=6)
    points = mesh.points[0]
    lines = [np.array([[4.0, 190], [4, 5]]), np.array([[50.0, 150], [50, 5]])]
    shares = shares_by_lines(points, mesh.faces, lines, 10.0)
    upper = points[:, 1] < 120
    np.testing.assert_allclose(shares[upper & (points[:, 0] <= 30), 0], 1, atol=1e-6)
    np.testing.assert_allclose(shares[upper & (points[:, 0] >= 40), 1], 1, atol=1e-6)


ARM = """<svg xmlns="http://www.w3.org/2000/svg" width="240" height="260">
<path id="sleeve" d="M80,60 H120 V200 H80 Z" fill="#c04040"/>
<g id="watch"><circle cx="100" cy="150" r="8" fill="gold"/><path d="M100,150 V145" stroke="black" stroke-width="1"/></g>
<path id="flag" d="M100,100 H160 V110 H100 Z" fill="blue"/></svg>"""


def test_elements_named_are_all_of_their_part_and_the_others_bend(tmp_path):
    (tmp_path / "arm.svg").write_text(ARM)
    motion = bending()
    cast = Cast(
        bodies=(CastBody("arm.svg", (CastLimb("upper"), CastLimb("lower", elements=("watch", "flag"))), seam=20.0),),
        folder=tmp_path,
    )
    (made,) = targets(cast, motion)
    performance = perform(motion, [made])
    first, last = performance.posed(0), performance.posed(FRAMES - 1)
    lower = tracks.total_affine(motion, "lower")[-1]
    for number in (1, 2, 3):  # the watch, its hand, and the flag, also above the elbow
        np.testing.assert_allclose(last[number].points, affine.apply(lower, first[number].points), atol=1e-6)
    upper = tracks.total_affine(motion, "upper")[-1]
    np.testing.assert_allclose(last[0].points, affine.apply(upper, first[0].points), atol=1e-6)  # all that is left
    piled, _ = direct(performance, replace(cast, bodies=(replace(cast.bodies[0], order=7),)), motion)
    assert (piled.roles[0].order == 7).all()
    unknown = replace(cast, bodies=(replace(cast.bodies[0], parts=(CastLimb("upper", elements=("hat",)),)),))
    with pytest.raises(InputError, match="element or group 'hat', it has ids flag, sleeve, watch"):
        targets(unknown, motion)


def test_a_body_on_the_ground_stands_and_its_feet_are_those_of_its_parts():
    motion = bending()
    lift = motion.tracks[0].affine.copy()
    lift[:, :, 2] = 0
    motion = replace(motion, tracks=(replace(motion.tracks[0], affine=lift), motion.tracks[1]))
    made = replace(body(whole(), motion, seam=30.0), height=1.5)
    performance = perform(motion, [made])
    assert set(performance.roles[0].of("upper")) | set(performance.roles[0].of("lower")) == set(
        range(made.keys.points.shape[1])
    )
    stood, _ = direct(performance, Cast(bodies=(CastBody("arm.svg"),)), motion)
    assert np.isfinite(stood.roles[0].points).all()
    stay = staging.Stay("lower", 2, 5, performance.roles[0].of("lower")[:3])
    foot = staging.foot_of(staging.keep(performance, [stay]), stay)
    assert np.ptp(foot[2:5], axis=0).max() < 1e-9


def test_a_leg_of_a_body_bends_for_its_foot_and_its_seams_hold():
    """A figure of trunk, thigh and shin in one drawing glides to the right; its sole stays, the trunk goes on."""
    outlines = {"trunk": box(80, 20, 120, 80), "thigh": box(85, 80, 115, 140), "shin": box(85, 140, 115, 200)}
    maps = {
        part: turns(np.append(0.0, np.full(11, angle)))
        for part, angle in (("trunk", 0.0), ("thigh", -0.4), ("shin", 0.8))
    }
    maps["trunk"][:, 0, 2] = 3.0 * np.arange(12)
    pivots = {part: np.array([100.0, y]) for part, y in (("trunk", 80), ("thigh", 80), ("shin", 140))}
    motion = motion_of(outlines, maps, pivots, {"thigh": "trunk", "shin": "thigh"})
    ring = keys.keyset(("rest",), box(85, 20, 115, 200)[None], spacing=6)
    whole = outline_drawing("figure", ring, RED)
    lines = {
        part: Limb(line=np.array([[100.0, y], [100, end]]))
        for part, y, end in (("trunk", 78, 25), ("thigh", 82, 136), ("shin", 142, 195))
    }
    made = body(whole, motion, lines, seam=32.0)  # drawn as in frame 0, straight
    performance = perform(motion, [made])
    shift = staging.shifted(performance, np.tile([5.0, -2.0], (12, 1)))  # the joints go along
    told = CastKeep("shin", (4, 8))
    bent, slid = direct(shift, Cast(bodies=(CastBody("a.svg"),), keep=(told,), ground=False), motion)
    before, after = shift.roles[0].mesh(), bent.roles[0].mesh()
    sole = (ring.points[0, :, 1] > 198) & (made.shares[: len(ring.points[0]), 2] > 1 - 1e-12)
    foot = after[:, sole].mean(axis=1)
    (stay,) = stays_of(shift, told, motion)
    slides = [np.ptp(staging.foot_of(played, stay)[4:9], axis=0).max() for played in (shift, bent)]
    assert slides[0] == pytest.approx(12) == slid.before and slides[1] < 1e-9
    assert np.ptp(foot[4:9], axis=0).max() < 4  # it rolls
    trunk = made.shares[: len(ring.points[0]), 0] > 1 - 1e-12
    np.testing.assert_allclose(after[:, trunk], before[:, trunk], atol=1e-9)
    doubled = areas(after, ring.faces)
    assert (doubled * np.sign(areas(ring.points[0], ring.faces)) > 0).all()


def test_pictures_and_models_are_bodies_too(tmp_path):
    motion = bending()
    pixels = np.zeros((160, 80, 4), np.uint8)
    pixels[10:150, 20:60] = (200, 60, 60, 255)
    Image.fromarray(pixels).save(tmp_path / "arm.png")
    (tmp_path / "arm.obj").write_text(_strip())
    for name in ("arm.png", "arm.obj"):
        (made,) = targets(Cast(bodies=(CastBody(name),), folder=tmp_path), motion)
        performance = perform(motion, [made])
        first, last = (draw(performance, t)[..., 3] / 255 for t in (0, FRAMES - 1))
        assert first.sum() == pytest.approx(40 * 140, rel=0.005)
        inside = (slice(70, 190), slice(90, 110))
        assert first[inside].min() == 1
        end = affine.apply(tracks.total_affine(motion, "lower")[-1], np.array([[100.0, 190], [100, 150], [100, 80]]))
        end[2] = [130, 80]  # the upper part has moved by 30
        assert all(last[round(y), round(x)] == 1 for x, y in end)
        assert last.sum() == pytest.approx(first.sum(), rel=0.06)


def test_an_arm_that_swings_before_its_body_in_one_picture_leaves_no_rim_of_nothing(tmp_path):
    pixels = np.zeros((240, 240, 4), np.uint8)
    pixels[40:200, 60:140] = (60, 60, 200, 255)  # a trunk
    pixels[60:85, 140:200] = (200, 60, 60, 255)  # and an arm to its right
    Image.fromarray(pixels).save(tmp_path / "figure.png")
    maps = {"trunk": turns(np.zeros(2)), "arm": turns(np.array([0.0, 1.9]))}
    pivots = {"trunk": np.array([100.0, 200]), "arm": np.array([140.0, 72])}
    outlines = {"trunk": box(59.5, 39.5, 139.5, 199.5), "arm": box(139.5, 59.5, 199.5, 84.5)}
    motion = motion_of(outlines, maps, pivots, {"arm": "trunk"})
    (made,) = targets(Cast(bodies=(CastBody("figure.png", seam=20.0),), folder=tmp_path), motion)
    assert len(made.layers) == 2
    inside = (slice(100, 190), slice(70, 130))
    layered, flat = (draw(perform(motion, [one]), 1)[inside] for one in (made, replace(made, layers=())))
    red = layered[..., 0] > 130
    assert 300 < red.sum() < 2000 and layered[..., 3].min() == 255
    assert flat[..., 3].min() == 0  # as it would be


def test_a_body_is_cast_written_and_read_back(tmp_path):
    limbs = (
        CastLimb("upper", ((1.0, 2.0), (3.0, 4.5)), elements=("a b", 'c"')),
        CastLimb("lower", region=((1.0, 2.0), (3.0, 4.5), (0.0, 9.0)), pivot=(0.1, 0.2)),
    )
    full = CastBody("a.svg", limbs, "straight", 1.5, 12.0, 3, True, (1.0, 2.0, 3.0, 4.0), "zy", "volume", 4)
    cast = Cast(bodies=(full, CastBody("b.svg")), folder=tmp_path)
    write_cast(cast, tmp_path / "a.cast.toml")
    assert read_cast(tmp_path / "a.cast.toml") == cast


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('drawing = ""', "a body must have a drawing"),
        ('drawing = "a.svg"\nseam = 0', "height and seam must be above 0"),
        ('drawing = "a.svg"\nseams = 3', "'seams' is no field"),
        ('drawing = "a.svg"\n[[bodies.parts]]\nname = "x"\nline = [[1, 2]]', "a line must have 2 points"),
        (
            'drawing = "a.svg"\n[[bodies.parts]]\nname = "x"\n[[bodies.parts]]\nname = "x"',
            "each part must be named once",
        ),
        ('drawing = "a.svg"\n[[bodies.parts]]\nname = "x"\nlines = 3', "'lines' is no field"),
    ],
)
def test_a_body_with_a_slip_is_refused_by_name(tmp_path, text, said):
    (tmp_path / "c.cast.toml").write_text(f"[[bodies]]\n{text}\n")
    with pytest.raises(InputError, match=said):
        read_cast(tmp_path / "c.cast.toml")


def test_bodies_that_cannot_be_are_refused():
    motion = bending()
    line = Limb(line=np.array([[100.0, 62], [100, 110]]))
    with pytest.raises(InputError, match="2 parts have 1 lines and 0 regions"):
        body(whole(), motion, {"upper": line, "lower": Limb()})
    with pytest.raises(InputError, match="must have a line for every part"):
        body(whole(), motion, turned=True)
    with pytest.raises(InputError, match="frames 0 to 8, got 9"):
        body(whole(), motion, frame=9)
    with pytest.raises(InputError, match="no part 'tail'"):
        body(whole(), motion, {"tail": Limb()})
    with pytest.raises(InputError, match="played by one target only"):
        perform(motion, [body(whole(), motion), outline_drawing("lower", motion.keyset("lower"), RED)])


def test_the_command_lets_one_drawing_play_all_parts(tmp_path):
    (tmp_path / "arm.svg").write_text(ARM)
    tracks.save(bending(), tmp_path / "arm.motion.json")
    (tmp_path / "arm.cast.toml").write_text('[[bodies]]\ndrawing = "arm.svg"\n')
    said = retarget(tmp_path / "arm.motion.json", tmp_path / "out.svg", cast=tmp_path / "arm.cast.toml")
    assert "new drawings play upper, lower" in said
    again = retarget(tmp_path / "arm.motion.json", tmp_path / "again.svg", drawing=(tmp_path / "arm.svg",))
    assert again.replace("again", "out") == said
    assert (tmp_path / "again.svg").read_bytes() == (tmp_path / "out.svg").read_bytes()
    assert cast_of(tmp_path / "arm.svg", bending()).bodies[0].parts == ()
    (tmp_path / "lower.svg").write_text(ARM)
    assert cast_of(tmp_path / "lower.svg", bending()).parts[0].name == "lower"  # its name says so


def _strip():
    """A thin board of 2 by 7 units, in squares of a half."""
    x, y = np.meshgrid(np.arange(5) / 2, np.arange(15) / 2)
    text = "".join(f"v {a} {b} 0\n" for a, b in zip(x.ravel(), y.ravel(), strict=True))
    for row in range(14):
        for column in range(4):
            a = row * 5 + column + 1
            text += f"f {a} {a + 1} {a + 6}\nf {a} {a + 6} {a + 5}\n"
    return text
