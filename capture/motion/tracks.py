"""How parts move over time, and the `*.motion.json` file: the seam between capture, mocap and retarget.

    x(v, t) = sum_d w_d(t) S_d(v)                      shape
    v(t)    = A_parent(t) . about(pivot) A(t) . x      place

Read and written in full precision: a motion that went through its file is the same motion.
"""

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion import affine, keys
from capture.motion.keys import Inbetweener, KeySet

VERSION = 1


@dataclass(frozen=True, eq=False)
class Track:
    """How one part moves: v(t) = A(t) . sum_d w_d(t) S_d, with S_d the in-betweens of its keys."""

    part: str
    parent: str  # the part it hangs on, or ""
    pivot: NDArray  # (d,) in key 0's frame: A acts about it
    keys: tuple[str, ...]  # K key names; a target must have the same ones
    rows: NDArray  # (D, 3) [i, j, s]
    affine: NDArray  # (T, d, d + 1), about the pivot and relative to the parent part
    weights: NDArray  # (T, D), rows sum to 1
    residual: NDArray  # (T,) misfit in pixels; 0 where nothing was measured
    visible: NDArray  # (T,) bool; an invisible frame holds the last pose
    held: NDArray  # (T,) bool, the same drawing as the frame before
    order: NDArray  # (T,) int, higher is drawn later

    def __len__(self) -> int:
        return len(self.affine)

    def key_weights(self) -> NDArray:
        """Weights folded from rows onto keys (T, K)."""
        return keys.fold(self.rows, self.weights, len(self.keys))


@dataclass(frozen=True, eq=False)
class CartoonMotion:
    """A whole captured motion: one track and one key set for every part."""

    tracks: tuple[Track, ...]
    keysets: tuple[KeySet, ...]  # the source's own keys, in the order of the tracks
    times: NDArray  # (T,) seconds
    fps: float
    size: tuple[int, int]  # width and height of the source's canvas
    space: str = "pixels, y down"
    source: dict[str, Any] | None = None  # what it was captured from, in plain values; see `capture.fit.source`

    def track(self, part: str) -> Track:
        """The track of a part; an unknown name is refused with the names there are."""
        return self.tracks[self._index(part)]

    def keyset(self, part: str) -> KeySet:
        """The source's key set of a part."""
        return self.keysets[self._index(part)]

    def points(self, part: str, rule: Inbetweener = keys.rigid) -> NDArray:
        """Where the part's mesh points are in every frame (T, N, d)."""
        track = self.track(part)
        shapes = keys.shapes(keys.with_rows(self.keyset(part), track.rows), rule)
        return affine.apply(total_affine(self, part), np.tensordot(track.weights, shapes, axes=1))

    def outline(self, part: str) -> NDArray:
        """The part's boundary in every frame (T, B, d)."""
        return self.points(part)[:, self.keyset(part).outline]

    def _index(self, part: str) -> int:
        names = [track.part for track in self.tracks]
        if part not in names:
            raise InputError(f"a part must be one of {', '.join(names)}; this motion has no part {part!r}")
        return names.index(part)


def total_affine(
    motion: CartoonMotion, part: str, pivots: dict[str, NDArray] | None = None, scale: float = 1.0
) -> NDArray:
    """Plain maps (T, d, d + 1) of a part: its own map about its pivot, then those of its parents.

    A target gives its own `pivots` by part and the `scale` of its travel; without them the source's.
    """
    total, name, seen = None, part, set()
    while name:
        if name in seen:
            raise InputError(f"a part must not be its own parent: {name!r} is, by way of {', '.join(sorted(seen))}")
        seen.add(name)
        track = motion.track(name)
        pivot = track.pivot if pivots is None else pivots[name]
        local = track.affine.copy()
        local[..., -1] *= scale
        local = affine.about(local, pivot)
        total = local if total is None else affine.compose(local, total)
        name = track.parent
    return total


def track_of(
    part: str,
    keyset: KeySet,
    placed: NDArray,
    weights: NDArray,
    residual: NDArray,
    *,
    pivot: NDArray | None = None,
    parent: str = "",
    order: int = 0,
    visible: NDArray | None = None,
    held: NDArray | None = None,
) -> Track:
    """A track from what a capture finds: plain maps (T, d, d + 1), weights (T, D) and misfits (T,).

    Without a pivot it is the middle of key 0's outline; without more a part is seen in all frames and never held.
    The maps are those of the picture: `relative_to_parents` makes them relative.
    """
    frames = len(placed)
    pivot = keyset.points[0, keyset.outline].mean(axis=0) if pivot is None else np.asarray(pivot, float)
    return Track(
        part=part,
        parent=parent,
        pivot=pivot,
        keys=keyset.names,
        rows=keyset.rows,
        affine=affine.from_about(placed, pivot),
        weights=weights,
        residual=residual,
        visible=np.ones(frames, bool) if visible is None else visible,
        held=np.zeros(frames, bool) if held is None else held,
        order=np.full(frames, order),
    )


