"""A motion and a drawing made by hand; tests get these functions through the fixture `by_hand`."""

import base64
import json
import socket
from types import SimpleNamespace

import numpy as np
import pytest

from capture.motion import keys, tracks
from capture.motion.tracks import CartoonMotion, Track
from retarget.cli import main

NAMES = ("sit", "lean")


def lean(points, by):
    """Shift points (..., 2) sideways by the square of their height over y = 200: no affine map does."""
    points = np.asarray(points, float)
    return points + np.stack([by * ((200 - points[..., 1]) / 100) ** 2, 0 * points[..., 1]], axis=-1)


def egg(count=48):
    """An outline (B, 2) that stands on (160, 200), 100 tall and 80 wide."""
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    return np.stack([160 + 40 * np.sin(angle), 150 - 50 * np.cos(angle)], axis=-1)


def make_motion(affine, weights, names=NAMES, part="egg", **changes):
    """A motion of one egg-shaped part with given maps (T, 2, 3) and weights over rows (T, at most D)."""
    outlines = np.stack([lean(egg(), 40.0 * k) for k in range(len(names))])
    source = keys.keyset(names, outlines)
    count = len(affine)
    known = np.zeros((count, len(source.rows)))
    weights = np.asarray(weights, float)
    known[:, : weights.shape[1]] = weights
    fields = {
        "part": part,
        "parent": "",
        "pivot": np.array([160.0, 190.0]),
        "keys": names,
        "rows": source.rows,
        "affine": np.asarray(affine, float),
        "weights": known,
        "residual": np.zeros(count),
        "visible": np.ones(count, bool),
        "held": np.zeros(count, bool),
        "order": np.zeros(count, int),
    }
    track = Track(**{**fields, **changes})
    return CartoonMotion((track,), (source,), np.arange(count) / 24, 24.0, (320, 240))


def still(frames=1):
    """Maps (T, 2, 3) that move nothing."""
    return np.tile(np.eye(2, 3), (frames, 1, 1))


def tumble(frames):
    """Maps (T, 2, 3) that turn, squash and travel."""
    maps = []
    for t in np.linspace(0, 1, frames):
        c, s = np.cos(3 * t), np.sin(3 * t)
        linear = np.array([[c, -s], [s, c]]) @ np.diag([1 + 0.3 * t, 1 - 0.2 * t])
        maps.append(np.column_stack([linear, [40 * t, -30 * np.sin(3 * t)]]))
    return np.array(maps)


def worm_svg(by=0.0, stripe="#a03030", extra=""):
    """A standing worm as SVG: body with outline, stripe, ring with a hole, mouth, cheek with a gradient."""

    def curve(*points):
        return " ".join(f"{x:.9f},{y:.9f}" for x, y in lean(points, by))

    body = f"M{curve((140, 200))} C{curve((120, 160), (130, 100), (160, 100))} "
    body += f"C{curve((190, 100), (200, 160), (180, 200))} Z"
    stripe_path = f"M{curve((134, 160))} L{curve((186, 160))} L{curve((184, 175))} L{curve((136, 175))} Z"
    outer = f"M{curve((150, 120))} L{curve((170, 120))} L{curve((170, 140))} L{curve((150, 140))} Z"
    inner = f"M{curve((155, 125))} L{curve((165, 125))} L{curve((165, 135))} L{curve((155, 135))} Z"
    mouth = f"M{curve((145, 150))} Q{curve((160, 158), (175, 150))}"
    cheek = f"M{curve((150, 182))} L{curve((170, 182))} L{curve((170, 194))} L{curve((150, 194))} Z"
    return f"""<svg xmlns="http://www.w3.org/2000/svg" width="320" height="240" viewBox="0 0 320 240">
    <defs><linearGradient id="warm"><stop offset="0" stop-color="#ff0000"/>
    <stop offset="1" stop-color="#ffff00"/></linearGradient></defs>
    <path id="body" d="{body}" fill="#80c060" stroke="black" stroke-width="3" stroke-linejoin="round"/>
    <path id="stripe" d="{stripe_path}" fill="{stripe}"/>
    <path id="ring" d="{outer} {inner}" fill="#203080" fill-rule="evenodd"/>
    <path id="mouth" d="{mouth}" fill="none" stroke="black" stroke-width="2" stroke-linecap="round"/>
    <path id="cheek" d="{cheek}" fill="url(#warm)"/>{extra}</svg>"""


@pytest.fixture(scope="session")
def by_hand():
    return SimpleNamespace(
        lean=lean, egg=egg, motion=make_motion, still=still, tumble=tumble, worm_svg=worm_svg, names=NAMES
    )


@pytest.fixture
def worm(tmp_path):
    """The files of a worm with the egg's two keys."""
    files = []
    for name, by in zip(NAMES, (0.0, 60.0), strict=True):
        file = tmp_path / f"worm_{name}.svg"
        file.write_text(worm_svg(by), encoding="utf-8")
        files.append(file)
    return files


