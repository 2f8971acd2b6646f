"""Sindbad's chest (Fleischer 1936, frames 300-355): its line, from shoulder to shoulder, bends a broom."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from skimage.io import imread

from capture.fit import action
from capture.fit.curves import medial
from capture.motion.tracks import CartoonMotion
from capture.pictures import overlay
from capture.pictures.encode import write_clip, write_picture
from retarget.characters.drawings import bend
from retarget.characters.drawings.svg import read_svg
from retarget.stage import draw2d
from retarget.stage.perform import Performance, perform

FIRST, STOP = 300, 356  # he turns to the viewer, and an arm passes before him
KNIFE = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (41, 41))  # he wears one, it cuts a bay into his shirt


@pytest.fixture(scope="module")
def shirts(data: Path) -> list[np.ndarray]:
    folder = data / "clips" / "sindbad_dance" / "mask_torso"
    return [imread(folder / f"{frame:05d}.png") for frame in range(FIRST, STOP)]


@pytest.fixture(scope="module")
def lines(shirts: list[np.ndarray]) -> np.ndarray:
    whole = [cv2.morphologyEx(shirt, cv2.MORPH_CLOSE, KNIFE) for shirt in shirts]
    return medial.medial_lines(whole, steady=1.5, calm=0.06)


@pytest.fixture(scope="module")
def motion(lines: np.ndarray, shirts: list[np.ndarray]) -> CartoonMotion:
    return action.capture_line(lines, most_keys=8, size=shirts[0].shape[::-1])


@pytest.fixture(scope="module")
def broom(data: Path, motion: CartoonMotion) -> Performance:
    drawn, _ = read_svg(data / "drawings" / "openclipart" / "broom_nicu_buculei_01.svg")
    return perform(motion, [bend.bent("line", motion.keyset("line"), drawn, bend.spine(drawn), thinning=0.3)])


def test_the_line_lies_in_the_shirt_and_its_ends_stay_apart(lines: np.ndarray, shirts: list[np.ndarray]):
    inside = []
    for line, shirt in zip(lines, shirts):
        x, y = np.rint(line.T).astype(int)
        near = cv2.dilate(shirt, np.ones((9, 9), np.uint8))
        inside.append((near[np.clip(y, 0, shirt.shape[0] - 1), np.clip(x, 0, shirt.shape[1] - 1)] > 127).mean())
    print(
        f"\nsindbad: the line lies in the shirt by {np.median(inside):.0%} in the median frame, {min(inside):.0%} worst"
    )
    assert np.median(inside) > 0.9
    assert (lines[:, 0, 0] < lines[:, -1, 0] - 100).all()  # his right shoulder stays on the left


def test_the_captured_line_is_the_line_and_jitters_little_more(lines: np.ndarray, motion: CartoonMotion):
    found = action.centre_lines(motion.points("line"))
    residual = motion.track("line").residual
    rough, smooth = (np.sqrt((np.diff(line, 2, axis=0) ** 2).sum(-1).mean()) for line in (found, lines))
    long = np.median(np.linalg.norm(np.diff(lines, axis=1), axis=-1).sum(axis=1))
    print(
        f"\nsindbad: {len(motion.track('line').keys)} keys, misfit at the worst point of a frame "
        f"{np.median(residual):.1f} px median, {residual.max():.1f} worst, of a line {long:.0f} long; 2nd difference "
        f"{rough:.1f} px, of the lines themselves {smooth:.1f}"
    )
    assert np.median(residual) < 0.04 * long and residual.max() < 0.1 * long
    assert rough < 1.3 * smooth


def test_a_contact_sheet_is_left_to_look_at(
    data: Path, shirts: list[np.ndarray], motion: CartoonMotion, broom: Performance, sheets: Path
):
    found = action.centre_lines(motion.points("line"))
    shown = []
    for t, (shirt, line) in enumerate(zip(shirts, found)):
        source = imread(data / "clips" / "sindbad_dance" / "frames" / f"{FIRST + t:05d}.jpg")
        seen = np.stack([255 - shirt // 3] * 3, axis=-1)
        cv2.polylines(seen, [np.rint(16 * line).astype(int)], False, (200, 40, 40), 7, cv2.LINE_AA, 4)
        cv2.circle(seen, tuple(int(v) for v in line[0]), 12, (200, 40, 40), -1, cv2.LINE_AA)
        shown.append(np.concatenate([source, seen, draw2d.draw(broom, t, "white")], axis=1))
    assert len(shown) == STOP - FIRST
    write_picture(sheets / "sindbad_broom.png", overlay.contact_sheet(shown[::4], columns=4, width=480))
    write_clip(sheets / "sindbad_broom.mp4", [cv2.resize(s, (s.shape[1] // 2, s.shape[0] // 2)) for s in shown], 24.0)