def relative_to_parents(motion: CartoonMotion) -> CartoonMotion:
    """Tracks whose maps are those of the picture, made relative to the part they hang on."""
    plain = {track.part: affine.about(track.affine, track.pivot) for track in motion.tracks}
    tracks = []
    for track in motion.tracks:
        local = plain[track.part]
        if track.parent:
            local = affine.compose(affine.invert(plain[track.parent]), local)
        tracks.append(replace(track, affine=affine.from_about(local, track.pivot)))
    return replace(motion, tracks=tuple(tracks))


def check(motion: CartoonMotion) -> CartoonMotion:
    """Refuse a motion whose arrays do not belong together; returns it unchanged."""
    parts = [track.part for track in motion.tracks]
    if not parts or len(set(parts)) < len(parts) or len(motion.keysets) != len(parts):
        raise InputError(
            "a motion must have a track and a key set for each of its parts, this one has tracks for "
            f"{', '.join(parts) or 'no part'} and {len(motion.keysets)} key sets: capture it again"
        )
    times = motion.times
    if not (times.ndim == 1 and len(times) and np.isfinite(times).all() and (np.diff(times) > 0).all()):
        raise InputError("a motion must have frames, and their times must be finite and rise: capture it again")
    if not (0 < motion.fps < np.inf and min(motion.size) > 0):
        raise InputError(f"a motion must have a frame rate and a size above 0, got {motion.fps} and {motion.size}")
    for track, keyset in zip(motion.tracks, motion.keysets, strict=True):
        _check_part(track, keyset, len(times))
    for part in parts:
        total_affine(motion, part)  # refuses parents that are not there, or go round in a circle
    return motion


def _check_part(track: Track, keyset: KeySet, frames: int) -> None:
    points, d = keyset.points.shape[1:]
    count = len(track.keys)
    if track.keys != keyset.names:
        raise InputError(f"part {track.part!r}: track keys {track.keys} are not the key set's {keyset.names}")
    expected: list[tuple[Track | KeySet, str, tuple[int, ...]]] = [
        (track, "pivot", (d,)),
        (track, "rows", (len(track.rows), 3)),
        (track, "affine", (frames, d, d + 1)),
        (track, "weights", (frames, len(track.rows))),
        *((track, name, (frames,)) for name in ("residual", "visible", "held", "order")),
        (keyset, "points", (count, points, d)),
        (keyset, "rows", (len(keyset.rows), 3)),
        (keyset, "removed", (count, d, d + 1)),
        (keyset, "faces", (len(keyset.faces), 3)),
        (keyset, "outline", (len(keyset.outline),)),
    ]
    for owner, name, shape in expected:
        array = getattr(owner, name)
        if array.shape != shape:
            raise InputError(f"part {track.part!r}: {name} must have shape {shape}, it came with {array.shape}")
        if not np.isfinite(array).all():
            raise InputError(f"part {track.part!r}: {name} must be finite numbers, it holds NaN or infinity")
    if not np.allclose(track.weights.sum(axis=1), 1, atol=1e-6):
        raise InputError(f"part {track.part!r}: the weights of a frame must sum to 1, capture it again")
    for name, numbers, stop in (
        ("rows", track.rows[:, :2], count),
        ("rows", keyset.rows[:, :2], count),
        ("faces", keyset.faces, points),
        ("outline", keyset.outline, points),
    ):
        if not np.isin(numbers, np.arange(stop)).all():
            raise InputError(
                f"part {track.part!r}: {name} must number what is there, 0 to {stop - 1}, capture it again"
            )


def save(motion: CartoonMotion, path: str | Path) -> None:
    """Write `*.motion.json`, beside its name first and then moved into place."""
    from capture.files import written_beside

    with written_beside(path) as temporary:
        Path(temporary).write_text(_to_json(check(motion)), encoding="utf-8")


def load(path: str | Path) -> CartoonMotion:
    """Read `*.motion.json`; anything that is not one is refused in one sentence."""
    import msgspec

    path = Path(path)
    try:
        stored = msgspec.json.decode(path.read_bytes())
    except FileNotFoundError:
        raise InputError(f"a motion file must exist: there is no {path}") from None
    except (OSError, UnicodeDecodeError, RecursionError, msgspec.DecodeError) as error:
        raise InputError(f"{path} must be a *.motion.json written by tooncap, it cannot be read: {error}") from None
    if not isinstance(stored, dict) or stored.get("tooncap") != "motion":
        raise InputError(f'{path} must be a *.motion.json written by tooncap: it lacks "tooncap": "motion"')
    if stored.get("version") != VERSION:
        raise InputError(f"{path}: this tooncap reads motion files of version {VERSION}, got {stored.get('version')}")
    try:
        return check(_from_stored(stored))
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    except (LookupError, TypeError, ValueError, OverflowError) as error:
        raise InputError(
            f"{path}: a field of the motion file is missing or of the wrong kind ({error!r}); capture it again"
        ) from None