def arm_gltf(file, interpolation="LINEAR", joints=(2, 3)):
    """A flat arm, bound to a shoulder and an elbow, with a hand hung on the elbow without a skin."""
    base, elbow = np.array([5.0, 0, 0]), np.array([5.0, 2, 0])  # everything is twice as large under node 1
    across, up = np.meshgrid([-0.4, 0.4], np.linspace(0, 4, 9))
    strip = np.stack([5 + across.ravel(), up.ravel(), 0 * up.ravel()], axis=-1)
    share = np.clip((strip[:, 1] - 1.5) / 1.0, 0, 1)
    rows = np.arange(8)[:, None] * 2
    faces = np.concatenate([rows + [0, 1, 3], rows + [0, 3, 2]])
    hand = np.array([[-0.3, 0, 0], [0.3, 0, 0], [0, 0.5, 0.1]])  # under the elbow, one of its units above it
    bind = np.tile(np.eye(4), (2, 1, 1))
    for number, place in enumerate((base, elbow)):
        bind[number, :3, :3], bind[number, :3, 3] = np.eye(3) / 2, -place / 2
    angles = np.radians([0.0, 90, 180, 270])
    turns = np.stack([0 * angles, 0 * angles, np.sin(angles / 2), np.cos(angles / 2)], axis=-1)
    if interpolation == "CUBICSPLINE":
        turns = np.stack([0 * turns, turns, 0 * turns], axis=1).reshape(-1, 4)
    bound = np.tile([0, 1, 0, 0], (len(strip), 1))
    shares = np.stack([1 - share, share, 0 * share, 0 * share], axis=-1)
    binary, views, accessors = b"", [], []
    for values, kind, code in (
        (strip, "VEC3", 5126),
        (faces.reshape(-1, 1), "SCALAR", 5123),
        (bound, "VEC4", 5121),
        (shares, "VEC4", 5126),
        (np.swapaxes(bind, 1, 2).reshape(2, 16), "MAT4", 5126),
        (np.arange(4.0)[:, None], "SCALAR", 5126),
        (turns, "VEC4", 5126),
        (hand, "VEC3", 5126),
    ):
        data = values.astype({5126: "<f4", 5123: "<u2", 5121: "u1"}[code]).tobytes()
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(data)})
        accessors.append({"bufferView": len(views) - 1, "componentType": code, "count": len(values), "type": kind})
        binary += data + b"\0" * (-len(data) % 4)
    content = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [1, 0]}],
        "nodes": [
            {"name": "strip", "mesh": 0, "skin": 0},
            {"name": "figure", "translation": [5, 0, 0], "scale": [2, 2, 2], "children": [2]},
            {"name": "shoulder", "children": [3]},
            {"name": "elbow", "translation": [0, 1, 0], "children": [4]},
            {"name": "hand", "translation": [0, 1, 0], "mesh": 1},
        ],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0, "JOINTS_0": 2, "WEIGHTS_0": 3}, "indices": 1}]},
            {"primitives": [{"attributes": {"POSITION": 7}}]},
        ],
        "skins": [{"joints": list(joints), "inverseBindMatrices": 4}],
        "animations": [
            {
                "name": "wave",
                "samplers": [{"input": 5, "output": 6, "interpolation": interpolation}],
                "channels": [{"sampler": 0, "target": {"node": 3, "path": "rotation"}}],
            }
        ],
        "bufferViews": views,
        "accessors": accessors,
        "buffers": [
            {
                "byteLength": len(binary),
                "uri": "data:application/octet-stream;base64," + base64.b64encode(binary).decode(),
            }
        ],
    }
    file.write_text(json.dumps(content))
    points, shares = np.concatenate([strip, [5, 4, 0] + 2 * hand]), np.concatenate([share, np.ones(3)])
    return SimpleNamespace(file=file, points=points, share=shares, elbow=elbow)


@pytest.fixture
def arm(tmp_path):
    """A skinned file with `points` (N, 3), each with its `share` of the elbow, at `elbow`; `written` varies it."""
    drawn = arm_gltf(tmp_path / "arm.gltf")
    drawn.written = lambda **changes: arm_gltf(tmp_path / "other.gltf", **changes).file
    return drawn


@pytest.fixture
def alone(monkeypatch):
    """Whoever asks the network for anything fails the test."""

    def called(*told):
        raise AssertionError(f"something was fetched: {told}")

    for name in ("connect", "connect_ex"):
        monkeypatch.setattr(socket.socket, name, called)
    monkeypatch.setattr(socket, "getaddrinfo", called)


@pytest.fixture
def lent(tmp_path, by_hand, capsys, alone):
    """Lend a motion of one key or two to files, by the command; returns its exit code and what it said."""
    for count, weights in ((1, [[1.0]] * 2), (2, [[1.0, 0], [0, 1.0]])):
        motion = by_hand.motion(by_hand.tumble(2), weights, names=by_hand.names[:count])
        tracks.save(motion, tmp_path / f"{count}.motion.json")

    def lend(*flags, keys=1, out="new.svg"):
        made = tmp_path / "made" / out
        code = main(["retarget", str(tmp_path / f"{keys}.motion.json"), *map(str, flags), "-o", str(made)])
        said = capsys.readouterr()
        assert code in (0, 2)
        assert made.parent.exists() == (code == 0)  # nothing half-written is left
        assert code == 0 or (said.err.startswith("tooncap: ") and said.err.count("\n") == 1 and not said.out)
        return code, said.err

    return lend
