"""Make the README's gallery anew, nothing by hand: `make gallery`, or some of it: `make gallery ARGS="analogy desks"`.

Each picture is drawn of what its commands leave; read `pictures`, which names them all, then `cartoons`, `skeletons`,
`desks` and `small`.
"""

import shlex
import sys
from collections.abc import Iterable
from contextlib import chdir, redirect_stderr
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory

from capture.errors import InputError
from capture.progress import progress
from fixtures import write
from notebooks.gallery import cartoons, desks, pictures, small
from retarget import cli

README = Path(__file__).parents[2] / "README.md"


def main(names: list[str]) -> int:
    """Make the pictures of these names, or all; returns what a command returns."""
    try:
        with TemporaryDirectory() as folder:
            made = make(chosen(names), Path(folder))
    except InputError as error:
        print(f"gallery: {error}", file=sys.stderr)
        return 2
    pictures.write_section(README)
    kept = [shown.file for shown in pictures.everything()]
    total = sum(file.stat().st_size for file in kept if file.exists())
    print(f"{made} of {len(kept)} pictures made, {total / 1e6:.1f} MB in all; look at README.md, Gallery")
    return 0


def make(shown: Iterable[pictures.Moving | pictures.Still], folder: Path, into: Path = pictures.HERE) -> int:
    """Make these pictures of what their commands leave in `folder`; returns how many could be made."""
    shown = list(shown)
    stills = [still for still in shown if still in pictures.DESKS]
    rest = [one for one in shown if one not in pictures.DESKS]
    done: set[str] = set()
    with chdir(folder):
        prepare()
        for one in progress(rest, "making the gallery", len(rest)):
            for command in one.commands:
                if command not in done:
                    run(command)
                    done.add(command)
            if isinstance(one, pictures.Moving):
                small.write_gif(into / one.file.name, one.draw(), one.fps, one.colours, one.hold)
            else:
                small.write_png(into / one.file.name, cartoons.frog_to_bunny_still())
        if stills and desks.NEEDS not in done:
            run(desks.NEEDS)
        photographed = (
            desks.photograph({still.name: into / still.file.name for still in stills}, folder) if stills else 0
        )
    return len(rest) + photographed


def prepare() -> None:
    """Of `tooncap fixtures f`, the part that the commands need."""
    Path("f").mkdir(exist_ok=True)
    write.write_moves("f")
    write.write_characters("f/characters")


def run(command: str) -> None:
    """One of the commands, as somebody would type it, without what it says besides."""
    said = StringIO()
    with redirect_stderr(said):
        failed = cli.main(shlex.split(command)[1:])
    if failed:
        raise InputError(f"{command!r} must work, it said: {said.getvalue().strip()}; mend it, or what it needs")


def chosen(names: list[str]) -> list[pictures.Moving | pictures.Still]:
    """The pictures whose file, or one of whose words, has one of these names; all without a name."""
    known = pictures.everything()
    if not names:
        return known
    for name in names:
        if not any(name in one.name for one in known):
            raise InputError(f"a picture must be one of {', '.join(one.name for one in known)}, got {name!r}: choose")
    return [one for one in known if any(name in one.name for name in names)]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
