"""A part with four keys that jumps and bends on twos: against the drawn truth, outside the keys' span, and the paper.

With a wobble the drawings leave what keys can say.  `wobble_N_ratio` is our error, N pixels of wobble, over the best
that an affine map of the key-shape space could do: found by least squares from the true outline.  The frog's joints
turn between the keys, and no in-between of two outlines does exactly that: the `floor` figures are what contour
capture makes of the true outlines, with nothing of the picture in it.  `strong` is the frog that bends all the way.
"""

import cv2
import numpy as np
from _common import LOST, captured, cut, from_key, new_drawings, off

from capture.fit import contour
from capture.fit.pixels import keyimages, layer, track_keys
from capture.fit.pixels import model as models
from capture.fit.pixels.layer import Layer
from capture.motion import keys
from capture.pictures import matte
from fixtures import jumps, maps, variants, write

WOBBLES = (1.0, 2.0, 3.0)  # pixels, root mean square over the outline
WOBBLING = 30  # drawings of each
PAPERS_STEP, PAPERS_ROUNDS = (
    6,
    30,
)  # every so many drawings (an iteration takes 40 ms), and iterations from the one before


def rows():
    """The capture, its weights, the wobbles, and eqs. 14-15 read literally."""
    toon = jumps.bending_frog()
    clip = write.clip_in_memory(toon)
    motion, seconds, learning = captured(toon, clip)
    fresh = new_drawings(toon)
    error = off(motion, toon)[fresh]
    fps = len(clip) / seconds
    return {
        "median_px": np.median(error),
        "p95_px": np.percentile(error, 95),
        "lost": np.count_nonzero(np.median(error, axis=1) > LOST),
        **_weight_errors(motion, toon),
        **_floor(toon, ""),
        "fps": fps,
        "fps_ratio_to_50": fps / 50,
        "fps_once_learnt": len(clip) / (seconds - learning),
        "learning_s": learning,
        **_strong(),
        **_wobbles(),
        **_paper(toon, clip),
    }


def _weight_errors(motion, toon):
    """Folded key weights off the drawn ones: of the keys in play, and of the worst key of each drawing."""
    fresh, truth = new_drawings(toon), toon.parts[0].weights
    wrong = np.abs(motion.tracks[0].key_weights() - truth)[fresh]
    in_play = (truth[fresh] > 0) & (truth[fresh] < 1)
    return {
        "weight_error": np.median(wrong[in_play]),
        "weight_error_worst_key": np.median(wrong.max(axis=1)),
        "weight_error_p95": np.percentile(wrong.max(axis=1), 95),
    }


def _floor(toon, prefix):
    """What the motion's own form cannot say of the true outlines: pixels and weights."""
    part, fresh = toon.parts[0], new_drawings(toon)
    motion = contour.capture_outlines(part.points, part.key_frames, part=part.name)
    weights = {f"{prefix}floor_{name}": value for name, value in _weight_errors(motion, toon).items()}
    return {f"{prefix}floor_px": np.median(off(motion, toon)[fresh])} | weights


def _strong():
    toon = jumps.bending_frog(bend=1.0)
    motion, _, _ = captured(toon)
    error = off(motion, toon)[new_drawings(toon)]
    return {
        "strong_median_px": np.median(error),
        "strong_lost": np.count_nonzero(np.median(error, axis=1) > LOST),
        "strong_weight_error": _weight_errors(motion, toon)["weight_error"],
        **_floor(toon, "strong_"),
    }


def _wobbles():
    """Errors as root mean square over the outline, medians over the wobbling drawings."""
    figures = {}
    for rms in WOBBLES:
        toon = variants.wobbled(jumps.bending_frog(count=WOBBLING), rms)
        clip, part = write.clip_in_memory(toon), toon.parts[0]
        error = np.sqrt((off(captured(toon, clip)[0], toon) ** 2).mean(axis=1))
        keys_own = part.drawing[part.key_frames]
        fresh = [t for t in new_drawings(toon) if part.drawing[t] not in keys_own]
        model = models.learn(write.shot_of(toon).parts[0], clip)
        best = np.array([_best(model, part.points[t]) for t in fresh])
        name = f"wobble_{rms:g}"
        figures[f"{name}_px"] = np.median(error[fresh])
        figures[f"{name}_best_px"] = np.median(best)
        figures[f"{name}_ratio"] = np.median(error[fresh] / best)
    return figures


