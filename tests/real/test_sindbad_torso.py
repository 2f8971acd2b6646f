"""Sindbad's torso (Fleischer 1936): its masks traced, brought into correspondence, and captured as contours."""

from pathlib import Path

import numpy as np
from skimage.io import imread

from capture.fit import contour, suggest
from capture.fit.curves import correspond
from capture.pictures import contours, matte, overlay
from capture.pictures.clip import clip_of
from capture.pictures.encode import write_picture


def test_the_torsos_masks_are_captured_as_contours(data: Path, sheets: Path):
    folder = data / "clips" / "sindbad_dance"
    files = sorted((folder / "mask_torso").glob("*"))[:60]
    masks = [imread(file) > 127 for file in files]
    traced = contours.contours_of_mattes([mask.astype(float) for mask in masks])
    outlines = correspond.align_all(traced, 90)
    found = suggest.suggest(outlines, most_residual=4.0, most_keys=8)
    size = (masks[0].shape[1], masks[0].shape[0])
    motion = contour.capture_outlines(outlines, found.key_frames, 24.0, size, "torso", smoothness=0.02)
    alike = [_overlap(matte.fill(size, outline) > 0, mask) for outline, mask in zip(motion.outline("torso"), masks)]
    residual = motion.tracks[0].residual
    print(
        f"\nSindbad's torso: {len(found.key_frames)} keys for {len(files)} frames, misfit median "
        f"{np.median(residual):.1f} px, worst {residual.max():.1f}; overlap with the masks median {np.median(alike):.2f}, "
        f"least {min(alike):.2f}"
    )
    frames = clip_of([imread(file)[..., :3] for file in sorted((folder / "frames").glob("*"))[: len(files)]])
    pictures = list(overlay.draw_over(frames, motion))
    write_picture(sheets / "sindbad_torso.png", overlay.contact_sheet(pictures[::4], columns=5, width=380))
    assert np.median(alike) > 0.75  # arms cut into the masks, and the figure turns from side to front
    assert min(alike) > 0.6


def _overlap(one: np.ndarray, other: np.ndarray) -> float:
    return float((one & other).sum() / (one | other).sum())
