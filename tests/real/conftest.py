"""Real clips and drawings, which are not part of the project: TOONCAP_DATA says where they are.

What several files look at is captured once: the rabbit's hop from its exact outlines, the snowman's hat from pictures.
"""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from capture.fit import video
from capture.fit.contour import capture_points, outline_keys
from capture.fit.suggest import Suggestion, suggest
from capture.motion import affine, keys
from capture.motion.tracks import CartoonMotion, check, track_of
from capture.pictures.clip import Clip
from capture.pictures.decode import read_clip
from capture.pictures.shot import KeyDrawing, Part, Shot

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def data() -> Path:
    """The folder of real material; the test is skipped where there is none."""
    folder = Path(os.environ.get("TOONCAP_DATA", ROOT.parent / "shared" / "data"))
    if not (folder / "clips").is_dir():
        pytest.skip(f"no real material at {folder}: set TOONCAP_DATA to the folder that holds clips/ and drawings/")
    return folder


@pytest.fixture(scope="session")
def sheets() -> Path:
    """Where contact sheets are left for a person to look at."""
    folder = ROOT / "out" / "real"
    folder.mkdir(parents=True, exist_ok=True)
    return folder


@pytest.fixture(scope="session")
def rabbit_curve(data: Path) -> Callable[[str], np.ndarray]:
    """A path of the hopping rabbit (T, N, 2): its Bezier curves at the same parameters in every frame."""
    stored = np.load(data / "clips" / "noto_rabbit_hop" / "gt.npz")

    def curve(path: str) -> np.ndarray:
        at, into, out = np.moveaxis(stored[path], 1, 0)  # vertices, in-points, out-points
        s = np.arange(5)[:, None] / 5
        after, last = np.roll(at, -1, axis=1)[:, :, None], np.roll(into, -1, axis=1)[:, :, None]
        points = (1 - s) ** 3 * at[:, :, None] + 3 * (1 - s) ** 2 * s * out[:, :, None]
        points += 3 * (1 - s) * s**2 * last + s**3 * after
        return points.reshape(len(points), -1, 2)

    return curve


@pytest.fixture(scope="session")
def rabbit_body(rabbit_curve: Callable[[str], np.ndarray]) -> np.ndarray:
    return rabbit_curve("path/14:Body/0")


@pytest.fixture(scope="session")
def rabbit_keys(rabbit_body: np.ndarray) -> Suggestion:
    """Keys of the rabbit's body: 33 drawings of a whole hop, with legs that cross the body."""
    return suggest(rabbit_body, 2.0, 8)


@pytest.fixture(scope="session")
def rabbit_clip(data: Path) -> Clip:
    return read_clip(data / "clips" / "noto_rabbit_hop" / "frames", fps=30)


@pytest.fixture(scope="session")
def rabbit(rabbit_body: np.ndarray, rabbit_keys: Suggestion, rabbit_clip: Clip) -> CartoonMotion:
    """The rabbit's body, captured from its outlines on the suggested keys."""
    keyset, seen = outline_keys(rabbit_body, rabbit_keys.key_frames)
    placed, weights = capture_points(seen, keyset)
    shape = np.tensordot(weights, keys.shapes(keyset), axes=1)
    off = np.sqrt(((affine.apply(placed, shape) - seen) ** 2).sum(axis=-1).mean(axis=-1))
    track = track_of("body", keyset, placed, weights, off, held=rabbit_keys.held)
    clip = rabbit_clip
    return check(CartoonMotion((track,), (keyset,), np.asarray(clip.times), float(clip.fps), clip.size))


@pytest.fixture(scope="session")
def snowman_shot(data: Path) -> Shot:
    hat = Part("hat", (KeyDrawing("rest", 0),), box=(145, 8, 230, 140))
    return Shot(str(data / "clips" / "noto_snowman_hat" / "frames"), (hat,), fps=30)


@pytest.fixture(scope="session")
def snowman_clip(snowman_shot: Shot) -> Clip:
    return video.open_clip(snowman_shot)


@pytest.fixture(scope="session")
def snowman_hat(snowman_shot: Shot, snowman_clip: Clip) -> CartoonMotion:
    """The snowman's hat, captured from the pictures."""
    return video.capture(snowman_shot, snowman_clip)
