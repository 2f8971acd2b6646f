"""All demos by name, one of them or one after the other."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.pictures.encode import write_picture
from retarget.demos import bodies, drawings, frog_to_bunny, photographs
from retarget.demos.shown import Shown, said, strip

Demo = Callable[[Path, float], Shown]

DEMOS: dict[str, Demo] = {
    "ball": drawings.ball_to_pumpkin,
    "frog": frog_to_bunny.frog_to_bunny,
    "hat": drawings.hat_to_witch_hat,
    "dance": drawings.dance_to_flower,
    "broom": photographs.broom_to_photograph,
    "line": drawings.line_to_bottle,
    "walk": bodies.walk_to_model,
    "jump": bodies.jump_to_lamp,
}
"""Each draws, captures and retargets into a folder (first argument), its cartoon so many times as large (second)."""


def known(name: str) -> Demo:
    """The demo of that name."""
    if name not in DEMOS:
        raise InputError(f"a demo must be one of {', '.join(DEMOS)}, {name!r} is none of them: choose one, or --all")
    return DEMOS[name]


def one(name: str, folder: Path) -> str:
    """Play the demo of that name into folder/name; returns the closing line."""
    return f"{said(play(name, folder))}; look at {folder / name}/demo.mp4"


def everything(folder: Path) -> str:
    """Play all demos, each into a folder of its name, and leave index.png of them all; returns the closing line."""
    shown = {name: play(name, folder) for name in DEMOS}
    write_picture(folder / "index.png", sheet(shown))
    worst = max(shown, key=lambda name: shown[name].off)
    return (
        f"{len(shown)} demos, {shown[worst].off:.2f} px from the drawn truth in the worst of them ({worst}); "
        f"look at {folder}/index.png and the demo.mp4 of each"
    )


def sheet(shown: dict[str, Shown], width: int = 220) -> NDArray:
    """A strip of every demo, one above the other: the source, and under it what was made of it; one picture."""
    strips = [strip(one_shown, width=width) for one_shown in shown.values()]
    gap = np.full((10, strips[0].shape[1], 3), 255, np.uint8)
    return np.concatenate([row for picture in strips for row in (picture, gap)][:-1])


def play(name: str, folder: Path, zoom: float = 1.0) -> Shown:
    """The demo in the folder of its name."""
    (folder / name).mkdir(exist_ok=True)
    return known(name)(folder / name, zoom)
