"""Particles suspended from moving anchors, and tied to each other: stepping them through the frames.

Twice the same: `run` in plain NumPy, all particles at once, and `compiled`, loop by loop, as machine code.  A
particle's state is its offset z from the anchor and its speed w against it.  A step is half a step as if there were no
links, exact for an anchor that goes along a cubic; the links' kick; and half a step again.
"""

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

NOTHING = 1e-9
"""Links shorter than this, in metres, have no direction: they are left out."""


@lru_cache
def compiled() -> Callable[..., NDArray]:
    """`run` as machine code, which is kept on disk where that is possible."""
    from numba import njit

    try:
        return njit(_loops, cache=True, error_model="numpy", nogil=True)
    except RuntimeError:  # there is no folder where the machine code could be kept
        return njit(_loops, error_model="numpy", nogil=True)


def run(
    anchors: NDArray,
    slopes: NDArray,
    state: NDArray,
    child: NDArray,
    parent: NDArray,
    pull: NDArray,
    drag: NDArray,
    spring: NDArray,
    fps: float,
    steps: int,
) -> NDArray:
    """Offsets and speeds (2, T, S, 3) from a first `state` (2, S, 3), of particles whose anchors (T, S, 3) are given.

    `slopes` (T, S, 3) is how far an anchor goes in a frame.  L links go from `child` to `parent` (L,), and `pull` and
    `drag` (L,) so hard.  `spring` (S, 2, 4) is what a free particle does in half a step, from z, w, the anchor's
    acceleration and what that changes by in a second.
    """
    out = np.zeros((2, *anchors.shape))
    out[:, 0] = z, w = state
    for t in range(len(anchors) - 1):
        a, m, gone = anchors[t], slopes[t], anchors[t + 1] - anchors[t]
        b, e = 3 * gone - 2 * m - slopes[t + 1], m + slopes[t + 1] - 2 * gone  # y = a + m u + b u^2 + e u^3
        for half in range(2 * steps):
            u = half / (2 * steps)
            bend = np.stack([2 * b + 6 * e * u, 6 * fps * e], axis=1) * fps**2
            z, w = np.moveaxis(np.einsum("sij,sjd->sid", spring, np.stack([z, w, *np.moveaxis(bend, 1, 0)], 1)), 1, 0)
            if half % 2 == 0 and len(child):
                u += 0.5 / steps
                y, v = a + u * (m + u * (b + u * e)), fps * (m + u * (2 * b + 3 * u * e))
                w = w + _kicks(y, v, z, w, child, parent, pull, drag) / (fps * steps)
        out[:, t + 1] = z, w
    return out


def _kicks(
    y: NDArray, v: NDArray, z: NDArray, w: NDArray, child: NDArray, parent: NDArray, pull: NDArray, drag: NDArray
) -> NDArray:
    """Accelerations (S, 3) by the links, of particles at y + z that move at v + w."""
    wanted, goes = y[child] - y[parent], v[child] - v[parent]
    link, moves = wanted + z[child] - z[parent], goes + w[child] - w[parent]
    length, now = np.linalg.norm(wanted, axis=1), np.linalg.norm(link, axis=1)
    there = (length > NOTHING) & (now > NOTHING)
    safe, own = np.where(there, now, 1)[:, None], np.where(there, length, 1)[:, None]
    along = link / safe
    faster = (along * moves).sum(axis=1) - (wanted / own * goes).sum(axis=1)
    force = np.where(there, -pull * (now - length) - drag * faster, 0)[:, None] * along
    total = np.zeros_like(y)
    np.add.at(total, child, force)
    np.add.at(total, parent, -force)
    return total


def _loops(anchors, slopes, state, child, parent, pull, drag, spring, fps, steps):  # noqa: ANN001, ANN202 - numba's
    frames, count, _ = anchors.shape
    out = np.empty((2, frames, count, 3))
    z, w = state[0].copy(), state[1].copy()
    b, e = np.empty((count, 3)), np.empty((count, 3))
    y, v, kick = np.empty((count, 3)), np.empty((count, 3)), np.zeros((count, 3))
    step = 1 / (fps * steps)
    out[0, 0], out[1, 0] = z, w
    for t in range(frames - 1):
        for s in range(count):
            for d in range(3):
                gone = anchors[t + 1, s, d] - anchors[t, s, d]
                b[s, d] = 3 * gone - 2 * slopes[t, s, d] - slopes[t + 1, s, d]
                e[s, d] = slopes[t, s, d] + slopes[t + 1, s, d] - 2 * gone
        for half in range(2 * steps):
            u = half / (2 * steps)
            for s in range(count):
                for d in range(3):
                    bend, more = fps * fps * (2 * b[s, d] + 6 * e[s, d] * u), 6 * fps * fps * fps * e[s, d]
                    p, now, goes = spring[s], z[s, d], w[s, d]
                    z[s, d] = p[0, 0] * now + p[0, 1] * goes + p[0, 2] * bend + p[0, 3] * more
                    w[s, d] = p[1, 0] * now + p[1, 1] * goes + p[1, 2] * bend + p[1, 3] * more
            if half % 2 == 1 or len(child) == 0:
                continue
            u += 0.5 / steps
            for s in range(count):
                for d in range(3):
                    m = slopes[t, s, d]
                    y[s, d] = anchors[t, s, d] + u * (m + u * (b[s, d] + u * e[s, d]))
                    v[s, d] = fps * (m + u * (2 * b[s, d] + 3 * u * e[s, d]))
            kick[:] = 0
            for n in range(len(child)):
                c, p = child[n], parent[n]
                length, now, goes, moves = 0.0, 0.0, 0.0, 0.0
                for d in range(3):
                    wanted = y[c, d] - y[p, d]
                    link = wanted + z[c, d] - z[p, d]
                    length, now = length + wanted * wanted, now + link * link
                    goes += wanted * (v[c, d] - v[p, d])
                    moves += link * (v[c, d] - v[p, d] + w[c, d] - w[p, d])
                length, now = np.sqrt(length), np.sqrt(now)
                if length <= NOTHING or now <= NOTHING:
                    continue
                force = -pull[n] * (now - length) - drag[n] * (moves / now - goes / length)
                for d in range(3):
                    along = force * (y[c, d] - y[p, d] + z[c, d] - z[p, d]) / now
                    kick[c, d] += along
                    kick[p, d] -= along
            for s in range(count):
                for d in range(3):
                    w[s, d] += step * kick[s, d]
        out[0, t + 1], out[1, t + 1] = z, w
    return out
