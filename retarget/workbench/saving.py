"""Documents saved by themselves: what changed is written, and what somebody else wrote meanwhile is not overwritten."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from capture.errors import InputError
from retarget.workbench.state import DOCUMENTS, State, documents, file_of


@dataclass(eq=False)
class Saved:
    """What is on disk, as far as this session knows."""

    documents: dict[Path, Any] = field(default_factory=dict)  # by file: the document that is in it
    digests: dict[Path, str] = field(default_factory=dict)  # by file: what its content was when we last had it


def note(saved: Saved, state: State, kinds: Sequence[str] = DOCUMENTS) -> None:
    """Take it that the state's documents of these kinds are what their files hold, as after opening them."""
    for kind, (document, _) in documents(state).items():
        path = file_of(state, kind)
        if kind in kinds and path.exists():
            saved.documents[path], saved.digests[path] = document, _digest(path)


def save(saved: Saved, state: State) -> list[Path]:
    """Write the documents that changed since they were last written; returns their files.

    A document that was taken back altogether takes its file with it, if this session made that.
    """
    written = []
    for kind, (document, write) in documents(state).items():
        path = file_of(state, kind)
        if not state.name or document is saved.documents.get(path):
            continue
        _refuse_others(saved, path)
        if document is None:
            path.unlink(missing_ok=True)
        else:
            write(document, path)
        saved.documents[path], saved.digests[path] = document, _digest(path)
        written.append(path)
    return written


def unsaved(saved: Saved, state: State) -> bool:
    """Whether anything is not on disk yet."""
    kept = saved.documents
    return bool(state.name) and any(
        d is not kept.get(file_of(state, kind)) for kind, (d, _) in documents(state).items()
    )


def _refuse_others(saved: Saved, path: Path) -> None:
    """Refuse to write over what another program, or another workbench, has put there."""
    if _digest(path) != saved.digests.get(path, ""):
        raise InputError(
            f"{path.name} was changed by another program since it was opened here, and is left as it is: open it again "
            "to go on from there, or rename it to keep both"
        )


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.exists() else ""
