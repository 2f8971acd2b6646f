"""The widget in a real JupyterLab, in a headless Chromium: by a socket of its own, and by the notebook's channel."""

import json
import os
import secrets
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
DRAG = """async ([name, moves]) => {
    const canvas = document.querySelector("[aria-label=Pose] canvas.view"), sticks = canvas.sticks;
    const joint = tooncap.state.posing.figure.names.indexOf(name), box = canvas.getBoundingClientRect();
    const point = (kind, x, y) => canvas.dispatchEvent(new PointerEvent(kind, { bubbles: true, button: 0, pointerId: 1,
        clientX: box.left + x, clientY: box.top + y }));
    canvas.setPointerCapture = () => {};
    let told = () => {};
    tooncap.on("state", () => told());
    const [x, y] = sticks.seen(tooncap.state.posing.pose[joint]), taken = [];
    point("pointerdown", x, y);
    for (let n = 1; n <= moves; n++) {
        const began = performance.now();
        const answered = new Promise((resolve) => { told = resolve; });
        point("pointermove", x - n / 2, y - n);
        await answered;
        await new Promise((resolve) => { sticks.drawn = resolve; sticks.draw(); });
        taken.push(performance.now() - began);
    }
    sticks.drawn = undefined;
    point("pointerup", x - moves / 2, y - moves);
    return taken;
}"""
STREAM = """async ([name, moves]) => {
    const canvas = document.querySelector("[aria-label=Pose] canvas.view"), sticks = canvas.sticks;
    const joint = tooncap.state.posing.figure.names.indexOf(name), box = canvas.getBoundingClientRect();
    const point = (kind, x, y) => canvas.dispatchEvent(new PointerEvent(kind, { bubbles: true, button: 0, pointerId: 1,
        clientX: box.left + x, clientY: box.top + y }));
    canvas.setPointerCapture = () => {};
    let seen = 0, pose = null;
    tooncap.on("state", () => {
        const now = JSON.stringify(tooncap.state.posing.pose);
        seen += now !== pose;
        pose = now;
    });
    const [x, y] = sticks.seen(tooncap.state.posing.pose[joint]), began = performance.now();
    point("pointerdown", x, y);
    for (let n = 1; n <= moves; n++) {
        point("pointermove", x - n / 2, y - n / 2);
        await new Promise((resolve) => setTimeout(resolve, 16));
    }
    const rate = seen / ((performance.now() - began) / 1000);
    point("pointerup", x - moves / 2, y - moves / 2);
    return rate;
}"""  # other poses a second while the hand moves and waits for none
REFUSED = """const Open = window.WebSocket; window.WebSocket = class extends Open {
    constructor(address, ...more) {
        if (String(address).includes("/socket?token=")) throw new Error("no way there");
        super(address, ...more);
    }
};"""  # as where the kernel runs on another machine
BEGIN = """from retarget.workbench.widget import workbench
bench = workbench(".")
for message in (
    {"do": "posing.begin", "who": "human"},
    {"do": "posing.drag", "joint": 5, "to": [0.1, 1.5, 0.1]},  # the springs' machine code is made when first needed
    {"do": "undo"},
):
    bench.session.act(message)
bench"""
CLOSE = """import socket
port = bench.talk.serving.port
bench.close()
with socket.socket() as way:
    print("closed" if way.connect_ex(("127.0.0.1", port)) else "still open")"""
CELLS = "[...jupyterapp.shell.currentWidget.content.widgets].map((cell) => cell.model.sharedModel.source)"
READY = "window.jupyterapp?.shell.currentWidget?.context?.sessionContext?.session?.kernel?.status === 'idle'"


@contextmanager
def serving(home):
    """A JupyterLab of its own on this machine, with nothing of the user's; all that it writes is in a folder."""
    token = secrets.token_hex(12)
    for name in ("work", "settings/@jupyterlab/apputils-extension"):
        (home / name).mkdir(parents=True)
    quiet = home / "settings/@jupyterlab/apputils-extension/notification.jupyterlab-settings"
    quiet.write_text(json.dumps({"checkForUpdates": False, "fetchNews": "false"}))  # nothing is asked of the open web
    folders = {f"JUPYTER_{name.upper()}_DIR": str(home / name) for name in ("config", "data", "runtime")}
    paths = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
    flags = ["--no-browser", "--allow-root", "--expose-app-in-browser", "--ip=127.0.0.1", "--port=0"]
    flags += [f"--IdentityProvider.token={token}", f"--ServerApp.root_dir={home / 'work'}"]
    flags += [f"--LabApp.user_settings_dir={home / 'settings'}", f"--LabApp.workspaces_dir={home / 'workspaces'}"]
    with (home / "log").open("wb") as log:
        process = subprocess.Popen(
            [sys.executable, "-m", "jupyterlab", *flags],
            env={**os.environ, **folders, "IPYTHONDIR": str(home / "ipython"), "PYTHONPATH": paths},
            stdout=log,
            stderr=log,
        )
    try:
        end = time.monotonic() + 90
        while not (told := _running(home / "runtime")):
            assert process.poll() is None and time.monotonic() < end, (home / "log").read_text()
            time.sleep(0.1)
        yield SimpleNamespace(work=home / "work", address=told["url"], token=token)
    finally:
        process.terminate()
        process.wait(30)


