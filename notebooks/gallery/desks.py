"""The gallery's stills of the workbench: each desk with something on it, photographed by a headless browser."""

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from fixtures import frog
from notebooks.gallery import small

NEEDS = "tooncap demo"  # what must have been done before
SIZE = {"width": 1280, "height": 720}
WIDTH = 960  # pixels of the still
TRIES = 150  # times that a page is looked at, until it stands still
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
STILL = 4  # pictures in a row that are alike
GO = """(frame) => {
    for (const strip of document.querySelectorAll("canvas.strip")) if (strip.offsetParent) strip.time?.go?.(frame);
}"""
THERE = """(frame) => {
    const canvas = [...document.querySelectorAll("canvas.view")].find((one) => one.offsetParent);
    return !canvas.view || canvas.view.frame === frame;
}"""


def photograph(files: dict[str, Path], folder: Path) -> int:
    """Write stills of the desks to these files by name; returns how many.

    Where there is no browser they stay as they are, and that is said.
    """
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        program = None
    if program is None:
        print("the desks' stills stay as they are: there is no Chromium here, or playwright is not installed")
        return 0
    with sync_playwright() as running:
        browser = running.chromium.launch(executable_path=program, args=["--no-sandbox", "--disable-quic"])
        for name, file in files.items():
            begin, frame = DESKS[name]
            room = folder / name
            room.mkdir()
            small.write_png(file, small.scaled([_seen(browser, begin(room), frame)], WIDTH)[0])
        browser.close()
    return len(files)


def capture(room: Path) -> Any:
    """The frog's clip, its keys and its motion."""
    for name in ("frog.mp4", "frog.shot.toml", "frog.motion.json"):
        shutil.copy("demo/" + name, room / name)
    return _session(room, "frog.shot.toml")


def stage(room: Path) -> Any:
    """The frog's motion, played by the bunny."""
    shutil.copy("demo/frog.motion.json", room / "frog.motion.json")
    names = [f"bunny_{key}.svg" for key in frog.KEYS]
    for name in names:
        shutil.copy("f/characters/" + name, room / name)
    return _session(
        room, "frog.motion.json", {"do": "stage.play", "files": names}, {"do": "stage.background", "what": "#cfe3ee"}
    )


def posing(room: Path) -> Any:
    """A kicking figure with its left foot pinned, its right hand dragged, and postures on its beats."""
    shutil.copy("f/kick.bvh", room / "kick.bvh")
    session = _session(room, "kick.bvh")
    figure = session.state.figure
    foot, hand = (figure.skeleton.names.index(name) for name in ("LeftFoot", "RightHand"))
    to = (figure.pose.positions[hand] + (-0.35, 0.8, 0.2)).tolist()
    return _told(session, {"do": "posing.pin", "joint": foot}, {"do": "posing.drag", "joint": hand, "to": to})


DESKS: dict[str, tuple[Callable[[Path], Any], int]] = {
    "desk_capture": (capture, 26),
    "desk_stage": (stage, 26),
    "desk_posing": (posing, 0),
}
"""What is on each desk, and the frame that is looked at."""


def _session(room: Path, file: str, *messages: dict[str, Any]) -> Any:
    from retarget.workbench.session import Session

    return _told(Session(room, file), *messages)


def _told(session: Any, *messages: dict[str, Any]) -> Any:
    for message in messages:
        event = session.act(message)[-1]
        assert event["kind"] == "done", event
    return session


def _seen(browser: Any, session: Any, frame: int) -> NDArray:
    """A picture of the page on a session, once it stands still."""
    from io import BytesIO

    from PIL import Image

    from retarget.workbench.serving import server

    serving = server.start(session)
    try:
        page = browser.new_page(viewport=SIZE, reduced_motion="reduce")
        page.goto(serving.address)
        page.wait_for_selector("canvas.view:visible")
        page.wait_for_timeout(500)
        page.evaluate(GO, frame)
        pictures: list[NDArray] = []
        for _ in range(TRIES):
            page.wait_for_timeout(300)
            if page.evaluate(THERE, frame):
                pictures.append(np.asarray(Image.open(BytesIO(page.screenshot())).convert("RGB")))
            if len(pictures) >= STILL and all(np.array_equal(pictures[-1], other) for other in pictures[-STILL:]):
                break
        else:
            raise InputError(f"a desk must stand still to be photographed, at frame {frame} it did not: try again")
        page.close()
    finally:
        serving.stop()
    return pictures[-1]
