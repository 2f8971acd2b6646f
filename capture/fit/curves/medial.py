"""The line of action found automatically: the medial line of a matte, from one extremity to the other.

The longest way through the skeleton says where the line runs; then it is laid half-way between the two
sides, measured on the soft edge of the matte, which makes it smooth and exact to a fraction of a pixel.
Over time its ends are followed together, by dynamic programming: they neither swap nor jump.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError

CANDIDATES = 16
"""So many ways through the skeleton of one frame are weighed against those of its neighbours."""

REACH = 1.35
"""A side of the line may be so many times as far as its nearest edge; beyond that another limb begins."""


def medial_line(matte: NDArray, ends: NDArray | None = None, count: int = 48) -> NDArray:
    """The smooth open curve (count, 2) through the middle of a matte (H, W), evenly spaced by arc length.

    The matte is bool, uint8 or 0-1; its largest piece counts.  `ends` (2, 2) are two places in it, the line runs from
    the first to the second; without them it joins the extremities, the lower one first.
    """
    alpha = _solid(matte)
    if ends is None:
        found = _ways(alpha)
        way = max(found, key=lambda way: way.length)
        path = way.path if _rises(way.path) else way.path[::-1]
    else:
        path = _way_between(alpha, _two_places(ends))
    return even(_centred(path, alpha, extended=ends is None), count)


def medial_lines(
    mattes: list[NDArray] | NDArray,
    ends: NDArray | None = None,
    count: int = 48,
    steady: float = 0.0,
    calm: float = 0.0,
) -> NDArray:
    """One medial line a matte, (T, count, 2), all in the same direction, their ends followed over time.

    `ends` (2, 2) says which extremities are meant in the first frame, foot first; (T, 2, 2) fixes the ends of every
    frame.  `steady` evens the lines out over so many frames: mattes of film flicker.  `calm` smooths each line over
    such a share of its length: a line of action is one swing, an outline has more to say.
    """
    if len(mattes) == 0:
        raise InputError("medial lines need at least one matte, none came: give the frames' mattes")
    if ends is not None and np.ndim(ends) == 3:
        if len(ends) != len(mattes):
            raise InputError(
                f"ends of the line must be given for the first frame or for each of the {len(mattes)} frames, "
                f"they came for {len(ends)}"
            )
        found = [medial_line(matte, two, count) for matte, two in zip(mattes, ends)]
        return steadied(np.stack([even(smoothed(line, calm), count) for line in found]), steady)
    solid = [_solid(matte) for matte in mattes]
    ways = [_both_directions(_ways(alpha)) for alpha in solid]
    centres = np.array([np.argwhere(alpha > 0.5).mean(axis=0)[::-1] for alpha in solid])
    chosen = _followed(ways, centres, None if ends is None else _two_places(ends))
    found = [even(_centred(way.path, alpha), count) for way, alpha in zip(chosen, solid)]
    return steadied(np.stack([even(smoothed(line, calm), count) for line in found]), steady)


def even(line: NDArray, count: int) -> NDArray:
    """An open curve (M, 2) as `count` points at equal distances along it."""
    along = arc_length(line)
    at = np.linspace(0, along[-1], count)
    return np.stack([np.interp(at, along, line[:, axis]) for axis in range(2)], axis=-1)


def arc_length(line: NDArray) -> NDArray:
    """How far along an open curve (M, 2) each of its points lies (M,), in pixels, from 0."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])


def steadied(lines: NDArray, frames: float) -> NDArray:
    """Lines (T, n, 2) evened out over time by a median, for lone bad mattes, and a Gaussian of `frames` each.

    A steady travel stays as it is, at both ends too.
    """
    from scipy.ndimage import median_filter

    reach = min(int(np.ceil(frames)), len(lines) - 1)
    if reach < 1:
        return lines
    middle = median_filter(_padded(lines, reach), size=(2 * reach + 1, 1, 1))[reach : reach + len(lines)]
    return _evened(middle, frames)


def smoothed(values: NDArray, share: float) -> NDArray:
    """Values (M, ...) at even places along a line, smoothed by a Gaussian of a share of its length; ends stay."""
    return _evened(values, share * len(values))


def _padded(values: NDArray, reach: int) -> NDArray:
    """The first axis of `values` (M, ...) carried on by `reach` at both ends, by odd reflection."""
    before, after = 2 * values[:1] - values[reach:0:-1], 2 * values[-1:] - values[-2 : -reach - 2 : -1]
    return np.concatenate([before, values, after])


