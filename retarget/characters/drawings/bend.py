"""A whole character bent along one curve: the target of a line of action (Bregler et al. 2002, section 4).

The captured line is a ribbon (see `capture.fit.action`).  The target plays the ribbon itself, so the stage
mixes and places it like any mesh; each frame, the drawing follows the ribbon's middle.  A control
point keeps how far along its rest line it lies and how far across it; it is redrawn along the line as it now is.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.fit.action import centre_lines
from capture.fit.curves import medial
from capture.motion import affine, keys
from capture.motion.keys import Inbetweener, KeySet
from retarget.characters.drawings import paths
from retarget.characters.drawings.embed import silhouette_of
from retarget.characters.drawings.paths import DrawnPath, Gradient
from retarget.characters.drawings.svg import read_svg

PIECES = 60
"""Curves of a drawing are cut to about this many pieces along its line, so that they can bend."""

TIGHT = 0.6
"""Offsets up to this share of the radius of a bend are kept; beyond, on the inner side, they are squeezed."""


@dataclass(frozen=True, eq=False)
class Bent:
    """A vector drawing that follows a line of action, as a target."""

    part: str
    keys: KeySet  # the source's ribbons
    box: NDArray  # (2, 2) of the first of them: the line stands where the source's stood
    line: NDArray  # (n, 2) the drawing's own line at rest, from foot to top
    paths: tuple[DrawnPath, ...]
    along: NDArray  # (P,) where each control point lies along the rest line, 0 to 1, beyond its ends too
    across: NDArray  # (P,) and how far across it, in units of the drawing
    thinning: float = 0.0  # width goes with stretch to the power of minus this: 0 keeps it, 0.5 keeps the volume
    between: Inbetweener = keys.rigid
    height: float = 1.0
    pivot: NDArray | None = None
    notes: tuple[str, ...] = ()  # what a user should be told

    @property
    def unit(self) -> float:
        """The source's pixels for one of the drawing's units: the first key line is as long as the rest line."""
        return _length(centre_lines(self.keys.points[0])) / _length(self.line)

    def shapes(self, rows: NDArray) -> NDArray:
        """The ribbons (D, N, 2) for rows (D, 3): the drawing follows their mix, it is not mixed itself."""
        return keys.shapes(keys.with_rows(self.keys, rows), self.between)

    def posed(self, points: NDArray, weights: NDArray, scale: float) -> list[DrawnPath]:
        """The drawing along the middle of the ribbon at `points` (N, 2) on the stage; strokes keep their width."""
        size = scale * self.unit
        controls = self.along_line(centre_lines(np.asarray(points, float)), size)
        stops = np.cumsum([0, *(len(path.points) for path in self.paths)])
        drawn = []
        for path, start, stop in zip(self.paths, stops[:-1], stops[1:], strict=True):
            here, fill, stroke = controls[start:stop], path.fill, path.stroke
            if isinstance(fill, Gradient) or isinstance(stroke, Gradient):
                place = affine.fit(path.points, here)
                fill, stroke = paths.carried(fill, place), paths.carried(stroke, place)
            dashes = tuple(size * length for length in path.dashes)
            drawn.append(replace(path, points=here, fill=fill, stroke=stroke, width=size * path.width, dashes=dashes))
        return drawn

    def along_line(self, line: NDArray, size: float) -> NDArray:
        """All control points (P, 2) with the rest line laid onto `line` (n, 2), widths times `size`."""
        curve = _curve(line)
        stretch = curve.length / (size * _length(self.line))
        across = self.across * size * stretch**-self.thinning
        at = self.along * curve.length
        return curve.at(at) + _unfolded(across, curve.curvature(at))[:, None] * curve.normal(at)

    def carrying(self, points: NDArray) -> "Bent":
        """The same character with other points (P, 2) of its drawing in place of the control points."""
        curve = _curve(self.line)
        at, across = curve.locate(np.asarray(points, float))
        return replace(self, along=at / curve.length, across=across)


def read_bent(part: str, keyset: KeySet, file: str | Path, line: NDArray | None = None, thinning: float = 0.0) -> Bent:
    """An SVG file as a character that follows the line of action whose ribbons are `keyset`."""
    drawn, notes = read_svg(file)
    return replace(bent(part, keyset, drawn, line, thinning), notes=tuple(f"{file}: {note}" for note in notes))


def bent(part: str, keyset: KeySet, drawn: list[DrawnPath], line: NDArray | None = None, thinning: float = 0.0) -> Bent:
    """Drawn paths as a character that follows the line of action whose ribbons are `keyset`.

    `line` (n, 2) is the drawing's own line, from foot to top, such as `upright` (taken without one) or `spine` of it.
    """
    line = upright(drawn) if line is None else np.asarray(line, float)
    if line.ndim != 2 or line.shape[1] != 2 or len(line) < 2 or not np.isfinite(line).all() or _length(line) < 1e-6:
        raise InputError(
            "a drawing's line of action must be 2 or more different points (x, y) from its foot to its top, "
            f"it came with shape {line.shape}: draw it again"
        )
    if keyset.points.shape[1] % 2 or keyset.points.shape[1] != len(keyset.outline):
        raise InputError(
            f"part {part!r} must be a captured line of action to bend a drawing, its mesh has inner points: "
            "capture its line, or cast a drawing that is not bent"
        )
    step = _length(line) / PIECES
    cut = tuple(_cut(path, step) for path in drawn)
    curve = _curve(line)
    at, across = curve.locate(np.concatenate([path.points for path in cut]))
    outline = keyset.points[0, keyset.outline]
    box = np.stack([outline.min(axis=0), outline.max(axis=0)])
    return Bent(part, keyset, box, line, cut, at / curve.length, across, thinning)


def upright(drawn: list[DrawnPath]) -> NDArray:
    """The vertical line (2, 2) through the middle of all that is painted, from its foot to its top."""
    x0, y0, x1, y1 = silhouette_of(drawn).bounds
    return np.array([[0.5 * (x0 + x1), y1], [0.5 * (x0 + x1), y0]])


def spine(drawn: list[DrawnPath], stiffness: float = 0.1) -> NDArray:
    """The medial line (n, 2) of all that is painted, the lower end first, in units of the drawing.

    It is smoothed over `stiffness` of its length: a character's line is calmer than its outline.
    """
    import shapely

    solid = silhouette_of(drawn)
    solid = max(getattr(solid, "geoms", [solid]), key=lambda piece: piece.area)
    x0, y0, x1, y1 = solid.bounds
    scale = 300 / max(x1 - x0, y1 - y0)
    x, y = np.meshgrid(np.arange(-4, 305) / scale + x0, np.arange(-4, 305) / scale + y0)
    line = medial.medial_line(shapely.contains_xy(solid, x, y))
    return medial.smoothed(line, stiffness) / scale + (x0 - 4 / scale, y0 - 4 / scale)


@dataclass(frozen=True, eq=False)
class _Curve:
    """A smooth curve by arc length, carried straight on beyond its ends."""

    spline: object  # cubic, from arc length to place
    length: float

    def at(self, s: NDArray) -> NDArray:
        """Places (P, 2) at arc lengths (P,)."""
        inside = np.clip(s, 0, self.length)
        return self.spline(inside) + (s - inside)[:, None] * self.tangent(s)

    def tangent(self, s: NDArray) -> NDArray:
        way = self.spline(np.clip(s, 0, self.length), 1)
        return way / np.maximum(np.linalg.norm(way, axis=-1, keepdims=True), 1e-12)

    def normal(self, s: NDArray) -> NDArray:
        """Unit normals (P, 2): the tangents turned by a quarter, x towards y."""
        way = self.tangent(s)
        return np.stack([-way[:, 1], way[:, 0]], axis=-1)

    def curvature(self, s: NDArray) -> NDArray:
        """The signed curvature (P,), positive where the curve turns towards its normal; 0 beyond the ends."""
        knots = np.linspace(0, self.length, 4 * PIECES + 1)
        way, turn = self.spline(knots, 1), self.spline(knots, 2)
        bend = (way[:, 0] * turn[:, 1] - way[:, 1] * turn[:, 0]) / np.maximum(np.linalg.norm(way, axis=1), 1e-12) ** 3
        bend[[0, -1]] = bend[[1, -2]]
        inside = (s >= 0) & (s <= self.length)
        return np.where(inside, np.interp(s, knots, medial.smoothed(bend[:, None], 0.02)[:, 0]), 0.0)

    def locate(self, points: NDArray) -> tuple[NDArray, NDArray]:
        """Arc length (P,) and signed distance across (P,) of the nearest place on the curve, for points (P, 2)."""
        samples = np.linspace(0, self.length, 8 * PIECES + 1)
        drawn = self.spline(samples)
        s = np.array([samples[((drawn - point) ** 2).sum(axis=1).argmin()] for point in points])
        for _ in range(20):  # Newton on the distance, never farther than a sample at once
            away = points - self.at(s)
            way = self.tangent(s)
            off = (away * way).sum(axis=1)
            bend = self.curvature(s) * (away * self.normal(s)).sum(axis=1)
            s = s + np.clip(off / np.maximum(1 - bend, 0.3), -samples[1], samples[1])
        return self._beyond(points, s)

    def _beyond(self, points: NDArray, s: NDArray) -> tuple[NDArray, NDArray]:
        """The distance across (P,); a point past an end lies past it by as much as the straight end says."""
        for end in (0.0, self.length):
            past = (s <= 0) if end == 0 else (s >= self.length)
            ends = np.full(len(s), end)
            straight = end + ((points - self.at(ends)) * self.tangent(ends)).sum(axis=1)
            s = np.where(past, np.minimum(straight, 0) if end == 0 else np.maximum(straight, end), s)
        return s, ((points - self.at(s)) * self.normal(s)).sum(axis=1)


def _curve(line: NDArray) -> _Curve:
    """A line (n, 2) as a smooth curve by arc length."""
    from scipy.interpolate import CubicSpline

    line = medial.even(line, max(len(line), 4))
    for _ in range(2):  # the second time by the spline's own arc length
        spline = CubicSpline(medial.arc_length(line), line, bc_type="natural")
        fine = spline(np.linspace(0, spline.x[-1], 16 * len(line)))
        line = medial.even(fine, len(line))
    along = np.linspace(0, medial.arc_length(fine)[-1], len(line))
    return _Curve(CubicSpline(along, line, bc_type="natural"), float(along[-1]))


def _unfolded(across: NDArray, curvature: NDArray) -> NDArray:
    """Offsets (P,) squeezed on the inner side of a tight bend, so that they never reach its centre."""
    share = across * curvature  # 1 is the centre of the bend
    rest = 1 - TIGHT
    squeezed = TIGHT + rest * np.tanh(np.maximum(share - TIGHT, 0) / rest)
    return np.where(share > TIGHT, across * squeezed / np.where(share > TIGHT, share, 1), across)


def _length(line: NDArray) -> float:
    return float(medial.arc_length(line)[-1])


def _cut(path: DrawnPath, step: float) -> DrawnPath:
    """The path with its curves cut to pieces no longer than about a step."""
    hulls = np.linalg.norm(np.diff(paths.pieces(path), axis=1), axis=-1).sum(axis=-1)
    counts = np.clip(np.ceil(hulls / step), 1, 200).astype(int)
    return paths.split(paths.wound(path, paths.windings(path)), counts)
