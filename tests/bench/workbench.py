"""Milliseconds from a pointer's move to the pose that is drawn, in a headless Chromium; nothing where there is none."""

import runpy
import shutil
import tempfile
from pathlib import Path

import numpy as np

BROWSER = Path(__file__).resolve().parent.parent / "browser"


def rows():
    """The best of three medians of sixty moves each of a joint at the posing desk: of a skeleton, and of drawings."""
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if program is None:
        return {}
    from playwright.sync_api import sync_playwright

    flags = runpy.run_path(str(BROWSER / "conftest.py"))
    drawn = runpy.run_path(str(BROWSER / "test_workbench_posing.py"))
    found = {}
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as running:
        shown = running.chromium.launch(executable_path=program, args=[*flags["FLAGS"], *flags["WEBGL"]])
        for name, kind in (("drag_ms", ""), ("drag_svg_ms", "svg"), ("drag_picture_ms", "picture")):
            figure = drawn["drawing_in"](Path(folder), kind) if kind else "human"
            joints = ("left_hand", "right_hand", "left_foot") if kind else ("LeftHand", "RightHand", "LeftFoot")
            found[name] = _median(shown, drawn["DRAG"], folder, figure, joints)
        shown.close()
    return found


def _median(shown, drag, folder, figure, joints):
    from retarget.workbench import server
    from retarget.workbench.session import Session

    session = Session(folder)
    session.act({"do": "posing.begin", "who": figure})
    serving = server.start(session)
    page = shown.new_context(viewport={"width": 1280, "height": 720}).new_page()
    page.goto(serving.address)
    page.wait_for_selector(".postures")
    medians = [np.median(page.evaluate(drag, name)) for name in joints]  # which waits until joints can be dragged
    page.close()
    serving.stop()
    return float(min(medians))
