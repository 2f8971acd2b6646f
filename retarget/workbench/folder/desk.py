"""The folder that the workbench was opened in: what lies there, and nothing outside it."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

from msgspec import Meta

from capture.errors import InputError
from retarget.characters.models.meshfiles import MODELS
from retarget.workbench import pictures
from retarget.workbench.desks import Desk, Done, Seen, Work
from retarget.workbench.fields import File, Offset, Piece
from retarget.workbench.folder import listing, reach, sheets, upload
from retarget.workbench.folder.filenames import inside
from retarget.workbench.state import State, open_file

Side = Annotated[int, Meta(ge=1, le=16384)]
Tile = tuple[Side, Side]


def open_(state: State, file: File, tile: Tile | None = None) -> State:
    """Open a file of the folder."""
    return _opened(state, inside(state.folder, file), tile)


def named(state: State, file: File) -> State:
    """Open a file of the folder, wherever the files that it names in turn may lie."""
    return _opened(state, inside(state.folder, file), chosen=True)


def close(state: State) -> State:
    """Close what is open."""
    return State(state.folder)


def load(state: State, name: File, at: Offset, data: Piece, last: bool = True) -> State:
    """Load a file into the folder, and open it once it is whole."""
    came = upload.put(state.folder, name, at, data, last, check=_readable)
    if came is None or _is_still(came):
        return state  # the page asks how large a drawing of the sheet is
    return _opened(state, came)


def drop(state: State, name: File) -> State:
    """Forget the pieces of a file that does not come after all."""
    upload.drop(state.folder, name)
    return state


def listed(folder: Path) -> list[dict[str, str]]:
    """What can be opened, here and in the folders below, the shots first: {"file", "kind"} of each."""
    return list(listing.listing(folder).files)


def shown(state: State) -> dict[str, Any]:
    """Where we are and what is open; what can be opened while nothing is."""
    at = {"folder": state.folder.name, "path": str(state.folder), "open": state.name, "largest": upload.LARGEST}
    if state.name:
        return {"at": at, "files": [], "more": False}
    files, more = listing.listing(state.folder)
    return {"at": at, "files": [one for one in files if one["kind"] not in ("drawing", "music", "made")], "more": more}


def arrived(state: State, name: File) -> Seen:
    """Under which name a file was loaded; and of a single picture, no clip yet, how large its drawings seem."""
    file = upload.arrived(state.folder, name)
    path = inside(state.folder, file)
    found: dict[str, Any] = {"file": file, "still": _is_still(path)}
    if found["still"]:
        from retarget.characters.photos.photo import read_image

        picture = read_image(path)
        found |= {"width": picture.shape[1], "height": picture.shape[0], "tile": sheets.tile_of(picture)}
    return Seen("application/json", json.dumps(found).encode())


def example(folder: str) -> Done:
    """Draw the built-in frog into the folder."""
    from capture.pictures.encode import write_clip
    from capture.progress import progress
    from fixtures.frog import frog

    toon = frog()
    write_clip(Path(folder) / "frog.mp4", progress(toon.frames(), "drawing the frog", len(toon)), toon.fps)
    return Done({"file": "frog.mp4"})


def _prepare(state: State) -> dict[str, Any]:
    if (state.folder / "frog.mp4").exists():
        raise InputError("there is a frog.mp4 in this folder already: open that")
    return {"folder": str(state.folder)}


def _opened(state: State, path: Path, tile: tuple[int, int] | None = None, chosen: bool = False) -> State:
    """The state with a file open that lies in the folder or below it; its name has the way there before it.

    What it names in turn must lie there too, if it was not chosen by who started the workbench.
    """
    root = state.folder.resolve()
    if path == root:  # a folder of frames is its own clip, and keeps what is made of it
        path, way = root, Path()
    else:
        way = path.parent.relative_to(root)
    opened = open_file(path)
    if not chosen:
        reach.refuse_outside(replace(opened, folder=root))
    figure = opened.figure
    if figure is not None and (opened.folder / figure.file).exists():
        figure = replace(figure, file=(way / figure.file).as_posix())
    shot = opened.shot
    if shot is not None:
        shot = shot if tile is None else replace(shot, tile=tile)
        pictures.frame(shot, shot.start)  # what cannot be read is refused here, and nothing has changed
    return replace(opened, folder=root, name=(way / opened.name).as_posix(), figure=figure, shot=shot)


def _readable(path: Path) -> None:
    """Refuse a clip or motion capture that is none, whatever its name says."""
    if path.suffix.lower() == ".bvh":
        from mocap.skeletons.bvh import read_bvh

        read_bvh(path)
    elif path.suffix.lower() in (".svg", *MODELS):
        raise InputError(
            f"{path} is a drawing or model, and nothing moves in it: open a clip first, it plays at the stage"
        )
    else:
        from capture.pictures.decode import read_clip

        read_clip(path)[0]


def _is_still(path: Path) -> bool:
    """Whether this is a single picture; as a clip it can only be a sprite sheet."""
    from capture.pictures.decode import read_clip

    return path.suffix.lower() in (".png", ".webp", ".jpg", ".jpeg") and len(read_clip(path)) == 1


DESK = Desk(
    "folder",
    shown,
    actions={"open": open_, "close": close},
    writes={"load": load, "drop": drop},
    looks={"arrived": arrived},
    work={"example": Work(_prepare, example, open_)},
)
