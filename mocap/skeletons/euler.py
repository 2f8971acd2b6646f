"""Turns told as angles about axes one after the other, each about the axes that the ones before have turned.

In plain NumPy over whole arrays: SciPy takes microseconds an element for this, and a clip has 100,000 of them.
"""

import numpy as np
from numpy.typing import NDArray


def quaternions(order: str, degrees: NDArray) -> NDArray:
    """Quaternions (..., 4), (x, y, z, w), of turns about the axes of `order`, such as "ZXY", by degrees (..., C).

    Any number of axes, in any order: "" is no turn, "Y" a hinge, and an axis may come twice.
    """
    degrees = np.asarray(degrees, float)
    whole = np.zeros((4, *degrees.shape[:-1]))
    whole[3] = 1.0
    for axis, angle in zip(order, np.moveaxis(degrees, -1, 0)):
        half = np.radians(angle % 720.0) / 2  # whole turns apart a quaternion is itself or its negative
        s, c = np.sin(half), np.cos(half)
        i = "XYZ".index(axis)
        j, k = (i + 1) % 3, (i + 2) % 3
        qi, qj, qk, w = (whole[n].copy() for n in (i, j, k, 3))
        whole[i], whole[3] = qi * c + w * s, w * c - qi * s  # times (s about the axis, c)
        whole[j], whole[k] = qj * c + qk * s, qk * c - qj * s
    return np.moveaxis(whole, 0, -1)


def degrees_zxy(rotations: NDArray) -> NDArray:
    """Degrees (..., 3) about z, x and y for unit quaternions (..., 4): the order that most BVH files have.

    Where x turns by a quarter the other two turn about one axis: then all of it is in z.
    """
    x, y, z, w = np.moveaxis(np.asarray(rotations, float), -1, 0)
    r01, r11, r21 = 2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)
    r20, r22 = 2 * (x * z - y * w), 1 - 2 * (x * x + y * y)
    flat = np.hypot(r01, r11)
    level = flat > 1e-7
    about_z = np.where(level, np.arctan2(-r01, r11), np.arctan2(2 * (x * y + z * w), 1 - 2 * (y * y + z * z)))
    about_y = np.where(level, np.arctan2(-r20, r22), 0.0)
    return np.degrees(np.stack([about_z, np.arctan2(r21, flat), about_y], axis=-1))