def _evened(values: NDArray, sigma: float) -> NDArray:
    """A Gaussian along the first axis of `values` (M, ...), with odd reflection at the ends."""
    from scipy.ndimage import gaussian_filter1d

    reach = min(int(4 * sigma) + 1, len(values) - 1)
    if reach < 1 or sigma <= 0:
        return values
    smooth = gaussian_filter1d(_padded(values, reach), sigma, axis=0, truncate=4.0, mode="nearest")
    return smooth[reach : reach + len(values)]


def _solid(matte: NDArray) -> NDArray:
    """The largest piece of a matte as float coverage (H, W) in 0-1, its holes filled, hairs of it cut off."""
    from scipy import ndimage
    from skimage import morphology

    matte = np.asarray(matte)
    if matte.ndim != 2:
        raise InputError(f"a matte must be one picture (H, W) of coverage, it came with shape {matte.shape}")
    alpha = matte.astype(float) / (255.0 if matte.dtype == np.uint8 and matte.max() > 1 else 1.0)
    inside = np.pad(ndimage.binary_fill_holes(alpha > 0.5), 2)
    opened = morphology.opening(inside, morphology.disk(1.5))
    if opened.sum() > 0.9 * inside.sum():  # a shape that is a hair itself stays
        inside = opened
    named, pieces = ndimage.label(inside, np.ones((3, 3)))
    sizes = np.bincount(named.ravel(), minlength=pieces + 1)[1:]
    if pieces == 0 or sizes.max() < 12:
        raise InputError(
            f"a medial line needs a matte with something in it, its largest piece has {sizes.max(initial=0)} pixels: "
            "give another matte or leave the frame out"
        )
    body = (named == 1 + sizes.argmax())[2:-2, 2:-2]
    near = ndimage.binary_dilation(body)
    return np.where(body, np.maximum(alpha, 0.51), np.where(near, np.minimum(alpha, 0.49), 0.0))


def _two_places(ends: NDArray) -> NDArray:
    ends = np.asarray(ends, float)
    if ends.shape != (2, 2) or not np.isfinite(ends).all() or np.allclose(ends[0], ends[1]):
        raise InputError(f"the ends of a line must be two different places (x, y), they came as {ends.tolist()}")
    return ends


@dataclass(frozen=True, eq=False)
class _Way:
    """One way through a skeleton."""

    path: NDArray  # (M, 2) pixels, from tip to tip
    length: float  # each step weighs the square root of the width there: a whisker counts little


def _ways(alpha: NDArray) -> list[_Way]:
    """The longest ways through the skeleton of a matte (H, W), from tip to tip, spurs at their ends cut off."""
    from scipy import ndimage
    from scipy.sparse.csgraph import dijkstra
    from skimage import morphology

    inside = np.pad(alpha > 0.5, 1)
    radius = ndimage.distance_transform_edt(inside)[1:-1, 1:-1]
    soft = ndimage.gaussian_filter(np.pad(alpha, 3), 1.0) > 0.5  # a ragged edge grows fewer spurs
    spots = np.argwhere(morphology.skeletonize(soft)[3:-3, 3:-3] & (radius > 0))
    if len(spots) < 2:
        spots = _long_axis(alpha)
    at = radius[tuple(spots.T)]
    graph, weighed = _skeleton_graph(spots, at)
    tips = np.flatnonzero(np.asarray((graph > 0).sum(axis=1)).ravel() == 1)
    if len(tips) < 2:  # a ring or a blob: the two spots farthest from each other
        first = int(np.argmax(dijkstra(graph, indices=0)))
        tips = np.array([first, int(np.argmax(np.where(np.isfinite(d := dijkstra(graph, indices=first)), d, -1)))])
    far, before = dijkstra(weighed, indices=tips, return_predecessors=True)
    pairs = [(far[i, tips[j]], i, j) for i, j in combinations(range(len(tips)), 2) if np.isfinite(far[i, tips[j]])]
    found = []
    for length, i, j in sorted(pairs, reverse=True)[:CANDIDATES]:
        steps = [int(tips[j])]
        while steps[-1] != tips[i]:
            steps.append(int(before[i, steps[-1]]))
        found.append(_Way(_without_spurs(spots[steps][:, ::-1].astype(float), at[steps]), float(length)))
    return found


