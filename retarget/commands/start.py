"""Commands to begin with: the whole road once, and cartoons to try things on."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from retarget.console import folder_at


def demo(out: Annotated[Path, Parameter(name=["--out", "-o"])] = Path("demo")) -> str:
    """Capture the built-in frog and let a bunny jump like it.

    Parameters
    ----------
    out
        The folder that takes the videos, the contact sheet and the data.
    """
    from retarget.demo import demo as run

    return run(folder_at(out))


def fixtures(folder: Path) -> str:
    """Write the synthetic cartoons, their truth, and the characters to retarget to.

    Parameters
    ----------
    folder
        Where they go; it is made if it is not there.
    """
    from capture.progress import progress
    from fixtures import cartoons, write

    folder = folder_at(folder)
    toons = cartoons.all_toons()
    for name, draw in progress(toons.items(), "drawing", len(toons)):
        write.write_toon(draw(), folder)
        del name
    drawings = write.write_characters(folder / "characters")
    return f"{folder}: {len(toons)} cartoons with their shots and truth, {len(drawings)} drawings of characters"
