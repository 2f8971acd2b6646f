"""Animated SVG and Lottie, played by those who will play them: a browser, and lottie-web in it."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from svgelements import CubicBezier, Path

from capture.fit.action import capture_line
from capture.motion import affine, keys
from capture.motion.tracks import CartoonMotion, track_of
from retarget.characters.drawings import paths
from retarget.characters.drawings.bend import read_bent
from retarget.characters.drawings.drawing import read_drawing
from retarget.characters.photos.picture import read_picture
from retarget.characters.target import REST
from retarget.export.lottie import write_lottie
from retarget.export.svg import write_svg
from retarget.stage.draw2d import draw
from retarget.stage.perform import perform

SIZE = (320, 240)
KEYS = ("stand", "lean")
NEAR = 0.05  # pixels


def lean(points, by):
    points = np.asarray(points, float)
    return points + np.stack([by * ((200 - points[..., 1]) / 100) ** 2, 0 * points[..., 1]], axis=-1)


def egg(count=48):
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    return np.stack([160 + 40 * np.sin(angle), 150 - 50 * np.cos(angle)], axis=-1)


def motion(frames=12, part="egg", **changes):
    """Turned, sheared, travelling, with weights below 0 and above 1."""
    source = keys.keyset(KEYS, np.stack([egg(), lean(egg(), 40.0)]))
    maps = []
    for t in np.linspace(0, 1, frames):
        c, s = np.cos(1.5 * t), np.sin(1.5 * t)
        linear = np.array([[c, -s], [s, c]]) @ [[1 + 0.3 * t, 0.4 * t], [0, 1 - 0.3 * t]]
        maps.append(np.column_stack([linear, [150, 150] - linear @ [150, 150] + [40 * t, -20 * t]]))
    weights = np.zeros((frames, len(source.rows)))
    last = int(np.flatnonzero((source.rows[:, :2] == 1).all(axis=1))[0])
    weights[:, last] = np.linspace(-0.3, 1.3, frames)
    weights[:, 0] = 1 - weights[:, last]
    track = replace(track_of(part, source, np.array(maps), weights, np.zeros(frames)), **changes)
    return CartoonMotion((track,), (source,), np.arange(frames) / 24, 24.0, SIZE)


def on_twos(playing):
    frames = len(playing.times)
    at = np.arange(frames) // 2 * 2
    tracks = [replace(track, affine=track.affine[at], weights=track.weights[at]) for track in playing.tracks]
    return replace(playing, tracks=tuple(tracks))


def figure(by, warm="#ff3000"):
    """A figure with everything that is painted differently: ink, dashes, holes, gradients of both kinds, glass."""

    def curve(*points):
        return " ".join(f"{x:.9f},{y:.9f}" for x, y in lean(points, by))

    body = f"M{curve((140, 200))} C{curve((120, 160), (130, 100), (160, 100))} "
    body += f"C{curve((190, 100), (200, 160), (180, 200))} Z"
    outer = f"M{curve((148, 115))} L{curve((172, 115))} L{curve((172, 140))} L{curve((148, 140))} Z"
    inner = f"M{curve((155, 122))} L{curve((165, 122))} L{curve((165, 133))} L{curve((155, 133))} Z"
    cheek = f"M{curve((140, 170))} L{curve((180, 165))} L{curve((178, 194))} L{curve((145, 194))} Z"
    mouth = f"M{curve((145, 150))} Q{curve((160, 162), (175, 150))}"
    glass = f"M{curve((130, 130))} L{curve((160, 120))} L{curve((150, 160))} Z"
    low, high = lean([[140, 160]], by)[0], lean([[180, 200]], by)[0]
    return f"""<svg xmlns="http://www.w3.org/2000/svg" width="320" height="240"><defs>
    <linearGradient id="l" x2="1" y2="1"><stop offset="0" stop-color="#80c060"/>
    <stop offset="1" stop-color="#f0e080"/></linearGradient>
    <radialGradient id="r" gradientUnits="userSpaceOnUse" cx="{low[0] + 20}" cy="{high[1] - 18}" r="22"
    fx="{low[0] + 28}" fy="{high[1] - 22}"><stop offset="0" stop-color="#ffff00"/>
    <stop offset="1" stop-color="{warm}" stop-opacity="0.5"/></radialGradient></defs>
    <path d="{body}" fill="url(#l)" stroke="#202020" stroke-width="3" stroke-linejoin="round"/>
    <path d="{outer} {inner}" fill="#203080" fill-rule="evenodd"/>
    <path d="{cheek}" fill="url(#r)"/>
    <path d="{mouth}" fill="none" stroke="{warm}" stroke-width="4" stroke-linecap="round"/>
    <path d="{body}" fill="none" stroke="#0000c0" stroke-width="2" stroke-dasharray="9 5"/>
    <path d="{glass}" fill="#3060ff" stroke="#ff0000" stroke-width="6" opacity="0.5"/></svg>"""


@pytest.fixture
def drawn(tmp_path):
    files = []
    for name, by, warm in zip(KEYS, (0.0, 50.0), ("#ff3000", "#3000ff"), strict=True):
        files.append(tmp_path / f"figure_{name}.svg")
        files[-1].write_text(figure(by, warm), encoding="utf-8")
    return files


def curves_of(shown):
    """The curves (C, 4, 2) of a path as it is painted, from the corner of the page."""
    found = [
        [(point.x, point.y) for point in (piece.start, piece.control1, piece.control2, piece.end)]
        for piece in Path(shown.d)
        if isinstance(piece, CubicBezier)
    ]
    return affine.apply(np.reshape(shown.matrix, (2, 3)), np.array(found))


def ours(path, backwards):
    """Our curves (C, 4, 2); lottie-web takes the subpaths from the last to the first."""
    counts = (np.diff(path.starts) - 1) // 3
    rings = np.split(paths.pieces(path), np.cumsum(counts)[:-1])
    return np.concatenate(rings[::-1] if backwards else rings)


def farthest(performance, t, shown, twice):
    """How far any control point is from ours; lottie-web paints fill and stroke one after the other."""
    wanted = []
    for path in performance.posed(t):
        wanted += [path] * (int(path.fill is not None) + int(path.stroke is not None) if twice else 1)
    assert len(shown) == len(wanted)
    return max(np.abs(curves_of(one) - ours(path, twice) - 0.5).max() for one, path in zip(shown, wanted, strict=True))


def played(vector, performance, path, size=None, later=0.0):
    """What is shown in every frame, asked for `later` frames after its beginning."""
    if path.suffix == ".svg":
        write_svg(performance, path, background="white")
        return vector(path, (np.arange(len(performance.times)) + later) / performance.fps, size)
    write_lottie(performance, path, background="white")
    return vector(path, np.arange(len(performance.times)) + later, size)


@pytest.mark.parametrize("name", ["figure.svg", "figure.json"])
@pytest.mark.parametrize("later", [0.0, 0.4])
def test_held_drawings_stay_on_our_points_for_as_long_as_they_are_held(vector, tmp_path, drawn, name, later):
    performance = perform(on_twos(motion(9)), [read_drawing("egg", KEYS, drawn)])
    shown = played(vector, performance, tmp_path / name, later=later)
    off = [farthest(performance, t, frame, name == "figure.json") for t, frame in enumerate(shown.frames)]
    assert max(off) < NEAR


@pytest.mark.parametrize("name", ["figure.svg", "figure.json"])
def test_drawings_on_ones_meet_our_points_and_move_on_smoothly_between(vector, tmp_path, drawn, name):
    performance = perform(motion(9), [read_drawing("egg", KEYS, drawn)])
    twice = name == "figure.json"
    shown = played(vector, performance, tmp_path / name)
    assert max(farthest(performance, t, frame, twice) for t, frame in enumerate(shown.frames)) < NEAR
    halfway = played(vector, performance, tmp_path / name, later=0.5).frames
    for t in range(8):
        before, after = (curves_of(shown.frames[k][0]) for k in (t, t + 1))
        assert np.abs(curves_of(halfway[t][0]) - 0.5 * (before + after)).max() < NEAR
        assert np.abs(before - after).max() > 1
    assert farthest(performance, 8, halfway[8], twice) < NEAR  # the last drawing stays for its own frame


@pytest.mark.parametrize("name", ["figure.svg", "figure.json"])
def test_the_browser_paints_the_picture_that_we_draw(vector, tmp_path, drawn, name):
    """Gradients under shear, colours that change from key to key, ink, dashes, holes and glass; upright."""
    performance = perform(motion(5), [read_drawing("egg", KEYS, drawn)])
    shown = played(vector, performance, tmp_path / name, SIZE)
    for t, picture in enumerate(shown.pictures):
        off = np.abs(_soft(draw(performance, t, "white")) - _soft(picture))
        assert off.mean() < 0.5 and np.percentile(off, 99.5) < 25, t


@pytest.mark.parametrize("name", ["both.svg", "both.json"])
def test_parts_change_their_order_and_are_hidden(vector, tmp_path, drawn, name):
    target = read_drawing("egg", KEYS, drawn)
    one = motion(6, visible=np.array([1, 1, 0, 1, 1, 1], bool), order=np.array([0, 2, 2, 0, 0, 2]))
    two = motion(6, part="lid", order=np.ones(6, int))
    slid = two.tracks[0].affine + [[0, 0, 25], [0, 0, 10]]
    two = replace(two, tracks=(replace(two.tracks[0], affine=slid),))
    both = replace(one, tracks=one.tracks + two.tracks, keysets=one.keysets + two.keysets)
    performance = perform(both, [target, replace(target, part="lid")])
    shown = played(vector, performance, tmp_path / name, SIZE)
    for t, picture in enumerate(shown.pictures):
        off = np.abs(_soft(draw(performance, t, "white")) - _soft(picture)).mean()
        assert off < 0.5, t


@pytest.mark.parametrize("name", ["photo.svg", "photo.json"])
def test_a_picture_that_keeps_its_shape_is_moved_turned_and_sheared(vector, tmp_path, name):
    y, x = np.mgrid[:240, :320]
    pixels = np.stack([x * 255 // 320, y * 255 // 240, 128 + 100 * np.sin(x / 19) * np.sin(y / 23)], -1)
    Image.fromarray(pixels.astype(np.uint8)).save(tmp_path / "photo.png")
    target = read_picture("egg", (REST,), [tmp_path / "photo.png"], [egg()])
    playing = motion(6)
    mirrored = playing.tracks[0].affine.copy()
    mirrored[-1, :, 0] *= -1
    playing = replace(playing, tracks=(replace(playing.tracks[0], affine=mirrored),))
    performance = perform(playing, [target])
    shown = played(vector, performance, tmp_path / name, SIZE)
    for t, picture in enumerate(shown.pictures):
        off = np.abs(_soft(draw(performance, t, "white")) - _soft(picture))
        assert off.mean() < 0.5 and np.percentile(off, 99.5) < 30, t


@pytest.mark.parametrize("name", ["flag.svg", "flag.json"])
def test_a_drawing_bent_along_a_line_is_shown(vector, tmp_path, name):
    (tmp_path / "drawn.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="100" height="200">'
        '<path d="M45 10 L55 10 L55 195 L45 195 Z" fill="#806040"/><path d="M55 15 L95 30 L55 60 Z" fill="#c03030"/></svg>',
        encoding="utf-8",
    )
    up = np.linspace(0, 1, 20)
    lines = [np.stack([150 + 60 * swing * up**2, 220 - 150 * up], -1) for swing in np.linspace(-1, 1, 7)]
    captured = capture_line(np.array(lines), 24.0, part="pole", size=SIZE)
    performance = perform(captured, [read_bent("pole", captured.keysets[0], tmp_path / "drawn.svg")])
    shown = played(vector, performance, tmp_path / name)
    assert max(farthest(performance, t, frame, name == "flag.json") for t, frame in enumerate(shown.frames)) < NEAR


def _soft(image):
    import cv2

    return cv2.blur(image.astype(np.float32), (3, 3))
