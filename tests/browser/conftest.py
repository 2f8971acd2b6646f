"""Real readers as judges: npm packages in a headless Chromium.  Each skips, and says why, where it is missing."""

import base64
import json
import os
import shutil
import subprocess
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

HERE = Path(__file__).resolve().parent
PACKAGES = HERE.parent.parent / ".browser" / "node_modules"
FLAGS = (
    *("--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync"),
)
WEBGL = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")  # slow, but it needs no card
KINDS = {".html": "text/html", ".js": "text/javascript", ".json": "application/json"}
SITE = "http://judges.test/"


@pytest.fixture(scope="session")
def packages():
    """The folder of npm packages."""
    if not PACKAGES.is_dir():
        pytest.skip("the readers are not installed: sh .ci/browser.sh fetches them from npm")
    return PACKAGES


@pytest.fixture(scope="session")
def launch():
    """Start a headless Chromium with more flags."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright, of the extra dev, is not installed")
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if program is None:
        pytest.skip("there is no chromium on this machine: sh .ci/browser.sh installs Debian's")
    with playwright.sync_playwright() as running:
        yield lambda *more: running.chromium.launch(executable_path=program, args=[*FLAGS, *more])


@pytest.fixture(scope="session")
def browser(launch):
    """A headless Chromium that can show WebGL."""
    shown = launch(*WEBGL)
    yield shown
    shown.close()


@pytest.fixture(scope="session")
def flat_browser(launch):
    """A headless Chromium without WebGL, whose pages are drawn as quickly as without a card they can be."""
    shown = launch()
    yield shown
    shown.close()


@pytest.fixture(scope="session")
def open_page(browser, packages):
    """Open one of the pages in this folder: every address below SITE is a file of it or of an npm package."""
    context = browser.new_context()

    def answer(route):
        name = route.request.url.removeprefix(SITE).split("?")[0]
        file = next((folder / name for folder in (HERE, packages) if (folder / name).is_file()), None)
        if file is None:
            route.fulfill(status=404)
        else:
            route.fulfill(body=file.read_bytes(), content_type=KINDS.get(file.suffix, "application/octet-stream"))

    def open_it(name):
        page = context.new_page()
        page.route("**/*", answer)
        told = []
        page.on("pageerror", lambda error: told.append(str(error)))
        page.on("console", lambda line: told.append(line.text) if line.type in ("error", "warning") else None)
        page.goto(SITE + name)
        page.wait_for_function("window.ready === true", timeout=60_000)
        return SimpleNamespace(page=page, told=told)

    yield open_it
    context.close()


@pytest.fixture(scope="session")
def three(open_page):
    """What three.js makes of a glTF file: (path, times, pictures) -> meshes, each with points (T, V, 3), and pictures.

    `pictures` are the times at which the file's own camera draws a PNG of the given size.
    """
    shown = open_page("three.html")

    def play(path, times, pictures=(), size=(320, 240)):
        content = base64.b64encode(Path(path).read_bytes()).decode()
        said = shown.page.evaluate("job => play(job)", [content, list(times), list(pictures), list(size)])
        assert shown.told == []
        meshes = []
        for mesh in said["meshes"]:
            points = np.frombuffer(base64.b64decode(mesh["points"]), np.float32)
            seen = np.array(mesh["seen"], bool)
            meshes.append(
                SimpleNamespace(**{**mesh, "points": points.reshape(len(times), -1, 3).astype(float), "seen": seen})
            )
        return SimpleNamespace(meshes=meshes, pictures=[_image(picture) for picture in said["pictures"]])

    return play


@pytest.fixture(scope="session")
def vector(open_page):
    """What a browser makes of an animated SVG, or lottie-web of a Lottie file, at times or frames.

    `(path, at, size)` with a size also takes a picture at each of them.
    """
    shown = open_page("vector.html")

    def play(path, at, size=None):
        text = Path(path).read_text(encoding="utf-8")
        which, content = ("svg", text) if Path(path).suffix == ".svg" else ("player", json.loads(text))
        shown.page.evaluate("([which, content]) => window[which].open(content)", [which, content])
        frames, pictures = [], []
        for moment in at:
            shown.page.evaluate("([which, moment]) => { window[which].go(moment) }", [which, float(moment)])
            paths = shown.page.evaluate("painted()")
            frames.append([SimpleNamespace(**path) for path in paths])
            if size is not None:
                clip = dict(zip(("x", "y", "width", "height"), (0, 0, *size)))
                png = shown.page.screenshot(clip=clip)
                pictures.append(_image("," + base64.b64encode(png).decode()))
        assert shown.told == []
        return SimpleNamespace(frames=frames, pictures=pictures)

    return play


@pytest.fixture(scope="session")
def validate(packages):
    """The issues that the Khronos validator finds in a glTF file."""
    if shutil.which("node") is None:
        pytest.skip("there is no node on this machine to run the Khronos validator")
    script = (
        "const [path, validator] = process.argv.slice(1);"
        "require(validator).validateBytes(new Uint8Array(require('fs').readFileSync(path)))"
        ".then(report => console.log(JSON.stringify(report)), error => { console.error(error); process.exit(1); });"
    )

    def of(path):
        command = ["node", "-e", script, str(path), str(packages / "gltf-validator")]
        said = subprocess.run(command, capture_output=True, text=True, check=True)
        return json.loads(said.stdout)["issues"]

    return of


def _image(url):
    import cv2

    png = np.frombuffer(base64.b64decode(url.split(",")[1]), np.uint8)
    return cv2.cvtColor(cv2.imdecode(png, cv2.IMREAD_UNCHANGED)[..., :3], cv2.COLOR_BGR2RGB)


@pytest.fixture
def slow():
    """How much slower than it should be this machine may be: 1 when it is idle, more while other work runs on it.

    Tests that run side by side share it with a browser's own processes; `make bench` measures alone.
    """
    busy = os.getloadavg()[0] / len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 1
    return max(1.0, busy) * (2 if "PYTEST_XDIST_WORKER" in os.environ else 1)
