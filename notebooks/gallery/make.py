"""Make the gallery's pictures of the demos again: `python notebooks/gallery/make.py`, two minutes."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from retarget.demos import table
from retarget.demos.shown import strip

HERE = Path(__file__).parent
COLOURS = 256
ALONE = {"hat": "hat_to_witch_hat", "broom": "broom_to_photograph"}


def main() -> None:
    """Play all demos in a folder that is thrown away, and keep strips of them."""
    with TemporaryDirectory() as folder:
        shown = {name: table.play(name, Path(folder)) for name in table.DEMOS}
        keep(table.sheet(shown, width=150), "eight_examples")
        for name, picture in ALONE.items():
            keep(strip(shown[name], count=5, width=240), picture)


def keep(picture: NDArray, name: str) -> None:
    """Write notebooks/gallery/NAME.png in few colours: drawings have few."""
    image = Image.fromarray(np.ascontiguousarray(picture))
    few = image.quantize(COLOURS, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)  # keeps rare colours
    few.save(HERE / f"{name}.png", optimize=True)


if __name__ == "__main__":
    main()
