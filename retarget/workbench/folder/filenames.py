"""Names of files as a page gives them: plain ones, which mean the same on every system and lie in no other folder."""

import re
from pathlib import Path

from capture.errors import InputError

LONGEST = 200  # bytes: with what is put before and after it a name still fits any file system
DEVICE = re.compile(
    r"(con|prn|aux|nul|com\d|lpt\d|conin\$|conout\$)", re.IGNORECASE
)  # files of Windows in every folder
NOT_IN_NAMES = re.compile(r'[\x00-\x1f\x7f<>:"/\\|?*\u202a-\u202e\u2066-\u2069]')  # the last turn the reading round


def plain(name: str) -> str:
    """The name if it is that of a file and nothing more; another is refused."""
    bare = name.split(".")[0].strip()
    bad = NOT_IN_NAMES.search(name) or name != name.strip(" .") or not bare or DEVICE.fullmatch(bare)
    if bad or len(name.encode(errors="replace")) > LONGEST:
        raise InputError(
            f'a file to load must be plainly named, in at most {LONGEST} letters and none of /\\:*?"<>|, '
            f"got {name[:80]!r}: rename it"
        )
    return name


def inside(folder: Path, name: str) -> Path:
    """The path of a name in the folder; one that leads out of it, by dots, links or from the root, is refused.

    So is one that is neither file nor folder: a pipe would never end.
    """
    strange = "\0" in name or name.startswith("\\\\")  # Windows asks another machine for such a name, and greets it
    path = Path("/") if strange else (folder / name).resolve()
    if not path.is_relative_to(folder.resolve()):
        raise InputError(f"only files in {folder} can be opened here, {name[:100]!r} lies outside: move it there")
    if not (path.is_file() or path.is_dir()):
        raise InputError(f"there is no {name[:100]!r} in {folder}: choose a file that is listed")
    return path
