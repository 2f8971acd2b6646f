"""The curves of a motion as a table that any spreadsheet opens, or as JSON for scripts."""

import csv
import json
from pathlib import Path
from typing import Any

from capture.files import written_beside
from capture.motion.tracks import CartoonMotion, Track


def write_csv(motion: CartoonMotion, path: str | Path) -> None:
    """One row for every frame and part: its affine map, its weights folded onto keys, and how well they fit.

    The columns a1 a2 a3 a4 dx dy are v = A x + D (Bregler 2002, eq. 1) with A = [[a1, a2], [a3, a4]], both x
    and v measured from the part's pivot (pivot_x, pivot_y) in key 0: a point p of the shape goes to
    pivot + A (p - pivot) + D, and then on through the parent part's map.  Parts have their own keys, so a
    column w_<key> is empty for a part without that key.
    """
    names = list(dict.fromkeys(name for track in motion.tracks for name in track.keys))
    columns = ["frame", "time", "part", "parent", "a1", "a2", "a3", "a4", "dx", "dy", "pivot_x", "pivot_y"]
    columns += [f"w_{name}" for name in names] + ["held", "visible", "residual", "order"]
    folded = [track.key_weights() for track in motion.tracks]
    with written_beside(path) as temporary, open(temporary, "w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(columns)
        for t, time in enumerate(motion.times):
            for track, weights in zip(motion.tracks, folded, strict=True):
                of_key = dict(zip(track.keys, weights[t].tolist(), strict=True))
                shares = [of_key.get(name, "") for name in names]
                table.writerow(
                    [t, float(time), track.part, track.parent, *_place(track, t), *shares, *_notes(track, t)]
                )


def write_curves(motion: CartoonMotion, path: str | Path) -> None:
    """The same numbers as JSON, a list of T for each curve of each part, on lines that compare well.

    {"fps", "size", "times", "parts": {part: {"parent", "pivot", "keys", "affine": T of [a1, a2, dx, a3, a4, dy],
    "weights": T of K, "held", "visible", "residual", "order"}}}
    """
    parts = {
        track.part: {
            "parent": track.parent,
            "pivot": track.pivot.tolist(),
            "keys": list(track.keys),
            "affine": track.affine.reshape(len(track), -1).tolist(),
            "weights": track.key_weights().tolist(),
            "held": track.held.tolist(),
            "visible": track.visible.tolist(),
            "residual": track.residual.tolist(),
            "order": track.order.tolist(),
        }
        for track in motion.tracks
    }
    told = {"fps": motion.fps, "size": list(motion.size), "times": motion.times.tolist(), "parts": parts}
    with written_beside(path) as temporary:
        temporary.write_text(_lines(told) + "\n", encoding="utf-8")


def _lines(thing: Any, indent: str = "") -> str:
    """JSON with each curve on a line of its own."""
    if not isinstance(thing, dict):
        return json.dumps(thing, allow_nan=False, ensure_ascii=False)
    inner = indent + "  "
    rows = [f"{inner}{json.dumps(name, ensure_ascii=False)}: {_lines(value, inner)}" for name, value in thing.items()]
    return "{\n" + ",\n".join(rows) + f"\n{indent}}}"


def _place(track: Track, t: int) -> list[float]:
    (a1, a2, dx), (a3, a4, dy) = track.affine[t].tolist()
    return [a1, a2, a3, a4, dx, dy, *track.pivot.tolist()]


def _notes(track: Track, t: int) -> list[float]:
    return [int(track.held[t]), int(track.visible[t]), float(track.residual[t]), int(track.order[t])]
