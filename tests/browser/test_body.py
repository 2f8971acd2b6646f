"""One body of several parts in a GLB: the validator has nothing to say, and three.js bends its seams as we do."""

import numpy as np
import pytest
from PIL import Image

from capture.motion import affine, keys, triangulate
from capture.motion.tracks import CartoonMotion, track_of
from retarget.characters.casts.cast import targets
from retarget.characters.casts.castfile import Cast, CastBody
from retarget.export.bodies import stage_to_space
from retarget.export.gltf import write_glb
from retarget.stage.draw2d import draw
from retarget.stage.perform import perform

SIZE = (240, 260)


def bending(frames=7):
    """An arm of two parts that goes to the right and bends at the elbow, with some shear."""
    found, sets = [], []
    for name, parent, corners in (("upper", "", (80, 60, 120, 120)), ("lower", "upper", (80, 120, 120, 200))):
        x0, y0, x1, y1 = corners
        ring = triangulate.resample(np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]], float), 40)
        source, pivot = keys.keyset(("rest",), ring[None], spacing=8), np.array([100.0, y0])
        angle = np.linspace(0, 0.8 if parent else 0.2, frames)
        c, s = np.cos(angle), np.sin(angle)
        maps = np.stack(
            [np.stack([c, 0.2 * angle - s, 0 * c if parent else 100 * angle], -1), np.stack([s, c, 0 * c], -1)], -2
        )
        weights, none = np.ones((frames, 1)), np.zeros(frames)
        found.append(track_of(name, source, affine.about(maps, pivot), weights, none, pivot=pivot, parent=parent))
        sets.append(source)
    return CartoonMotion(tuple(found), tuple(sets), np.arange(frames) / 24, 24.0, SIZE)


def written(folder):
    """An arm 40 by 140 as a drawing, a picture and a model, with marks on it."""
    (folder / "arm.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="240" height="260">'
        '<path d="M80,60 H120 V200 H80 Z" fill="#c04040"/><path d="M85,110 H115 V130 H85 Z" fill="#f0e0a0"/></svg>'
    )
    pixels = np.zeros((160, 80, 4), np.uint8)
    pixels[10:150, 20:60] = (200, 60, 60, 255)
    pixels[60:80, 25:55] = (240, 230, 160, 255)
    Image.fromarray(pixels).save(folder / "arm.png")
    x, y = np.meshgrid(np.arange(5) / 2, np.arange(15) / 2)
    text = "".join(f"v {a} {b} {0.1 * a * b}\n" for a, b in zip(x.ravel(), y.ravel(), strict=True))
    for a in (row * 5 + column + 1 for row in range(14) for column in range(4)):
        text += f"f {a} {a + 1} {a + 6}\nf {a} {a + 6} {a + 5}\n"
    (folder / "arm.obj").write_text(text)


@pytest.mark.parametrize("name", ["arm.svg", "arm.png", "arm.obj"])
def test_the_validator_has_nothing_to_say_and_three_bends_seams_as_we_do(three, validate, tmp_path, name):
    written(tmp_path)
    motion = bending()
    performance = perform(motion, targets(Cast(bodies=(CastBody(name),), folder=tmp_path), motion))
    write_glb(performance, tmp_path / "arm.glb")
    issues = validate(tmp_path / "arm.glb")
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"]
    times = np.float32(performance.times).tolist()
    result = three(tmp_path / "arm.glb", times, times, SIZE)
    if name != "arm.svg":  # a drawing's sheets have points of their own
        truth = affine.apply(stage_to_space(SIZE), performance.roles[0].mesh()[..., :2])
        shown = result.meshes[0].points[..., :2]
        gap = np.linalg.norm(shown[:, :, None] - truth[:, None], axis=-1)  # vertices may be doubled
        same = gap[0].argmin(axis=1)
        assert gap[:, np.arange(len(same)), same].max() < 1e-4 * np.ptp(truth[0], axis=0).max()
    if name != "arm.obj":  # a model is lit otherwise
        for t, shown in enumerate(result.pictures):
            assert np.abs(_soft(draw(performance, t, "white")) - _soft(shown)).mean() < 0.25, t


def _soft(image):
    import cv2

    return cv2.blur(image.astype(np.float32), (3, 3))
