"""The Khronos validator finds nothing to say against our files, and three.js plays our own points and pictures."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from capture.fit.action import capture_line
from capture.motion import affine, keys
from capture.motion.tracks import CartoonMotion, track_of
from retarget.characters.drawings.bend import read_bent
from retarget.characters.drawings.drawing import read_drawing
from retarget.characters.photos.picture import read_picture
from retarget.export.bodies import Body, Skin, stage_to_space
from retarget.export.gltf import write_bodies, write_glb
from retarget.export.nodes import lifted
from retarget.stage.draw2d import draw
from retarget.stage.perform import perform

SIZE = (320, 240)
KEYS = ("stand", "lean", "squat")


def beans(count=60):
    """Outlines (3, B, 2) of a bean that stands, leans and squats; no affine map makes one of another."""
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    stand = np.stack([150 + 30 * np.sin(angle), 150 - 50 * np.cos(angle)], axis=-1)
    up = ((200 - stand[:, 1]) / 100)[:, None]
    lean = stand + np.concatenate([45 * up**2, 0 * up], axis=1)
    squat = stand + np.concatenate([(stand[:, :1] - 150) * np.cos(3 * up), 18 * up], axis=1)
    return np.stack([stand, lean, squat])


def mesh():
    return keys.keyset(KEYS, beans(), spacing=9.0)


def motion(frames=12, part="bean", maps=None, weights=None, **changes):
    """Weights between -0.5 and 1.5 over in-betweens, a map that turns, shears, travels and at last mirrors."""
    source = mesh()
    if weights is None:
        weights = np.random.default_rng(7).uniform(-0.5, 1.5, (frames, len(source.rows))) / 4
        weights[::3, 0] = 1.4
        weights[:, 1] += 1 - weights.sum(axis=1)
    track = track_of(part, source, wild_maps(frames) if maps is None else maps, weights, np.zeros(frames))
    track = replace(track, **changes)
    return CartoonMotion((track,), (source,), np.arange(frames) / 24, 24.0, SIZE)


def wild_maps(frames):
    maps = []
    for t in np.linspace(0, 1, frames):
        c, s = np.cos(4 * t), np.sin(4 * t)
        linear = np.array([[c, -s], [s, c]]) @ [[1 + 0.4 * t, 0.8 * t], [0, 1 - 0.3 * t]]
        linear = linear @ np.diag([1 if t < 0.7 else -1, 1])
        middle = np.array([150.0, 150.0])
        maps.append(np.column_stack([linear, middle - linear @ middle + [30 * t, -20 * t]]))
    return np.array(maps)


def calm(frames):
    """Turns and travels only, so that ink keeps its width, and shapes near the keys."""
    maps = []
    for t in np.linspace(0, 1, frames):
        c, s = np.cos(1.2 * t), np.sin(1.2 * t)
        linear = np.array([[c, -s], [s, c]])
        maps.append(np.column_stack([linear, [150, 150] - linear @ [150, 150] + [20 * t, -10 * t]]))
    weights = np.zeros((frames, len(mesh().rows)))
    weights[:, 0], weights[:, 1] = 1 - np.linspace(0, 1, frames), np.linspace(0, 1, frames)
    return {"maps": np.array(maps), "weights": weights}


def bean_svg(outline):
    """A bean as SVG: a body with ink and a gradient, a belt across it, an eye, a hole, and see-through glass."""

    def path(points, paint):
        return f'<path d="M{" L".join(f"{x:.6f},{y:.6f}" for x, y in points)} Z" {paint}/>'

    middle = 0.5 * (outline + outline[::-1])
    belt = np.vstack([outline[18:22], outline[-22:-18]])
    eye = 0.25 * outline[::6] + 0.75 * middle[8]
    glass = 0.45 * outline[::5] + 0.55 * middle[10]
    ink = 'stroke="#202020" stroke-width="3" stroke-linejoin="round"'
    shade = '<linearGradient id="s"><stop offset="0" stop-color="#80c060"/><stop offset="1" stop-color="#f0e080"/>'
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="320" height="240"><defs>{shade}</linearGradient></defs>'
        + path(outline, f'fill="url(#s)" {ink}')
        + path(belt, 'fill="#a03030"')
        + path(eye, f'fill="white" {ink}')
        + path(glass, 'fill="#3060ff" fill-opacity="0.4"')
        + "</svg>"
    )


@pytest.fixture
def drawn(tmp_path):
    files = []
    for name, outline in zip(KEYS, beans(), strict=True):
        files.append(tmp_path / f"bean_{name}.svg")
        files[-1].write_text(bean_svg(outline), encoding="utf-8")
    return files


@pytest.fixture
def photo(tmp_path):
    """A picture with a pattern that has no symmetry, cut out by the bean's outline."""
    y, x = np.mgrid[:240, :320]
    pixels = np.stack([x * 255 // 320, y * 255 // 240, 128 + 100 * np.sin(x / 9) * np.sin(y / 13)], -1)
    Image.fromarray(pixels.astype(np.uint8)).save(tmp_path / "photo.png")
    return tmp_path / "photo.png"


def picture(part, photo):
    return read_picture(part, KEYS, [photo] * 3, list(beans()))


def frame_times(performance):
    return np.float32(performance.times - performance.times[0]).tolist()


def in_space(performance, points):
    return affine.apply(stage_to_space(performance.size), points)


@pytest.mark.parametrize("stepped", [False, True])
def test_three_plays_the_points_of_a_picture(three, tmp_path, photo, stepped):
    """With weights below 0 and above 1, with in-betweens, shear and a mirrored end, smoothly and on twos."""
    playing = motion(14)
    assert playing.tracks[0].weights.min() < -0.1 and playing.tracks[0].weights.max() > 1.1
    if stepped:
        on_twos = np.arange(14) // 2 * 2
        track = playing.tracks[0]
        track = replace(track, affine=track.affine[on_twos], weights=track.weights[on_twos])
        playing = replace(playing, tracks=(track,))
    performance = perform(playing, [picture("bean", photo)])
    write_glb(performance, tmp_path / "bean.glb")
    (shown,) = three(tmp_path / "bean.glb", frame_times(performance)).meshes
    truth = in_space(performance, performance.roles[0].mesh())
    assert np.abs(shown.points[..., :2] - truth).max() < 1e-4 * np.ptp(truth[0], axis=0).max()
    assert np.abs(shown.points[..., 2]).max() < 1e-6
    influences = np.array(shown.influences)
    assert influences.min() >= 0 and influences.max() <= 1
    assert shown.targets == shown.userData["targetNames"]


def test_three_draws_the_picture_that_we_draw(three, tmp_path, drawn, photo):
    """A vector drawing behind a picture, by the file's own camera: upright, in its colours, in drawn order."""
    frames = 5
    behind = motion(frames, **calm(frames))
    small = replace(picture("coin", photo), height=0.4)
    before = motion(frames, part="coin", order=np.ones(frames, int), **calm(frames))
    both = replace(behind, tracks=behind.tracks + before.tracks, keysets=behind.keysets + before.keysets)
    performance = perform(both, [read_drawing("bean", KEYS, drawn), small])
    write_glb(performance, tmp_path / "both.glb")
    times = frame_times(performance)
    pictures = three(tmp_path / "both.glb", times, times, SIZE).pictures
    for t, shown in enumerate(pictures):
        ours = draw(performance, t, "white")
        off = np.abs(_soft(ours) - _soft(shown))
        assert off.mean() < 0.5 and np.percentile(off, 99.5) < 20, t
        wrong = np.abs(_soft(ours[::-1]) - _soft(shown)).mean()
        assert wrong > 10 * off.mean()


def test_three_hides_what_is_not_seen(three, tmp_path, photo):
    seen = np.array([1, 1, 0, 0, 1], bool)
    performance = perform(motion(5, visible=seen), [picture("bean", photo)])
    write_glb(performance, tmp_path / "bean.glb")
    times = frame_times(performance)
    result = three(tmp_path / "bean.glb", times, times, SIZE)
    np.testing.assert_array_equal(result.meshes[0].seen, seen)
    assert [bool((shown < 250).any()) for shown in result.pictures] == seen.tolist()


def test_three_draws_a_drawing_bent_along_a_line(three, validate, tmp_path):
    (tmp_path / "flag.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="100" height="200">'
        '<path d="M45 10 L55 10 L55 195 L45 195 Z" fill="#806040"/><path d="M55 15 L95 30 L55 60 Z" fill="#c03030"/></svg>',
        encoding="utf-8",
    )
    up = np.linspace(0, 1, 20)
    lines = [np.stack([150 + 60 * swing * up**2, 220 - 150 * up], -1) for swing in np.linspace(-1, 1, 7)]
    captured = capture_line(np.array(lines), 24.0, part="pole", size=SIZE)
    performance = perform(captured, [read_bent("pole", captured.keysets[0], tmp_path / "flag.svg")])
    write_glb(performance, tmp_path / "flag.glb")
    assert_nothing_to_say(validate(tmp_path / "flag.glb"))
    times = frame_times(performance)
    for t, shown in enumerate(three(tmp_path / "flag.glb", times, times, SIZE).pictures):
        assert np.abs(_soft(draw(performance, t, "white")) - _soft(shown)).mean() < 0.3


def test_three_plays_a_skin_under_morph_targets_and_a_sheared_map(three, validate, tmp_path):
    """The equation written out here: shape first, then the joints' shares, then the map of the whole figure."""
    rng = np.random.default_rng(5)
    frames, count = 7, 40
    shapes = rng.uniform(-1, 1, (3, count, 3))
    weights = rng.uniform(-0.5, 1.5, (frames, 3))
    weights[:, 0] += 1 - weights.sum(axis=1)
    place = lifted(wild_maps(frames)) * [[1, 1, 1, 0.01]]
    parents = (-1, 0, 1, 0)
    turns = Rotation.from_rotvec(np.cumsum(rng.normal(0, 0.4, (frames, 4, 3)), axis=0).reshape(-1, 3))
    bones = rng.normal(0, 0.5, (frames, 4, 3))
    local = np.zeros((frames, 4, 3, 4))
    local[..., :3], local[..., 3] = turns.as_matrix().reshape(frames, 4, 3, 3), bones
    world = local.copy()
    for joint, parent in enumerate(parents):
        if parent >= 0:
            world[:, joint] = affine.compose(world[:, parent], local[:, joint])
    bind = affine.invert(rng.normal(0, 1, (4, 3, 4)) + np.eye(3, 4))
    shares = rng.dirichlet(np.ones(4), count)
    joints = np.tile(np.arange(4), (count, 1))
    quats = turns.as_quat().reshape(frames, 4, 4)
    skin = Skin(("hip", "knee", "foot", "tail"), parents, bones, quats, bind, joints, shares)
    normals = np.repeat([[[0.0, 0, 1]]], count, axis=1).repeat(3, axis=0)
    faces = np.arange(39).reshape(-1, 3)
    body = Body("fox", ("a", "b", "c"), shapes, weights, place, faces, normals=normals, skin=skin)
    times = np.arange(frames) / 24
    write_bodies((body,), times, 24.0, tmp_path / "fox.glb")
    assert_nothing_to_say(validate(tmp_path / "fox.glb"))
    (shown,) = three(tmp_path / "fox.glb", np.float32(times).tolist()).meshes
    for t in range(frames):
        shape = np.tensordot(weights[t], shapes, axes=1)
        moved = affine.apply(affine.compose(world[t], bind), shape)  # (J, V, 3)
        truth = affine.apply(place[t], np.einsum("vj,jvx->vx", shares, moved))
        assert np.abs(shown.points[t] - truth).max() < 1e-4 * np.ptp(truth, axis=0).max()


@pytest.mark.parametrize("suffix", [".glb", ".gltf"])
def test_the_khronos_validator_has_nothing_to_say(validate, tmp_path, drawn, photo, suffix):
    one = motion(6, visible=np.arange(6) != 3)
    two = motion(6, part="coin", order=np.arange(6) % 2)
    both = replace(one, tracks=one.tracks + two.tracks, keysets=one.keysets + two.keysets)
    performance = perform(both, [read_drawing("bean", KEYS, drawn), picture("coin", photo)])
    write_glb(performance, tmp_path / f"both{suffix}")
    assert_nothing_to_say(validate(tmp_path / f"both{suffix}"))


def test_the_khronos_validator_does_complain_where_there_is_reason(validate, tmp_path, photo):
    performance = perform(motion(3), [picture("bean", photo)])
    write_glb(performance, tmp_path / "bean.gltf")
    text = (tmp_path / "bean.gltf").read_text(encoding="utf-8")
    (tmp_path / "bean.gltf").write_text(text.replace('"VEC3"', '"VEC2"', 1), encoding="utf-8")
    assert validate(tmp_path / "bean.gltf")["numErrors"] > 0


def assert_nothing_to_say(issues):
    told = [issue for issue in issues["messages"] if issue["code"] != "IMAGE_NPOT_DIMENSIONS"]  # a mere note
    assert (issues["numErrors"], issues["numWarnings"], told) == (0, 0, [])


def _soft(image):
    import cv2

    return cv2.blur(image.astype(np.float32), (3, 3))