def _best(model, outline):
    """The least error, root mean square in pixels, of A (mean + modes . alpha) + D from an outline (B, 2)."""
    from scipy.optimize import least_squares

    space, count = model.shape.space, len(outline)
    mean, modes = space.mean[:count], space.modes[:, :count]

    def difference(unknown):
        shape = mean + np.tensordot(unknown[6:], modes, axes=1)
        return (maps.move(unknown[:6].reshape(2, 3), shape) - outline).ravel()

    first = np.append(maps.best_affine(mean, outline).ravel(), np.zeros(len(modes)))
    return np.sqrt(2 * least_squares(difference, first, x_scale="jac").cost / count)


def _paper(toon, clip):
    """Eqs. 14-15 as they stand: grey, raw pixels, one scale, the sum cut to the inside of the layer (eq. 16)."""
    part, fresh = toon.parts[0], new_drawings(toon)
    model = models.learn(write.shot_of(toon).parts[0], clip)
    template = _literal(model, write.shot_of(toon).parts[0], clip)
    before, error = from_key(toon), []
    for t in fresh[::PAPERS_STEP]:
        picture, _, origin = cut(model, clip, t, part.points[t - 1])
        frame = _grey_layer(picture, origin)
        placed, weights = before[t - 1], np.zeros(0)
        for _ in range(PAPERS_ROUNDS):
            placed, weights = track_keys.joint_step(template, frame, placed, 0)
            if not 0.05 < np.linalg.det(placed[:, :2]) < 20:
                break
        outline = models.outline_at(model, placed, weights @ template.levels[0].to_modes)
        error.append(np.median(np.linalg.norm(outline - part.points[t], axis=-1)))
    return {"paper_median_px": np.median(error), "paper_share_lost": np.mean(np.array(error) > LOST)}


def _literal(model, part, clip):
    """A mean and ten eigen-images of the rows' raw grey pictures, inside the mean shape."""
    pictures = [clip[key.frame] for key in part.keys]
    seeds = models.seed(part, pictures)
    mattes = [matte.cut(model.colors, picture, seed.inside) * seed.limit for picture, seed in zip(pictures, seeds)]
    composites = [layer.composite(picture, alpha, model.view.ground) for picture, alpha in zip(pictures, mattes)]
    shapes, space = keys.shapes(model.keyset), model.shape.space
    grid = keyimages.grid_round(shapes)
    images = keyimages.row_images(composites, model.keyset, shapes, grid, model.view.ground)
    stack = np.stack([cv2.cvtColor(image[..., :3], cv2.COLOR_RGB2GRAY) for image in images])
    outline = space.mean[model.keyset.outline]
    inside = matte.fill(stack.shape[:0:-1], outline - grid.origin) > 0
    y, x = np.nonzero(inside)
    pixels = stack[:, inside]
    mean = pixels.mean(axis=0)
    _, _, vt = np.linalg.svd(pixels - mean, full_matrices=False)
    eigen = vt[:10].T.astype(float)
    to_modes = np.linalg.lstsq((pixels - mean) @ eigen, space.coefficients, rcond=1e-3)[0]
    points = np.column_stack([x, y]) + grid.origin
    level = track_keys.EigenLevel(points, mean[:, None], eigen, np.zeros((6, len(points))), to_modes)
    return track_keys.EigenTemplate((level,), outline.mean(axis=0), 1.0)


def _grey_layer(picture, origin):
    grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY).astype(np.float32)
    return Layer((grey[..., None],), np.asarray(origin, float), np.full(1, 128.0))
