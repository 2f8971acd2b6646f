"""Files are written beside their name and moved into place: a reader never meets a half-written one.

A missing folder directly under an existing one is made (`-o out/ball.mp4` works at once) and taken away again
if nothing came of it; a path with several missing folders is more likely a slip and is refused.
"""

import errno
import os
import re
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from capture.errors import InputError

FRAME_NAME = re.compile(r"\d{4,}\.(png|svg)")
FULL_DISK = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


@contextmanager
def written_beside(path: str | os.PathLike) -> Iterator[Path]:
    """Yield a path beside `path` with the same suffix; what is written there replaces `path` on success only.

    On any failure, an interrupt included, the file is removed and an earlier `path` stays as it was.
    """
    target = Path(os.path.realpath(path))  # through a link, so that the link stays one
    if target.is_dir():
        raise InputError(f"{path}: the output must be a file, this is a folder; give a file name")
    if target.exists() and not (target.is_file() and os.access(target, os.W_OK)):
        raise InputError(f"{path}: the output must be a file that may be written; choose another name")
    with _parent(target):
        beside = target.with_name(_unused_name() + target.suffix)
        with _unwritable(target):
            beside.touch(exist_ok=False)
        try:
            with _full_disk(target):
                yield beside
            with _unwritable(target):
                os.replace(beside, target)
        finally:
            beside.unlink(missing_ok=True)


@contextmanager
def folder_written_beside(path: str | os.PathLike) -> Iterator[Path]:
    """Yield an empty folder beside `path` that takes its place on success only.

    An existing folder is replaced if it holds nothing but frames as we write them (0000.png or .svg, ...):
    so a shorter second run leaves no frames of the first, and no other file is ever lost.
    """
    target = Path(os.path.realpath(path))
    _check_replaceable(target)
    with _parent(target):
        beside, old = target.with_name(_unused_name()), target.with_name(_unused_name())
        with _unwritable(target):
            beside.mkdir()
        try:
            with _full_disk(target):
                yield beside
            _check_replaceable(target)  # someone may have put a file there meanwhile
            with _unwritable(target):
                _swap(beside, target, old)
        finally:
            shutil.rmtree(beside, ignore_errors=True)


def _swap(beside: Path, target: Path, old: Path) -> None:
    """Move `beside` to `target`, by way of `old` for what is there now."""
    if not target.exists():
        os.replace(beside, target)
        return
    os.replace(target, old)
    try:
        os.replace(beside, target)
    except BaseException:
        os.replace(old, target)
        raise
    shutil.rmtree(old)


def _check_replaceable(target: Path) -> None:
    if target.is_dir():
        others = [p.name for p in target.iterdir() if not (FRAME_NAME.fullmatch(p.name) and p.is_file())]
        if others:
            raise InputError(
                f"{target}: the output folder must be new or hold only frames like 0000.png, "
                f"it also holds {min(others)!r}; give another folder"
            )
    elif target.exists():
        raise InputError(f"{target}: the output must be a folder, this is a file; give another name")


@contextmanager
def _parent(target: Path) -> Iterator[None]:
    """See that the folder around `target` is there; one made for the purpose goes again on failure."""
    parent = target.parent
    made = not parent.exists()
    if made and not parent.parent.is_dir():
        raise InputError(f"{target}: the folder {parent.parent} must exist, it does not; make it first")
    if made:
        with _unwritable(target):
            parent.mkdir()
    try:
        yield
    except BaseException:
        if made and not any(parent.iterdir()):
            parent.rmdir()
        raise


@contextmanager
def _unwritable(target: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        reason = error.strerror or error
        raise InputError(
            f"{target}: the output must be in a place that can be written ({reason}); choose another"
        ) from error


@contextmanager
def _full_disk(target: Path) -> Iterator[None]:
    """Of all that can go wrong while writing only a full disk is surely the user's to mend."""
    try:
        yield
    except OSError as error:
        if error.errno not in FULL_DISK:
            raise
        raise InputError(f"{target}: the disk must have room for the output, it is full; delete something") from error


def _unused_name() -> str:
    return f".unfinished-{secrets.token_hex(6)}"  # not tempfile: its files are closed to other users
