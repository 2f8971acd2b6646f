"""How far each star of a figure turns in a round: a sweep in towards the joint that holds all, and a sweep back out."""

import numpy as np
from numpy.typing import NDArray


def turns(
    place: NDArray,
    pull: NDArray,
    strength: NDArray,
    firm: NDArray,
    stars: NDArray,
    held: NDArray,
    before: NDArray,
    bend: NDArray,
    first: NDArray,
    count: NDArray,
) -> NDArray:
    """By how much stars turn (n, 3), rotation vectors in the world, so that all pulls are given way to at best.

    The joint that holds all stays; `firm` (n,) is what a star resists a turn by, `bend` (n, 3, 3) a turn against the
    star before it.  What hangs beyond a star is known to it as a pull on the joint between them and a torque, and how
    these change when it moves: two sweeps solve what else is one system of 3 n equations.
    """
    joints = len(place)
    big, cross, spun = np.zeros((joints, 3, 3)), np.zeros((joints, 3, 3)), np.zeros((joints, 3, 3))
    g, torque = pull.copy(), np.zeros((joints, 3))  # what each joint passes on: of its move, of its star's turn
    for j in range(joints):
        for d in range(3):
            big[j, d, d] = strength[j]
    own, mixed = np.empty((len(stars), 3)), np.empty((len(stars), 3, 3))
    back, along = np.empty((len(stars), 3, 3)), np.empty((len(stars), 3, 3))
    arm, part = np.zeros((3, 3)), np.empty((3, 3))
    both, inner, push, spin, all_ = np.empty((3, 3)), np.empty((3, 3)), np.empty(3), np.empty(3), np.empty((3, 3))
    for n in range(len(stars) - 1, -1, -1):  # in
        star, joint = stars[n], held[n]
        all_[:], both[:], inner[:], push[:], spin[:] = 0, 0, 0, 0, 0
        for k in range(first[star] - 1, first[star] + count[star]):
            q = star if k < first[star] else k
            if q == joint:
                if n == 0:  # a second star at the holder
                    for i in range(3):
                        spin[i] += torque[q, i]
                        for j in range(3):
                            inner[i, j] += spun[q, i, j]
                continue
            x, y, z = place[q, 0] - place[joint, 0], place[q, 1] - place[joint, 1], place[q, 2] - place[joint, 2]
            arm[0, 1], arm[0, 2], arm[1, 0], arm[1, 2], arm[2, 0], arm[2, 1] = z, -y, -z, x, y, -x
            for i in range(3):
                push[i] += g[q, i]
                for j in range(3):
                    all_[i, j] += big[q, i, j]
                    part[i, j] = big[q, i, 0] * arm[0, j] + big[q, i, 1] * arm[1, j] + big[q, i, 2] * arm[2, j]
                    part[i, j] += cross[q, i, j]
                    both[i, j] += part[i, j]
            for i in range(3):
                spin[i] += arm[0, i] * g[q, 0] + arm[1, i] * g[q, 1] + arm[2, i] * g[q, 2] + torque[q, i]
                for j in range(3):
                    inner[i, j] += arm[0, i] * part[0, j] + arm[1, i] * part[1, j] + arm[2, i] * part[2, j]
                    inner[i, j] += cross[q, 0, i] * arm[0, j] + cross[q, 1, i] * arm[1, j] + cross[q, 2, i] * arm[2, j]
                    inner[i, j] += spun[q, i, j]
        stiff = bend[n]
        for i in range(3):
            inner[i, i] += firm[n]
            for j in range(3):
                inner[i, j] += stiff[i, j]
        a, b, c, d, e, f = inner[0, 0], inner[1, 1], inner[2, 2], inner[1, 2], inner[0, 2], inner[0, 1]
        size = a * (b * c - d * d) + f * (d * e - f * c) + e * (f * d - b * e)
        back[n, 0, 0], back[n, 1, 1], back[n, 2, 2] = b * c - d * d, a * c - e * e, a * b - f * f
        back[n, 1, 2], back[n, 0, 2], back[n, 0, 1] = e * f - a * d, f * d - b * e, d * e - c * f
        back[n, 2, 1], back[n, 2, 0], back[n, 1, 0] = back[n, 1, 2], back[n, 0, 2], back[n, 0, 1]
        for i in range(3):
            for j in range(3):
                back[n, i, j] /= size
        for i in range(3):
            own[n, i] = back[n, i, 0] * spin[0] + back[n, i, 1] * spin[1] + back[n, i, 2] * spin[2]
            for j in range(3):  # what the star turns by when the joint that holds it moves, when the one before turns
                mixed[n, i, j] = back[n, i, 0] * both[j, 0] + back[n, i, 1] * both[j, 1] + back[n, i, 2] * both[j, 2]
                along[n, i, j] = back[n, i, 0] * stiff[0, j] + back[n, i, 1] * stiff[1, j] + back[n, i, 2] * stiff[2, j]
        for i in range(3):
            torque[joint, i] = stiff[i, 0] * own[n, 0] + stiff[i, 1] * own[n, 1] + stiff[i, 2] * own[n, 2]
            for j in range(3):
                spun[joint, i, j] = stiff[i, j]
                cross[joint, i, j] = 0
                for d in range(3):
                    spun[joint, i, j] -= 0.5 * (stiff[i, d] * along[n, d, j] + stiff[j, d] * along[n, d, i])
                    cross[joint, i, j] += both[i, d] * along[n, d, j]
        for i in range(3):
            g[joint, i] += push[i] - both[i, 0] * own[n, 0] - both[i, 1] * own[n, 1] - both[i, 2] * own[n, 2]
            for j in range(3):
                part[i, j] = both[i, 0] * mixed[n, 0, j] + both[i, 1] * mixed[n, 1, j] + both[i, 2] * mixed[n, 2, j]
        for i in range(3):
            for j in range(3):
                big[joint, i, j] += all_[i, j] - 0.5 * (part[i, j] + part[j, i])
    moved = np.zeros((joints, 3))
    for n in range(len(stars)):  # and out
        star, joint, previous = stars[n], held[n], before[n]
        for i in range(3):
            for j in range(3):
                own[n, i] -= mixed[n, i, j] * moved[joint, j]
                if previous >= 0:
                    own[n, i] += along[n, i, j] * own[previous, j]
        a, b, c = own[n]
        for k in range(first[star] - 1, first[star] + count[star]):
            q = star if k < first[star] else k
            if q == joint:
                continue
            x, y, z = place[q, 0] - place[joint, 0], place[q, 1] - place[joint, 1], place[q, 2] - place[joint, 2]
            moved[q, 0] = moved[joint, 0] + b * z - c * y
            moved[q, 1] = moved[joint, 1] + c * x - a * z
            moved[q, 2] = moved[joint, 2] + a * y - b * x
    return own