def _long_axis(alpha: NDArray) -> NDArray:
    """Rows and columns (M, 2) of pixels along a small blob's longer side: it has no skeleton to speak of."""
    rows, columns = np.nonzero(alpha > 0.5)
    if np.ptp(rows) >= np.ptp(columns):
        return np.array([(r, round(columns[rows == r].mean())) for r in np.unique(rows)])
    return np.array([(round(rows[columns == c].mean()), c) for c in np.unique(columns)])


def _skeleton_graph(spots: NDArray, radius: NDArray) -> tuple[object, object]:
    """Sparse graphs (M, M) of neighbouring skeleton pixels (M, 2): by length, and by length times root of width."""
    from scipy import sparse
    from scipy.spatial import cKDTree

    a, b = np.array(sorted(cKDTree(spots).query_pairs(1.5))).reshape(-1, 2).T
    number = {tuple(spot): n for n, spot in enumerate(spots.tolist())}
    long = np.linalg.norm(spots[a] - spots[b], axis=1)
    # a diagonal beside a corner pixel is no second way
    corner = [(spots[p][0], spots[q][1]) in number or (spots[q][0], spots[p][1]) in number for p, q in zip(a, b)]
    keep = ~((long > 1.2) & np.array(corner, bool))
    a, b, long = a[keep], b[keep], long[keep]
    width = np.sqrt(0.5 * (radius[a] + radius[b]))
    shape = (len(spots), len(spots))
    both = (np.concatenate([a, b]), np.concatenate([b, a]))
    lengths = sparse.csr_matrix((np.tile(long, 2), both), shape=shape)
    return lengths, sparse.csr_matrix((np.tile(long * width, 2), both), shape=shape)


def _without_spurs(path: NDArray, radius: NDArray) -> NDArray:
    """The path (M, 2) without the pieces at its ends that only run into a corner of a larger disc of it."""
    cut = []
    for points, size in ((path, radius), (path[::-1], radius[::-1])):
        near = np.linalg.norm(points - points[0], axis=1) <= 1.5 * size
        near &= (arc_length(points) <= 2 * size) & (size > 2 * size[0])  # a round end's tip is no corner
        cut.append(int(np.flatnonzero(near).max(initial=0)))
    stop = len(path) - cut[1]
    if stop - cut[0] < 3:  # a disc: what is left of it is its middle
        return path
    return path[cut[0] : stop]


def _way_between(alpha: NDArray, ends: NDArray) -> NDArray:
    """The path (M, 2) inside a matte from one place to another that keeps to its middle."""
    from scipy import ndimage
    from skimage import graph

    inside = alpha > 0.5
    radius = ndimage.distance_transform_edt(np.pad(inside, 1))[1:-1, 1:-1]
    spots = np.argwhere(inside)[:, ::-1]
    nearest = [spots[np.linalg.norm(spots - end, axis=1).argmin()][::-1] for end in ends]
    cost = np.where(inside, 1 / np.maximum(radius, 0.5) ** 2, -1.0)
    path, _ = graph.route_through_array(cost, *map(tuple, nearest), geometric=True)
    path = np.array(path)[:, ::-1].astype(float)
    path[0], path[-1] = ends
    return path


def _rises(path: NDArray) -> bool:
    """Whether a path (M, 2) starts at its lower end, or at its left one where it lies flat."""
    way = path[-1] - path[0]
    return way[1] < 0 if abs(way[1]) > 0.2 * abs(way[0]) else way[0] > 0


def _both_directions(ways: list[_Way]) -> list[_Way]:
    return [turned for way in ways for turned in (way, _Way(way.path[::-1], way.length))]


def _followed(ways: list[list[_Way]], centres: NDArray, ends: NDArray | None) -> list[_Way]:
    """One way a frame: long ones whose ends move little against the matte's centre (T, 2), by Viterbi."""
    size = max(arc_length(way.path)[-1] for way in ways[0]) + 1e-9
    # a way 10 % shorter is taken to spare the ends a jump of a third of the line
    alone = [np.array([1 - way.length / max(w.length for w in frame) for way in frame]) for frame in ways]
    places = [np.array([way.path[[0, -1]] for way in frame]) - centre for frame, centre in zip(ways, centres)]
    if ends is None:
        alone[0] = alone[0] + np.array([0.0 if _rises(way.path) else 9.0 for way in ways[0]])
    else:
        alone[0] = alone[0] + 9 * np.linalg.norm(places[0] + centres[0] - ends, axis=-1).sum(axis=1) / size
    total, back = alone[0], []
    for t in range(1, len(ways)):
        jump = np.linalg.norm(places[t][:, None] - places[t - 1][None], axis=-1).sum(axis=-1) / size  # (new, old)
        cost = total[None] + np.minimum(jump**2, 2.0)
        back.append(cost.argmin(axis=1))
        total = cost.min(axis=1) + alone[t]
    number = [int(total.argmin())]
    for before in reversed(back):
        number.append(int(before[number[-1]]))
    return [frame[n] for frame, n in zip(ways, reversed(number))]


