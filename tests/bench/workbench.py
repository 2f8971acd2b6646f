"""Milliseconds from a pointer's move to the pose that is drawn, in a headless Chromium; nothing where there is none."""

import runpy
import shutil
import tempfile
from pathlib import Path

import numpy as np

BROWSER = Path(__file__).resolve().parent.parent / "browser"


def rows():
    """The best of three medians of sixty moves each of a joint at the posing desk."""
    from retarget.workbench import server
    from retarget.workbench.session import Session

    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if program is None:
        return {}
    from playwright.sync_api import sync_playwright

    flags = runpy.run_path(str(BROWSER / "conftest.py"))["FLAGS"]
    drag = runpy.run_path(str(BROWSER / "test_workbench_posing.py"))["DRAG"]
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as running:
        session = Session(folder)
        session.act({"do": "posing.begin", "who": "human"})
        session.act({"do": "posing.drag", "joint": 5, "to": [0.1, 1.5, 0.1]})  # machine code is made once
        session.act({"do": "undo"})
        serving = server.start(session)
        shown = running.chromium.launch(executable_path=program, args=flags)
        page = shown.new_context(viewport={"width": 1280, "height": 720}).new_page()
        page.goto(serving.address)
        page.wait_for_selector(".postures")
        medians = [np.median(page.evaluate(drag, name)) for name in ("LeftHand", "RightHand", "LeftFoot")]
        shown.close()
        serving.stop()
    return {"drag_ms": float(min(medians))}
