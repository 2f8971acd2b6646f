"""The inner loops of the fits as machine code: pixels are looked up, and normal equations summed, in one pass.

The functions that start with an underscore are plain Python that numba reads; the public ones make arrays ready for
them.  Values are single precision and sums double.  A pixel beyond the picture has the ground's value.
"""

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

NOWHERE = np.zeros((0, 0), np.float32)  # stands for a picture that is not given
EXACT = {"reassoc", "contract", "nsz", "arcp"}  # sums may be reordered, but what is not a number stays one


def look_with_slopes(image: NDArray, at: NDArray, ground: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Bilinear values (P, 4) of an image (H, W, 4) float32 at its own pixels (P, 2), and their x- and y-slopes.

    Slopes (P, 4) are central differences, per pixel of the image.
    """
    return _compiled(_look_with_slopes)(image, ground.astype(np.float32), np.ascontiguousarray(at, np.float32))


def affine_pass(
    image: NDArray,
    known: NDArray | None,
    ground: NDArray,
    placed: NDArray,
    level: tuple[NDArray, NDArray, NDArray, NDArray, NDArray],
    huber: float,
    gone: float,
) -> tuple[NDArray, NDArray, NDArray]:
    """H'WH (6, 6) and H'WZ (6,) of eq. 12 in one pass, and how far every pixel differs (P,), root mean square.

    `placed` (2, 3) leads the template's pixels to the image's own (H, W, 4) float32; a level is its points (P, 2), the
    same about the centre in units of the scale, values, x- and y-slopes (P, 4).  Rows H are gx x, gx y, gy x, gy y, gx,
    gy (eq. 11).  Weights are Huber's, or where `gone` is above 0 the biweight; what is not `known` (H, W) has none.
    """
    cover = NOWHERE if known is None else known
    return _compiled(_affine_pass)(image, cover, ground.astype(np.float32), placed, *level, huber, gone)


def bent_sums(
    points: NDArray,
    modes: NDArray,
    linear: NDArray,
    gx: NDArray,
    gy: NDArray,
    weight: NDArray,
    difference: NDArray,
) -> tuple[NDArray, NDArray]:
    """The same with L modes (P, 2, L) behind the six, which move a pixel by `linear` (2, 2) times modes[..., l].

    Gives (6 + L, 6 + L) and (6 + L,).
    """
    rows, right = _compiled(_bent_rows)(points, modes, linear.astype(np.float32), gx, gy, weight, difference)
    return (rows.T @ rows).astype(float), right


def composite(image: NDArray, matte: NDArray, ground: NDArray, gain: float) -> NDArray:
    """The layer (H, W, 4) float32 of an RGB image (H, W, 3) over a colour (3,); beside it `gain` times the matte."""
    return _compiled(_composite)(image, matte.astype(np.float32), ground.astype(np.float32), np.float32(gain))


@lru_cache
def _compiled(loops: Callable) -> Callable:
    """A function of this file as machine code, which is kept on disk where that is possible."""
    from numba import njit

    try:
        return njit(loops, cache=True, fastmath=EXACT, nogil=True)
    except RuntimeError:  # there is no folder where the machine code could be kept
        return njit(loops, fastmath=EXACT, nogil=True)


def _look_with_slopes(image, ground, at):  # noqa: ANN001, ANN202 - numba infers the types
    one, half = np.float32(1), np.float32(0.5)
    height, width = image.shape[:2]
    values = np.empty((len(at), 4), np.float32)
    gx = np.zeros((len(at), 4), np.float32)
    gy = np.zeros((len(at), 4), np.float32)
    rim = np.empty((4, 4, 4), np.float32)  # what lies round a pixel near the border
    for p in range(len(at)):
        x, y = at[p, 0], at[p, 1]
        if not (x > -2 and y > -2 and x < width + 1 and y < height + 1):
            values[p] = ground
            continue
        j, i = int(np.floor(x)) - 1, int(np.floor(y)) - 1
        u, v = x - np.float32(j + 1), y - np.float32(i + 1)
        a, b, c, d = (one - u) * (one - v), u * (one - v), (one - u) * v, u * v
        near, k, m = image, i, j
        if j < 0 or i < 0 or j > width - 4 or i > height - 4:
            for row in range(4):
                for column in range(4):
                    beyond = i + row < 0 or j + column < 0 or i + row >= height or j + column >= width
                    for n in range(4):
                        rim[row, column, n] = ground[n] if beyond else image[i + row, j + column, n]
            near, k, m = rim, 0, 0
        for n in range(4):
            p00, p01 = near[k + 1, m + 1, n], near[k + 1, m + 2, n]
            p10, p11 = near[k + 2, m + 1, n], near[k + 2, m + 2, n]
            values[p, n] = a * p00 + b * p01 + c * p10 + d * p11
            gx[p, n] = half * (
                a * (p01 - near[k + 1, m, n])
                + b * (near[k + 1, m + 3, n] - p00)
                + c * (p11 - near[k + 2, m, n])
                + d * (near[k + 2, m + 3, n] - p10)
            )
            gy[p, n] = half * (
                a * (p10 - near[k, m + 1, n])
                + b * (p11 - near[k, m + 2, n])
                + c * (near[k + 3, m + 1, n] - p00)
                + d * (near[k + 3, m + 2, n] - p01)
            )
    return values, gx, gy


def _affine_pass(image, known, ground, placed, points, local, values, slopes_x, slopes_y, huber, gone):  # noqa: ANN001, ANN202
    """Three products of slopes times the six monomials of x and y are summed, then each put in its places."""
    one = np.float32(1)
    height, width = image.shape[:2]
    sums = np.zeros((3, 6))  # xx, xy, yy times x x, x y, y y, x, y, 1
    right = np.zeros(6)
    sizes = np.empty(len(points), np.float32)
    rim = np.empty((2, 2, 4), np.float32)  # what lies round a pixel near the border
    for p in range(len(points)):
        x = np.float32(placed[0, 0] * points[p, 0] + placed[0, 1] * points[p, 1] + placed[0, 2])
        y = np.float32(placed[1, 0] * points[p, 0] + placed[1, 1] * points[p, 1] + placed[1, 2])
        inside = x > -1 and y > -1 and x < width and y < height
        j, i = (int(np.floor(x)), int(np.floor(y))) if inside else (0, 0)
        u, v = (x - np.float32(j), y - np.float32(i)) if inside else (one, one)
        near, k, m, seen = image, i, j, one
        if not inside or j < 0 or i < 0 or j > width - 2 or i > height - 2:
            for row in range(2):
                for column in range(2):
                    beyond = not inside or i + row < 0 or j + column < 0 or i + row >= height or j + column >= width
                    for n in range(4):
                        rim[row, column, n] = ground[n] if beyond else image[i + row, j + column, n]
            near, k, m = rim, 0, 0
        elif known.size:
            seen = (one - v) * ((one - u) * known[i, j] + u * known[i, j + 1])
            seen += v * ((one - u) * known[i + 1, j] + u * known[i + 1, j + 1])
        a, b, c, d = (one - u) * (one - v), u * (one - v), (one - u) * v, u * v
        square = xx = xy = yy = bx = by = np.float32(0)
        for n in range(4):
            value = a * near[k, m, n] + b * near[k, m + 1, n] + c * near[k + 1, m, n] + d * near[k + 1, m + 1, n]
            off, gx, gy = value - values[p, n], slopes_x[p, n], slopes_y[p, n]
            square += off * off
            xx += gx * gx
            xy += gx * gy
            yy += gy * gy
            bx += gx * off
            by += gy * off
        size = np.sqrt(square / 4)
        sizes[p] = size
        if gone > 0:
            weight = seen * max(one - (size / np.float32(gone)) ** 2, np.float32(0)) ** 2
        else:
            weight = seen * min(one, np.float32(huber) / max(size, np.float32(1e-9)))
        x, y = local[p, 0], local[p, 1]
        for k, product in enumerate((weight * xx, weight * xy, weight * yy)):
            sums[k, 0] += product * x * x
            sums[k, 1] += product * x * y
            sums[k, 2] += product * y * y
            sums[k, 3] += product * x
            sums[k, 4] += product * y
            sums[k, 5] += product
        bx, by = weight * bx, weight * by
        right[0] += bx * x
        right[1] += bx * y
        right[2] += by * x
        right[3] += by * y
        right[4] += bx
        right[5] += by
    normal = np.empty((6, 6))
    monomial = ((0, 1, 3), (1, 2, 4), (3, 4, 5))  # of x, y, 1 times x, y, 1
    place = ((0, 1, 4), (2, 3, 5))  # of gx and gy times x, y, 1
    for i in range(3):
        for j in range(3):
            normal[place[0][i], place[0][j]] = sums[0, monomial[i][j]]
            normal[place[1][i], place[1][j]] = sums[2, monomial[i][j]]
            normal[place[0][i], place[1][j]] = normal[place[1][j], place[0][i]] = sums[1, monomial[i][j]]
    return normal, right, sizes


def _bent_rows(points, modes, linear, gx, gy, weight, difference):  # noqa: ANN001, ANN202 - numba infers the types
    """Two rows a pixel whose squares add up to the normal matrix: its slopes' 2 x 2 sum in triangular form."""
    count = modes.shape[2]
    rows = np.zeros((2 * len(points), 6 + count), np.float32)
    right = np.zeros(6 + count)
    for p in range(len(points)):
        if weight[p] == 0:
            continue
        xx = xy = yy = bx = by = np.float32(0)
        for c in range(4):
            xx += gx[p, c] * gx[p, c]
            xy += gx[p, c] * gy[p, c]
            yy += gy[p, c] * gy[p, c]
            bx += gx[p, c] * difference[p, c]
            by += gy[p, c] * difference[p, c]
        x, y, w = points[p, 0], points[p, 1], weight[p]
        xx, xy, yy, bx, by = w * xx, w * xy, w * yy, w * bx, w * by
        r = np.sqrt(xx + np.float32(1e-12))
        s = xy / r
        t = np.sqrt(max(yy - s * s, np.float32(0)))
        first, second = rows[2 * p], rows[2 * p + 1]
        first[0], first[1], first[2], first[3], first[4], first[5] = r * x, r * y, s * x, s * y, r, s
        second[2], second[3], second[5] = t * x, t * y, t
        right[0] += bx * x
        right[1] += bx * y
        right[2] += by * x
        right[3] += by * y
        right[4] += bx
        right[5] += by
        for m in range(count):
            mx = linear[0, 0] * modes[p, 0, m] + linear[0, 1] * modes[p, 1, m]
            my = linear[1, 0] * modes[p, 0, m] + linear[1, 1] * modes[p, 1, m]
            first[6 + m] = r * mx + s * my
            second[6 + m] = t * my
            right[6 + m] += bx * mx + by * my
    return rows, right


def _composite(image, matte, ground, gain):  # noqa: ANN001, ANN202 - numba infers the types
    height, width = matte.shape
    layer = np.empty((height, width, 4), np.float32)
    for i in range(height):
        for j in range(width):
            a = matte[i, j]
            for c in range(3):
                layer[i, j, c] = a * (np.float32(image[i, j, c]) - ground[c]) + ground[c]
            layer[i, j, 3] = gain * a
    return layer