def _centred(path: NDArray, alpha: NDArray, extended: bool = True, rounds: int = 9) -> NDArray:
    """A rough path (M, 2) as a smooth line half-way between the two sides of the matte, out to its outline.

    Each round moves the line along its normals by the smoothed distance from the middle of its section.  It is
    that distance which is smoothed, not the line: a line in the middle stays there, however it bends.
    """
    from scipy import ndimage

    radius = ndimage.distance_transform_edt(np.pad(alpha > 0.5, 1))[1:-1, 1:-1]
    mean = float(np.mean(_sample(radius, path)))
    length = arc_length(path)[-1]
    count = int(np.clip(length / 2, 12, 400))
    step = max(length, 1.0) / (count - 1)
    sigma = min(max(0.8 * mean / step, 1.0), count / 6)
    line = even(_evened(even(path, count), sigma), count)
    for number in range(rounds):
        if number in (2, 5) and extended:
            line = even(_to_outline(line, alpha, mean), count)
        held = None if extended else line[[0, -1]]
        off = _evened(_off_middle(line, alpha, radius), sigma)
        line = line + off[:, None] * normals(line)
        if held is not None:
            line[[0, -1]] = held
        line = even(line, count)
    return _to_outline(line, alpha, mean) if extended else line


def normals(line: NDArray) -> NDArray:
    """Unit normals (M, 2) of an open curve (M, 2): its tangents turned by a quarter, x towards y."""
    way = np.gradient(line, axis=0)
    way = way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-12)
    return np.stack([-way[:, 1], way[:, 0]], axis=-1)


def _off_middle(line: NDArray, alpha: NDArray, radius: NDArray) -> NDArray:
    """How far (M,) along its normal the middle of the section lies from each point of a line (M, 2).

    A side is looked for up to REACH times the distance to the nearest edge: a limb that branches off has no say.
    """
    across = normals(line)
    here = np.maximum(_sample(radius, line), 1.0)
    sides = []
    steps = np.arange(0, REACH * here.max() + 1.5, 0.5)
    for sign in (1, -1):
        seen = _sample(alpha, line[:, None] + sign * steps[:, None] * across[:, None]) - 0.5  # (M, steps)
        out = np.argmax(seen <= 0, axis=1)
        out = np.where((seen <= 0).any(axis=1), out, len(steps) - 1)
        low, high = seen[np.arange(len(line)), np.maximum(out - 1, 0)], seen[np.arange(len(line)), out]
        share = np.where(out > 0, low / np.where(low > high, low - high, 1.0), 0.0)
        reach = (np.maximum(out - 1, 0) + np.clip(share, 0, 1)) * 0.5
        sides.append(np.minimum(reach, REACH * here))
    return 0.5 * (sides[0] - sides[1])


def _to_outline(line: NDArray, alpha: NDArray, mean: float) -> NDArray:
    """The line (M, 2) cut or carried straight on at both ends, so that it just reaches the matte's edge."""
    for _ in range(2):
        line = line[::-1]
        inside = _sample(alpha, line) > 0.5
        if not inside[-1]:
            line = line[: max(int(np.flatnonzero(inside).max(initial=2)) + 1, 3)]
        back = np.searchsorted(-arc_length(line[::-1])[::-1], -0.7 * mean)
        way = line[-1] - line[min(back, len(line) - 2)]
        way = way / max(np.linalg.norm(way), 1e-9)
        steps = np.arange(0, 4 * mean + 4, 0.25)
        seen = _sample(alpha, line[-1] + steps[:, None] * way) > 0.5
        reach = steps[int(np.argmin(seen)) if not seen.all() else -1]
        more = np.arange(1, int(reach) + 1)
        tail = line[-1] + np.append(more, reach)[:, None] * way if reach > 0.5 else line[:0]
        line = np.vstack([line, tail])
    return line


def _sample(picture: NDArray, points: NDArray) -> NDArray:
    """A picture (H, W) at points (..., 2), straight between pixels, 0 outside."""
    from scipy import ndimage

    return ndimage.map_coordinates(picture, np.moveaxis(points[..., ::-1], -1, 0), order=1, mode="constant")
