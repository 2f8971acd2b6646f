"""Documents saved by themselves: what changed is written, and what somebody else wrote meanwhile is not overwritten."""

import hashlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from capture.errors import InputError
from retarget.workbench.figure import DANCE, POOL, STANCE
from retarget.workbench.state import DOCUMENTS, SHOT, State, documents, file_of


class Unwritable(InputError):
    """The system does not let a document be written now, for a full disk or the like; later it may."""


@dataclass(eq=False)
class Saved:
    """What is on disk, as far as this session knows."""

    documents: dict[Path, Any] = field(default_factory=dict)  # by file: the document that is in it
    digests: dict[Path, str] = field(default_factory=dict)  # by file: what its content was when we last had it
    blank: dict[Path, Any] = field(default_factory=dict)  # by file: the document of a work that has no such file yet


def note(saved: Saved, state: State, kinds: Sequence[str] = DOCUMENTS) -> None:
    """Take it that the state's documents of these kinds are what their files hold, as after opening them."""
    for kind, (document, _) in documents(state).items():
        path = file_of(state, kind)
        if kind not in kinds:
            continue
        if path.exists():
            saved.documents[path], saved.digests[path] = document, _digest(path)
            saved.blank.pop(path, None)
        elif kind in (SHOT, POOL):
            saved.blank[path] = document
            saved.documents.pop(path, None)
            saved.digests.pop(path, None)


def save(saved: Saved, state: State) -> list[Path]:
    """Write the documents that changed since they were last written; returns their files.

    One that cannot be written keeps none of the others from it, and is told of when they are.  A document that was
    taken back altogether, or to what it was before there was a file, takes its file with it, if this session made that.
    """
    written, failed = [], []
    for path, document, write in _asked(saved, state):
        if document is saved.documents.get(path):
            continue
        try:
            _refuse_others(saved, path)
            with _told(path):
                if document is None:
                    path.unlink(missing_ok=True)
                else:
                    write(document, path)
        except InputError as error:
            failed.append(error)
            continue
        saved.documents[path], saved.digests[path] = document, _digest(path)
        written.append(path)
    for error in sorted(failed, key=lambda one: not isinstance(one, Unwritable)):  # that is tried again, then the other
        raise error
    return written


def _asked(saved: Saved, state: State) -> Iterator[tuple[Path, Any, Callable[[Any, Path], None]]]:
    """File, document or None for no file, and what writes it, of all documents of a named work."""
    found = documents(state) if state.name else {}
    danced = any(found[kind][0] is not None for kind in (DANCE, STANCE) if kind in found)  # by postures of a file
    for kind, (document, write) in found.items():
        path = file_of(state, kind)
        blank = document is saved.blank.get(path) and not (kind == POOL and danced)
        yield path, None if blank else document, write


@contextmanager
def _told(path: Path) -> Iterator[None]:
    """What the system does not let be written is said as such, and that nothing is lost by it."""
    try:
        yield
    except (InputError, OSError) as error:
        why = str(error) if isinstance(error, InputError) else f"{path}: {error.strerror or error}"
        raise Unwritable(
            f"not saved yet, but kept here and tried again: {why.removeprefix(f'{path}: ')} ({path.name})"
        ) from None


def _refuse_others(saved: Saved, path: Path) -> None:
    """Refuse to write over what another program, or another workbench, has put there."""
    if _digest(path) != saved.digests.get(path, ""):
        raise InputError(
            f"{path.name} was changed by another program since it was opened here, and is left as it is: open it again "
            "to go on from there, or rename it to keep both"
        )


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.exists() else ""
