"""Smooth fields: how a drawing is pushed about where no key says so, and neighbouring places go together.

A Gaussian process over the place in the mesh (Rasmussen & Williams 2006, section 4.2): two points' pushes are
the more alike the nearer they lie.  Its strongest eigenfunctions are modes of shape like those of the keys.
"""

import numpy as np
from numpy.typing import NDArray

REACH = 0.2  # of the part's longer side: over this distance pushes go together
NODES = 300  # mesh points from which the fields are found; the others follow (Nystroem)
LEAST = 1e-3  # of the strongest field's share: weaker ones are left out


def smooth_fields(points: NDArray, most: int = 20) -> tuple[NDArray, NDArray]:
    """Fields (F, N, 2) over mesh points (N, 2), at most `most` along each axis, and their spreads (F,).

    Weights drawn with these spreads push every point by about one pixel along each axis, root mean square.
    """
    nodes = points[:: -(-len(points) // NODES)]
    reach = REACH * float(np.ptp(points, axis=0).max())
    share, own = np.linalg.eigh(_alike(nodes, nodes, reach))
    share, own = share[::-1][:most], own[:, ::-1][:, :most]
    kept = share > LEAST * share[0]
    share, own = share[kept], own[:, kept]
    along = _alike(points, nodes, reach) @ (own / share)  # (N, M): of unit length on the nodes
    nothing = np.zeros_like(along)
    fields = np.concatenate([np.stack([along, nothing], -1), np.stack([nothing, along], -1)], axis=1)
    return fields.transpose(1, 0, 2), np.tile(np.sqrt(share), 2)


def _alike(points: NDArray, nodes: NDArray, reach: float) -> NDArray:
    """How far (N, M) the pushes of points go with those of the nodes."""
    apart = points[:, None] - nodes
    return np.exp(-0.5 * (apart**2).sum(axis=-1) / reach**2)
