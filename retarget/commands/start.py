"""Commands to begin with: the whole road once, and cartoons to try things on."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from retarget.console import folder_at


def demo(
    name: str | None = None,
    *,
    all_of_them: Annotated[bool, Parameter(name="--all")] = False,
    out: Annotated[Path, Parameter(name=["--out", "-o"])] = Path("demo"),
) -> str:
    """Capture the built-in frog and let a bunny jump like it, or play another of the paper's examples.

    Parameters
    ----------
    name
        Another demo: ball, frog, hat, dance, broom, line, walk or jump; it goes into a folder of its name.
    all_of_them
        All eight, each into a folder of its name, and index.png of them all.
    out
        The folder that takes the videos, the contact sheet and the data.
    """
    from capture.errors import InputError
    from retarget.demos import table
    from retarget.demos.frog_to_bunny import demo as frog_to_bunny

    if name is not None and all_of_them:
        raise InputError(f"--all plays every demo, {name!r} among them: leave one of the two out")
    if name is not None:
        table.known(name)
    folder = folder_at(out)
    if all_of_them:
        return table.everything(folder)
    return frog_to_bunny(folder) if name is None else table.one(name, folder)


def fixtures(folder: Path) -> str:
    """Write the synthetic cartoons, their truth, motions as BVH files, and the characters to retarget to.

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
    moves = write.write_moves(folder)
    return (
        f"{folder}: {len(toons)} cartoons with their shots and truth, {len(moves)} motions without a picture, "
        f"{len(drawings)} drawings of characters"
    )
