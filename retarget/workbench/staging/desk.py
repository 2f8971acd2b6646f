"""The stage desk: who plays the captured motion, how they stand, what is behind them; seen live, and exported."""

from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from capture.errors import InputError
from capture.motion.tracks import CartoonMotion
from retarget.characters.casts.backdrop import is_color
from retarget.characters.casts.castcheck import checked
from retarget.characters.casts.castfile import Cast, CastKeep, read_cast
from retarget.characters.casts.castlist import files_of
from retarget.workbench import made
from retarget.workbench.desks import Desk, Done, Seen, Work
from retarget.workbench.fields import At, File, Known, Number, Offset, Piece
from retarget.workbench.folder import filenames, upload
from retarget.workbench.staging import casts, keys, offers, playing, redraw, solids, space
from retarget.workbench.staging.staged import cast_of, check_frame, motion_of, number_of, played_of, png, with_cast
from retarget.workbench.state import CAST, MOTION, State, file_of

Files = Annotated[list[File], Meta(min_length=1, max_length=200)]
Height = Annotated[float, Meta(gt=0, le=50)]
FORMATS = {
    ".gif": "GIF",
    ".mp4": "MP4 video",
    ".webm": "WebM video, transparent",
    ".mov": "ProRes video, transparent",
    "/": "PNG pictures, one a frame",
    ".json": "Lottie",
    ".svg": "animated SVG",
    "/0000.svg": "SVG drawings, one a frame",
    ".glb": "GLB, for 3-D programs",
    ".gltf": "glTF",
    ".usda": "USD, as text",
    ".usdz": "USDZ",
    ".jsx": "After Effects script",
    ".csv": "curves as CSV",
    ".curves.json": "curves as JSON",
}


def shown(state: State) -> dict[str, Any]:
    """What is played, by whom, and what could be: drawings of the folder."""
    motion, cast = state.motion, state.cast
    source = "" if state.shot is None else state.shot.clip
    return {
        "motion": None if motion is None else _motion_shown(motion),
        "cast": None if cast is None else _cast_shown(cast),
        "number": number_of(state),
        "offers": [] if motion is None else offers.offers(state.folder, motion, source),
        "plays": [] if cast is None else _plays(state, cast),
        "made": made.shown(state, "stage"),
        "formats": FORMATS,
    }


# --- actions: (state, fields) -> state ----------------------------------------------------------------------------


def play(state: State, files: Files) -> State:
    """Let drawings play."""
    files = offers.borrowed(state.folder, files)
    found = [filenames.inside(state.folder, file) for file in files]
    cast = casts.played_by(found, motion_of(state), state.cast)
    playing.learnt(motion_of(state), cast)  # what cannot play is refused here, and not in every frame
    return replace(state, cast=replace(checked(cast), folder=state.folder))


def stand(state: State, who: Known, height: Height) -> State:
    """Say how tall somebody is."""
    return with_cast(state, casts.standing(cast_of(state), who, height=round(height, 3)))


def between(state: State, who: Known, how: Literal["rigid", "straight"]) -> State:
    """Say how shapes go from key to key."""
    return with_cast(state, casts.standing(cast_of(state), who, between=how))


def background(state: State, what: Annotated[str, Meta(max_length=200)] = "") -> State:
    """Choose what is behind."""
    if what and not is_color(what):
        what = str(filenames.inside(state.folder, what).relative_to(state.folder.resolve()))
        what = str(Path(what) if cast_of(state).folder == state.folder else state.folder / what)
    return with_cast(state, replace(cast_of(state), background=what))


def ground(state: State, on: bool) -> State:
    """Say whether feet stand on the source's ground."""
    return with_cast(state, replace(cast_of(state), ground=on))


def follow(state: State, path: Annotated[list[At], Meta(max_length=5000)]) -> State:
    """Draw the path that the whole goes."""
    import shapely

    if len(path) > 1:
        path = shapely.LineString(path).simplify(1.0).coords
    drawn = tuple((round(x, 1), round(y, 1)) for x, y in path)
    return with_cast(state, replace(cast_of(state), follow=drawn if len(drawn) > 1 else ()))


def pin(state: State, frame: Number, at: At, last: Number) -> State:
    """Pin what is seen there to its place."""
    played = played_of(state)
    check_frame(state, max(frame, last))
    return with_cast(state, casts.pinned(cast_of(state), played.performance, frame, at, last))


def pin_feet(state: State, part: Known) -> State:
    """Keep a part where it is whenever the source's stands on the ground."""
    return with_cast(state, replace(cast_of(state), keep=(*cast_of(state).keep, CastKeep(part))))


def move_pin(
    state: State, number: Number, to: At | None = None, first: Number | None = None, last: Number | None = None
) -> State:
    """Change where, or how long, a pin holds."""
    keep = _keep(state, number)
    if to is not None:
        keep = replace(keep, at=(round(to[0], 2), round(to[1], 2)))
    if first is not None or last is not None:
        old = keep.frames or (0, 0)
        a, b = (old[0] if first is None else first), (old[1] if last is None else last)
        check_frame(state, max(a, b))
        keep = replace(keep, frames=(min(a, b), max(a, b)))
    keeps = list(cast_of(state).keep)
    keeps[number] = keep
    return with_cast(state, replace(cast_of(state), keep=tuple(keeps)))


def unpin(state: State, number: Number) -> State:
    """Take a pin out."""
    gone = _keep(state, number)
    return with_cast(state, replace(cast_of(state), keep=tuple(one for one in cast_of(state).keep if one is not gone)))


def load(state: State, name: File, at: Offset, data: Piece, last: bool = True) -> State:
    """Load a drawing into the folder."""
    upload.put(state.folder, name, at, data, last)
    return state