def worst(track: Track) -> int:
    """The frame number of the largest residual."""
    return int(np.argmax(track.residual))


def summary(motion: CartoonMotion, first: int = 0) -> str:
    """One line a person can use: parts, frames, and where the fit is worst; frame 0 is number `first` of the clip."""
    track = max(motion.tracks, key=lambda track: track.residual.max())
    frame = worst(track)
    parts = f"{len(motion.tracks)} part{'s' if len(motion.tracks) > 1 else ''}"
    lost = sum(int((~track.visible).sum()) for track in motion.tracks)
    text = f"{parts}, {len(motion.times)} frames, worst misfit {track.residual[frame]:.1f} px at frame {frame + first}"
    return f"{text} ({track.part})" + (f", {lost} lost" if lost else "")


def _to_json(motion: CartoonMotion) -> str:
    """Readable JSON: one line for every frame, key point list or row."""
    head = {
        "tooncap": "motion",
        "version": VERSION,
        "fps": motion.fps,
        "size": list(motion.size),
        "space": motion.space,
        "times": motion.times,
        **({} if motion.source is None else {"source": motion.source}),
        "tracks": [_stored(track) for track in motion.tracks],
        "keysets": [_stored(keyset) for keyset in motion.keysets],
    }
    return _lines(head, "") + "\n"


def _stored(thing: Track | KeySet) -> dict[str, Any]:
    return {field.name: getattr(thing, field.name) for field in fields(thing)}


def _lines(value: Any, indent: str) -> str:
    """JSON with an object's fields and a matrix's rows on lines of their own, everything smaller on one line."""
    import msgspec

    deeper = indent + " "
    if isinstance(value, dict):
        items = [
            f"{deeper}{msgspec.json.encode(name).decode()}: {_lines(item, deeper)}" for name, item in value.items()
        ]
        return "{\n" + ",\n".join(items) + "\n" + indent + "}"
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return "[\n" + ",\n".join(deeper + _lines(item, deeper) for item in value) + "\n" + indent + "]"
    if isinstance(value, np.ndarray) and value.ndim > 1 and len(value):
        rows = [deeper + msgspec.json.encode(row.tolist()).decode() for row in value]
        return "[\n" + ",\n".join(rows) + "\n" + indent + "]"
    return msgspec.json.encode(value.tolist() if isinstance(value, np.ndarray) else value).decode()


_INTEGERS = {"order": int, "faces": int, "outline": int, "visible": bool, "held": bool}


def _from_stored(stored: dict[str, Any]) -> CartoonMotion:
    return CartoonMotion(
        tracks=tuple(_read(Track, item) for item in stored["tracks"]),
        keysets=tuple(_read(KeySet, item) for item in stored["keysets"]),
        times=np.array(stored["times"], float),
        fps=float(stored["fps"]),
        size=(int(stored["size"][0]), int(stored["size"][1])),
        space=str(stored["space"]),
        source=source if isinstance(source := stored.get("source"), dict) else None,
    )


def _read(kind: type, item: dict[str, Any]) -> Any:
    """A Track or KeySet from its stored fields: names stay text, everything else becomes an array."""
    values = {}
    for field in fields(kind):
        value = item[field.name]
        if field.name in ("part", "parent"):
            values[field.name] = _text(value)
        elif field.name == "keeps_stretch":
            values[field.name] = bool(value)
        elif field.name in ("keys", "names"):
            values[field.name] = tuple(_text(name) for name in value)
        else:
            wanted, array = _INTEGERS.get(field.name, float), np.array(value)
            if array.size and not np.can_cast(array.dtype, wanted):
                raise TypeError(f"{field.name} must hold {wanted.__name__} values")
            values[field.name] = array.astype(wanted)
    return kind(**values)


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{value!r} must be text")
    return value


def trim(motion: CartoonMotion, start: int, stop: int) -> CartoonMotion:
    """The frames start .. stop - 1 only, with times from 0."""
    per_frame = ("affine", "weights", "residual", "visible", "held", "order")
    tracks = [replace(t, **{name: getattr(t, name)[start:stop] for name in per_frame}) for t in motion.tracks]
    times = motion.times[start:stop]
    return replace(motion, tracks=tuple(tracks), times=times - times[0])
