"""The folder that the workbench was opened in: what lies there, and nothing outside it."""

from pathlib import Path
from typing import Any

from capture.errors import InputError
from retarget.workbench import reach
from retarget.workbench.desks import Desk, Work
from retarget.workbench.filenames import inside as inside
from retarget.workbench.state import CAST, CLIPS, MOTION, SHOT, State, open_file

LISTED = 500


def open_(state: State, file: str) -> State:
    """Open a file of the folder."""
    opened = named(state, file)
    reach.refuse_outside(opened)
    return opened


def named(state: State, file: str) -> State:
    """Open a file of the folder, wherever the files that it names in turn may lie."""
    opened = open_file(state, inside(state.folder, file))
    if opened.folder != state.folder.resolve():
        raise InputError(f"{file} lies in a folder of its own: start the workbench there, to work on it")
    return opened


def close(state: State) -> State:
    """Close what is open."""
    return State(state.folder)


def listed(folder: Path) -> list[dict[str, str]]:
    """What can be opened, the shots first: {"file", "kind"} of each."""
    files = sorted(path for path in folder.iterdir() if not path.name.startswith("."))
    kinds = [(path.name, _kind(path)) for path in files]
    found = [{"file": name, "kind": kind} for name, kind in kinds if kind]
    return sorted(found, key=lambda one: ("shot", "clip", "motion", "cast", "bvh", "drawing").index(one["kind"]))[
        :LISTED
    ]


def shown(state: State) -> dict[str, Any]:
    """Where we are and what is open; what can be opened while nothing is."""
    files = [] if state.name else listed(state.folder)
    return {"at": {"folder": state.folder.name, "open": state.name}, "files": files}


def example(folder: str) -> dict[str, Any]:
    """Draw the built-in frog into the folder."""
    from capture.pictures.encode import write_clip
    from capture.progress import progress
    from fixtures.frog import frog

    toon = frog()
    write_clip(Path(folder) / "frog.mp4", progress(toon.frames(), "drawing the frog", len(toon)), toon.fps)
    return {"file": "frog.mp4"}


def _prepare(state: State) -> dict[str, Any]:
    if (state.folder / "frog.mp4").exists():
        raise InputError("there is a frog.mp4 in this folder already: open that")
    return {"folder": str(state.folder)}


def _kind(path: Path) -> str:
    """shot, motion, cast, clip, bvh, drawing, or nothing that we open."""
    for ending, kind in ((SHOT, "shot"), (MOTION, "motion"), (CAST, "cast")):
        if path.name.endswith(ending):
            return kind
    suffix = path.suffix.lower()
    if suffix in (".png", ".webp", ".svg", ".jpg", ".jpeg", ".glb", ".gltf", ".obj", ".ply"):
        return "drawing"
    if suffix == ".bvh":
        return "bvh"
    if path.is_dir():  # of pictures, one for each frame
        pictures = (file.suffix.lower() in (".png", ".jpg", ".jpeg") for file in path.iterdir())
        return "clip" if sum(pictures) > 1 else ""
    return "clip" if suffix in CLIPS else ""


DESK = Desk(
    "folder",
    shown,
    actions={"open": open_, "close": close},
    work={"example": Work(_prepare, example, open_)},
)
