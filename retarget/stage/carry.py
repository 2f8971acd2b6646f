"""A hole in a drawing filled from round about: each colour next to it is carried in, and where two meet is an edge.

Blurring inpainting melts the colours into one another, which in a cartoon is a smear.  Here the colours round the hole
are sorted into a few; of each, the share in a pixel of the hole is the soap film over its rim (Laplace's equation: 1
where the rim has that colour, 0 where not), and the largest takes the pixel.  So an outline that runs into the hole on
two sides is joined by a smooth curve.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

BAND = 10  # pixels round the hole whose colours are looked at
MOST = 5  # colours
ALIKE = 18.0  # grey levels between colours that count as one
SOLVED = 5000  # unknown pixels at a time: a larger hole's film is found in a smaller picture


def carried_on(picture: NDArray, hole: NDArray) -> NDArray:
    """The picture (H, W, 3) uint8 with the pixels of a hole (H, W) bool filled; the others as they are."""
    x, y, w, h = cv2.boundingRect(hole.astype(np.uint8))
    if w == 0 or hole.all():
        return picture
    spot = slice(max(y - BAND, 0), y + h + BAND), slice(max(x - BAND, 0), x + w + BAND)
    seen, unknown = picture[spot].astype(np.float32), hole[spot]
    rim = cv2.dilate(unknown.astype(np.uint8), np.ones((2 * BAND + 1, 2 * BAND + 1), np.uint8)) - unknown
    colors = _few(seen[rim > 0])
    apart = np.stack([((seen - color) ** 2).sum(axis=-1) for color in colors])
    label = apart.argmin(axis=0)
    films = [_film((label == k).astype(np.float32), unknown) for k in range(len(colors))]
    label = np.where(unknown, np.argmax(films, axis=0), label)
    total, mixed = np.zeros(unknown.shape, np.float32), np.zeros_like(seen)
    for k, color in enumerate(colors):
        share = cv2.GaussianBlur((label == k).astype(np.float32), (0, 0), 0.6)  # an edge as soft as a drawn one
        mixed += share[..., None] * _tint(seen, (label == k) & ~unknown, color)
        total += share
    made = picture.copy()
    made[spot][unknown] = np.round(np.clip(mixed / total[..., None], 0, 255)).astype(np.uint8)[unknown]
    return made


def _tint(seen: NDArray, known: NDArray, color: NDArray) -> NDArray:
    """One colour (3,) as it varies over the picture (h, w, 3), from where it is known (h, w): the near counts more."""
    weight = np.full((*known.shape, 1), 1e-9, np.float32)
    total = weight * color
    for trust, reach in ((1.0, BAND / 2), (1e-2, 2 * BAND), (1e-4, 8 * BAND)):
        told = known.astype(np.float32)
        total = total + trust * cv2.GaussianBlur(seen * told[..., None], (0, 0), reach)
        weight = weight + trust * cv2.GaussianBlur(told, (0, 0), reach)[..., None]
    return total / weight


def _few(colors: NDArray) -> NDArray:
    """The few colours (k, 3) among many (n, 3) that are more than grain of one another; the most frequent first."""
    cv2.setRNGSeed(0)
    some = np.ascontiguousarray(colors[:: max(1, len(colors) // 4000)])
    count = min(MOST, len(some))
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 20, 0.5)
    _, label, centres = cv2.kmeans(some, count, None, stop, 1, cv2.KMEANS_PP_CENTERS)
    sizes = np.bincount(label.ravel(), minlength=count)
    kept: list[NDArray] = []
    for k in np.argsort(-sizes, kind="stable"):
        enough = sizes[k] > 0.01 * len(some)  # what is rarer is the mixture along an edge
        if not kept or (enough and min(np.linalg.norm(centres[k] - other) for other in kept) > ALIKE):
            kept.append(centres[k])
    return np.array(kept)


def _film(values: NDArray, unknown: NDArray) -> NDArray:
    """The values (h, w) with those that are unknown the mean of their four neighbours'."""
    from scipy import sparse
    from scipy.sparse.linalg import spsolve

    shrink = int(np.ceil(np.sqrt(unknown.sum() / SOLVED)))
    if shrink > 1:
        size = tuple(int(np.ceil(edge / shrink)) for edge in unknown.shape[::-1])
        told = cv2.resize((~unknown).astype(np.float32), size, interpolation=cv2.INTER_AREA)
        known = cv2.resize(np.where(unknown, 0, values), size, interpolation=cv2.INTER_AREA)
        small = _film(known / np.maximum(told, 1e-6), told < 1e-3)
        return np.where(unknown, cv2.resize(small, unknown.shape[::-1], interpolation=cv2.INTER_LINEAR), values)
    rows, columns = np.nonzero(unknown)
    number = np.full(unknown.shape, -1)
    number[rows, columns] = np.arange(len(rows))
    here, there, right, degree = [], [], np.zeros(len(rows)), np.zeros(len(rows))
    for dy, dx in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        y, x = rows + dy, columns + dx
        inside = (y >= 0) & (x >= 0) & (y < unknown.shape[0]) & (x < unknown.shape[1])
        degree += inside
        other = number[y[inside], x[inside]]
        at = np.flatnonzero(inside)
        here.append(at[other >= 0])
        there.append(other[other >= 0])
        np.add.at(right, at[other < 0], values[y[inside], x[inside]][other < 0])
    here, there = np.concatenate(here), np.concatenate(there)
    table = sparse.csr_matrix((-np.ones(len(here)), (here, there)), shape=(len(rows),) * 2) + sparse.diags(degree)
    made = values.copy()
    made[rows, columns] = spsolve(table.tocsc(), right)
    return made