# --- looks: (state, fields) -> bytes; nothing changes ---------------------------------------------------------------


def frame(state: State, frame: Number) -> Seen:
    """A frame of the performance, as it is exported."""
    check_frame(state, frame)
    return png(playing.picture(played_of(state), frame))


def told(state: State) -> Seen:
    """What there is to know of the performance, as JSON: pins' places, notes, whether something is a model."""
    cast, motion = cast_of(state), motion_of(state)
    played = playing.play(motion, cast)
    said = {
        "pins": casts.pin_places(played.performance, cast, motion),
        "said": played.said,
        "notes": list(played.notes),
        "solid": any(map(solids.is_solid, played.performance.roles)),
    }
    return Seen("application/json", msgspec.json.encode(said))


def small(state: State, file: File) -> Seen:
    """A drawing as small as a list shows it."""
    path = offers.drawing(file) or filenames.inside(state.folder, file)
    return png(redraw.small(path, path.stat().st_mtime_ns))


# --- work: long, in a process of its own ----------------------------------------------------------------------------


def propose(motion: str, drawings: list[str], out: str, mirror: bool) -> Done:
    """Propose all keys of a drawing."""
    from capture.motion import tracks
    from capture.progress import working
    from retarget.characters.proposed import proposals

    captured = tracks.load(motion)
    castings = proposals.castings([Path(drawing) for drawing in drawings], captured, mirror)
    with working("carrying the keys over"):
        keyed = [proposals.proposal(one, captured) for one in castings]
    Path(out).mkdir(exist_ok=True)
    written, kept = proposals.write(Path(out), castings, keyed, captured)
    return Done({"cast": str(next(file for file in (*written, *kept) if file.name.endswith(CAST)))})


def proposed(state: State, cast: str) -> State:
    """Take the proposed keys."""
    found, before = read_cast(cast), state.cast
    if before is not None:
        behind = before.background if is_color(before.background) else ""
        found = replace(found, ground=before.ground, background=behind)
    return replace(state, cast=found)


def export(motion: str, cast: str, out: str, size: int | None, number: int) -> Done:
    """Write the performance into a file."""
    from capture.motion import tracks
    from retarget.commands.lending import retarget

    said = retarget(Path(motion), Path(out), cast=Path(cast), size=size)
    misfit = max(track.residual.max() for track in tracks.load(Path(motion)).tracks)
    said = said.replace(str(Path(motion).parent), Path(motion).parent.name)
    said = f"{said}; captured to within {misfit:.1f} px; {made.size_of(Path(out))}"
    return Done({"out": out, "sentence": said, "desk": "stage", "number": number}, said)


def _prepare_propose(state: State, files: Files, mirror: bool = False) -> dict[str, Any]:
    motion_of(state)
    found = [filenames.inside(state.folder, file) for file in offers.borrowed(state.folder, files)]
    out = state.folder / f"{found[0].stem}_keys"
    drawings = [str(file) for file in found]
    return {"motion": str(file_of(state, MOTION)), "drawings": drawings, "out": str(out), "mirror": mirror}


def _prepare_export(
    state: State, kind: str = ".mp4", size: Annotated[int, Meta(ge=1, le=8192)] | None = None
) -> dict[str, Any]:
    motion_of(state), cast_of(state)
    if kind not in FORMATS:
        raise InputError(f"an export must end in one of {', '.join(FORMATS)}, got {kind[:40]!r}")
    return {
        "motion": str(file_of(state, MOTION)),
        "cast": str(file_of(state, CAST)),
        "out": str(out_of(state, kind)),
        "size": size,
        "number": number_of(state),
    }


def out_of(state: State, kind: str) -> Path:
    """The file or folder that an export of this kind goes to."""
    if kind == "/":
        return file_of(state, "-frames")
    return file_of(state, f"-drawings{kind}" if kind.startswith("/") else f".retarget{kind}")


DESK = Desk(
    "stage",
    shown,
    actions={
        one.__name__: one
        for one in (
            *(play, stand, between, background, ground, follow),
            *(pin, pin_feet, move_pin, unpin),
        )
    }
    | keys.ACTIONS,
    writes={"load": load},
    looks={"frame": frame, "told": told, "small": small, "made": made.piece, **space.LOOKS, **keys.LOOKS},
    work={
        "propose": Work(_prepare_propose, propose, proposed),
        "export": Work(_prepare_export, export, made.exported),
    },
)


def _keep(state: State, number: int) -> CastKeep:
    keeps = cast_of(state).keep
    if number >= len(keeps):
        raise InputError(f"there are {len(keeps)} pins, counted from 0; there is no pin {number}")
    return keeps[number]


def _motion_shown(motion: CartoonMotion) -> dict[str, Any]:
    tracks = [{"name": track.part, "keys": list(track.keys)} for track in motion.tracks]
    size = {"width": motion.size[0], "height": motion.size[1]}
    return {"frames": len(motion.times), "fps": motion.fps, **size, "parts": tracks}


def _cast_shown(cast: Cast) -> dict[str, Any]:
    plain = asdict(cast)  # msgspec leaves out what came by default from a file
    del plain["folder"]
    for part in plain["parts"]:
        for key in part["keys"]:
            key["file"] = Path(key["drawing"] or part["drawing"]).name
    return plain


def _plays(state: State, cast: Cast) -> list[str]:
    """The files of the folder that the cast names."""
    root = state.folder.resolve()
    files = [file.resolve() for file in files_of(replace(cast, background=""))]
    return sorted({file.relative_to(root).as_posix() for file in files if file.is_relative_to(root)})
