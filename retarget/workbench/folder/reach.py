"""What the documents of a piece of work name in turn: a folder that came from elsewhere must not reach out of itself.

A shot names its clip, a cast its drawings.  Where those lie outside the folder, the page does not open them: it may be
somebody else's shot that names a file of yours.  Whoever starts the workbench on that file by name has chosen it.
"""

from collections.abc import Set
from pathlib import Path

from capture.errors import InputError
from retarget.characters.casts.castlist import files_of
from retarget.workbench.state import State


def outside(state: State) -> set[Path]:
    """The files that the state's documents name and that lie outside its folder, or are no files at all."""
    named = [] if state.shot is None else [Path(state.shot.clip)]
    if state.cast is not None:
        named += files_of(state.cast)
    home = state.folder.resolve()
    return {path for path in named if not path.resolve().is_relative_to(home) or _endless(path)}


def refuse_outside(state: State, known: Set[Path] = frozenset()) -> None:
    """Refuse a state whose documents name files outside its folder that are not known already."""
    for path in sorted(outside(state) - known):
        raise InputError(
            f"{state.name} names {str(path)[:200]}, which must lie in {state.folder.name}: move it there, or start the "
            "workbench with this file's name"
        )


def _endless(path: Path) -> bool:
    return path.exists() and not (path.is_file() or path.is_dir())
