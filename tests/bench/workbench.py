"""The workbench in a headless Chromium, in a page and in a JupyterLab; nothing of what is not installed.

A drag is from a pointer's move to the pose that is drawn: of three joints the best median, in milliseconds.
"""

import runpy
import shutil
import tempfile
from importlib.util import find_spec
from pathlib import Path

import numpy as np

BROWSER = Path(__file__).resolve().parent.parent / "browser"
JOINTS = ("LeftHand", "RightHand", "LeftFoot")
DRAWN = ("left_hand", "right_hand", "left_foot")


def rows():
    """Drags in the page, in a notebook by its socket and by its channel; drawn frames a second when scrubbing."""
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if program is None or find_spec("playwright") is None:
        return {}
    from playwright.sync_api import sync_playwright

    flags = runpy.run_path(str(BROWSER / "conftest.py"))
    with sync_playwright() as running:
        shown = running.chromium.launch(executable_path=program, args=[*flags["FLAGS"], *flags["WEBGL"]])
        try:
            found = {**_drags(shown), **_scrubs(shown)}
            if find_spec("jupyterlab") is not None and find_spec("anywidget") is not None:
                found |= _notebook_drags(shown)
        finally:
            shown.close()
    return found


def _drags(shown):
    """In a page of its own, of a skeleton and of drawings, and how many updates a second that makes."""
    told = runpy.run_path(str(BROWSER / "test_workbench_posing.py"))
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for way, kind in (("", ""), ("_svg", "svg"), ("_picture", "picture")):
            figure = told["drawing_in"](Path(folder), kind) if kind else "human"
            found |= _figures(way, _dragged(shown, told["DRAG"], folder, figure, DRAWN if kind else JOINTS))
    return found


def _dragged(shown, drag, folder, figure, joints):
    from retarget.workbench.serving import server
    from retarget.workbench.session import Session

    session = Session(folder)
    session.act({"do": "posing.begin", "who": figure})
    serving = server.start(session)
    try:
        page = _page(shown)
        page.goto(serving.address)
        page.wait_for_selector(".postures")
        taken = [page.evaluate(drag, name) for name in joints]  # which waits until joints can be dragged
        page.context.close()
    finally:
        serving.stop()
    return taken


def _scrubs(shown):
    """Frames a second of a clip, 640 x 480, each drawn; a page that has seen none of them begins anew each time."""
    from capture.pictures.encode import write_clip
    from fixtures import hat
    from retarget.workbench.serving import server
    from retarget.workbench.session import Session

    with tempfile.TemporaryDirectory() as folder:
        write_clip(Path(folder) / "hat.mp4", [hat.hat().frame(t) for t in range(33)], 24)
        serving = server.start(Session(folder, "hat.mp4"))
        try:
            return {"scrub_fps": max(_scrubbed(_page(shown), serving.address, 33) for _ in range(3))}
        finally:
            serving.stop()


def _scrubbed(page, address, count):
    page.goto(address)
    while not page.evaluate("document.querySelector('canvas.view')?.view?.frame === 0"):
        page.wait_for_timeout(20)
    rate = page.evaluate(runpy.run_path(str(BROWSER / "test_workbench.py"))["SCRUB"], count)
    page.context.close()
    return rate


def _notebook_drags(shown):
    """In a cell of JupyterLab by the socket, and, where that is refused, by the notebook's channel.

    Its updates a second are those of a hand that moves and does not wait for each pose, 60 places a second.
    """
    told = runpy.run_path(str(BROWSER / "test_workbench_jupyter.py"))
    found = {}
    with tempfile.TemporaryDirectory() as home, told["serving"](Path(home)) as lab:
        for way, begins in (("notebook", ""), ("channel", told["REFUSED"])):
            page = _page(shown, begins)
            told["show"](lab, page, f"{way}.ipynb", [told["BEGIN"]])
            found |= _figures(f"_{way}", [page.evaluate(told["DRAG"], [name, 60]) for name in JOINTS])
            found[f"updates_{way}_per_s"] = max(page.evaluate(told["STREAM"], [name, 90]) for name in JOINTS)
            page.context.close()
    return found


def _figures(way, taken):
    best = min(taken, key=np.median)
    return {f"drag{way}_ms": float(np.median(best)), f"updates{way}_per_s": 1000 * len(best) / float(np.sum(best))}


def _page(shown, begins=""):
    context = shown.new_context(viewport={"width": 1280, "height": 720})
    if begins:
        context.add_init_script(begins)
    return context.new_page()
