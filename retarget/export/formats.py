"""Which writer a file's name asks for: tables of curves, bodies for 3-D programs, drawings that stay vectors."""

import re
from collections.abc import Callable
from pathlib import Path


def table(path: Path) -> Callable | None:
    """A writer of the curves, (motion, path), for .csv and .curves.json."""
    from retarget.export.tables import write_csv, write_curves

    if path.name.endswith(".curves.json"):
        return write_curves
    return write_csv if path.suffix == ".csv" else None


def bodies(path: Path) -> Callable | None:
    """A writer of bodies, (performance, path), for .glb, .gltf, .usd, .usda, .usdc and .usdz."""
    if path.suffix in (".glb", ".gltf"):
        from retarget.export.gltf import write_glb

        return write_glb
    if path.suffix in (".usd", ".usda", ".usdc", ".usdz"):
        from retarget.export.usd import write_usd

        return write_usd
    return None


def drawings(path: Path) -> Callable | None:
    """A writer of drawings, (performance, path, width, background), for .json (Lottie), .svg and .jsx.

    A name of digits such as walk/0000.svg asks for a drawing a frame, in the folder walk.  A *.motion.json is none of
    them: a motion is captured, and must not be lost by a slip.
    """
    if path.suffix == ".json" and not path.name.endswith(".motion.json"):
        from retarget.export.lottie import write_lottie

        return write_lottie
    if path.suffix == ".jsx":
        from retarget.export.aftereffects import write_jsx

        return write_jsx
    if path.suffix == ".svg":
        from retarget.export.svg import write_svg, write_svg_frames

        if re.fullmatch(r"\d{4,}", path.stem):
            return lambda performance, path, *more: write_svg_frames(performance, path.parent, *more)
        return write_svg
    return None