def show(lab, page, name, sources):
    """Open a new notebook of cells in the page, and run it until the posing desk is seen."""
    import nbformat

    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(source) for source in sources])
    notebook.metadata["kernelspec"] = {"name": "python3", "display_name": "Python 3", "language": "python"}
    nbformat.write(notebook, lab.work / name)
    page.goto(f"{lab.address}lab/tree/{name}?token={lab.token}&reset")
    page.wait_for_function(READY, timeout=90_000)
    page.evaluate("jupyterapp.commands.execute('notebook:run-all-cells')")
    page.wait_for_selector(".postures", timeout=90_000)
    page.evaluate("document.querySelector('.tooncap-cell').scrollIntoView()")


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """A JupyterLab for all tests here."""
    pytest.importorskip("jupyterlab", reason="jupyterlab, of the extra notebook, is not installed")
    pytest.importorskip("anywidget", reason="anywidget, of the extra notebook, is not installed")
    with serving(tmp_path_factory.mktemp("jupyter")) as running:
        yield running


@pytest.fixture
def opened(lab, flat_browser, request):
    """A notebook of cells, shown and run; `request.param` is a script that its page begins with."""
    context = flat_browser.new_context(viewport={"width": 1280, "height": 720})
    if getattr(request, "param", ""):
        context.add_init_script(request.param)
    told, asked = [], []

    def shown(*sources):
        page = context.new_page()
        page.on("pageerror", lambda error: told.append(str(error)))
        page.on("request", lambda request: asked.append(request.url))
        show(lab, page, f"{request.node.name.split('[')[0]}.ipynb", sources)
        return page

    yield shown
    context.close()
    assert [line for line in told if "no way there" not in line] == []
    assert [url for url in asked if not url.startswith((lab.address, "blob:", "data:"))] == []


def wait(page, expression, seconds=30):
    end = time.monotonic() + seconds
    while not page.evaluate(expression):
        assert time.monotonic() < end, expression
        page.wait_for_timeout(20)


def run(page, source):
    """Run the notebook's second cell with this in it."""
    page.evaluate(
        """(source) => {
            const notebook = jupyterapp.shell.currentWidget.content;
            notebook.activeCellIndex = 1;
            notebook.activeCell.model.sharedModel.setSource(source);
            return jupyterapp.commands.execute("notebook:run-cell");
        }""",
        source,
    )


def _running(folder):
    """What JupyterLab says about itself once it listens."""
    try:
        return json.loads(next(folder.glob("jpserver-*.json")).read_text())
    except (StopIteration, ValueError):
        return None


def test_in_a_cell_a_drag_is_as_quick_as_in_a_page_and_undo_stays_inside(opened, slow):
    page = opened(BEGIN, "bench")
    ways = page.eval_on_selector_all(".tooncap-cell", "(cells) => cells.map((cell) => cell.dataset.way)")
    assert set(ways) == {"socket"}
    assert page.evaluate("document.querySelector('.tooncap-cell').clientHeight") <= 0.85 * 720  # seen as a whole
    rest = page.evaluate("JSON.stringify(tooncap.state.posing.pose)")
    page.evaluate(DRAG, ["LeftHand", 10])
    taken = min((page.evaluate(DRAG, ["RightHand", 40]) for _ in range(2)), key=np.median)
    assert np.median(taken) <= 33 * slow
    wait(page, "tooncap.idle() && tooncap.undo === 'drag a joint'")
    page.locator(".tooncap-cell canvas.view:visible").first.focus()
    for _ in range(3):
        page.keyboard.press("Control+z")
    wait(page, f"JSON.stringify(tooncap.state.posing.pose) === {json.dumps(rest)}")
    assert page.evaluate(CELLS) == [BEGIN, "bench"]


def test_a_cell_run_again_shows_the_work_and_closing_ends_the_socket(opened):
    page = opened(BEGIN, "bench")
    wait(page, "document.querySelectorAll('.tooncap-cell[data-way=socket]').length === 2")
    page.evaluate(DRAG, ["LeftHand", 3])
    wait(page, "tooncap.idle() && tooncap.undo === 'drag a joint'")
    posed = page.evaluate("JSON.stringify(tooncap.state.posing.pose)")
    run(page, "bench")
    wait(page, "document.querySelectorAll('.tooncap-cell[data-way=socket]').length === 2")
    wait(page, f"JSON.stringify(tooncap.state.posing?.pose) === {json.dumps(posed)}")
    run(page, CLOSE)
    page.wait_for_function(
        "document.querySelector('.jp-Notebook').innerText.split('\\n').includes('closed')", timeout=30_000
    )


@pytest.mark.parametrize("opened", [REFUSED], indirect=True, ids=["refused"])
def test_where_the_socket_is_refused_the_notebooks_channel_does(opened, slow):
    page = opened(BEGIN)
    assert page.get_attribute(".tooncap-cell", "data-way") == "channel"
    taken = page.evaluate(DRAG, ["LeftHand", 20])
    assert np.median(taken) <= 150 * slow
    assert page.evaluate(STREAM, ["RightHand", 60]) >= 20 / slow  # 30 where nothing else runs
    wait(page, "tooncap.idle() && tooncap.undo === 'drag a joint'")
