"""The workbench for everybody: judged by axe-core, worked by keys alone, on small screens and large."""

import shutil
import time

import numpy as np
import pytest

from capture.motion import tracks
from capture.pictures.encode import write_clip
from fixtures import frog, hat, skeletons, write
from mocap.skeletons.bvh import write_bvh
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion
from retarget.workbench import server
from retarget.workbench.session import Session

SHOWN = (0, 2, 4, 6, 8, 10, 14, 18)
JUDGE = """async () => {
    const found = await axe.run(document, {
        runOnly: ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"],
    });
    return found.violations.map(({ id, help, nodes }) =>
        `${id}: ${help}: ${nodes.slice(0, 3).map(({ html, failureSummary }) => html.slice(0, 300) + " " + failureSummary)}`);
}"""


@pytest.fixture(scope="module")
def material(tmp_path_factory):
    """A folder with everything that the desks work on: a clip, a motion with its drawings, and motion capture."""
    folder = tmp_path_factory.mktemp("material")
    write_clip(folder / "hat.mp4", [hat.hat().frame(t) for t in SHOWN], 24)
    tracks.save(write.motion_of(frog.frog()), folder / "hop.motion.json")
    for file in write.write_characters(folder / "all"):
        if file.stem.startswith("bunny"):
            shutil.copy(file, folder)
    shutil.rmtree(folder / "all")
    figure = skeletons.kick(1.0, 30.0)
    skeleton = Skeleton(figure.names, figure.parents, np.array(figure.offsets, float))
    write_bvh(SkeletonMotion(skeleton, figure.translation, figure.rotation, 30.0), folder / "kick.bvh")
    return folder


@pytest.fixture
def opened(flat_browser, material, tmp_path):
    """opened(file, ...) is a page on a copy of the material with a file of it open; with "" on the start page."""
    told, ends = [], []

    def page(file="", folder=None, **how):
        if folder is None:
            folder = shutil.copytree(material, tmp_path / "here", dirs_exist_ok=True)
        serving = server.start(Session(folder, file))
        context = flat_browser.new_context(**{"viewport": {"width": 1280, "height": 720}, **how})
        ends.extend((serving.stop, context.close))
        one = context.new_page()
        one.on("pageerror", lambda error: told.append(str(error)))
        one.goto(serving.address)
        one.session, one.folder = serving.session, folder
        wait(one, "window.tooncap?.state.folder !== undefined")
        return one

    yield page
    for end in reversed(ends):
        end()
    assert told == []


@pytest.fixture(scope="session")
def axe(packages):
    file = packages / "axe-core" / "axe.min.js"
    if not file.exists():
        pytest.skip("axe-core is not installed: sh .ci/browser.sh fetches it from npm")
    return file.read_text(encoding="utf-8")


@pytest.fixture
def judged(axe):
    """What axe-core finds fault with on a page as it is now."""

    def judge(page):
        if not page.evaluate("'axe' in window"):
            page.evaluate(axe + "; 0")
        page.wait_for_timeout(50)
        return page.evaluate(JUDGE)

    return judge


def wait(page, expression, seconds=30):
    end = time.monotonic() + seconds
    while not page.evaluate(expression):
        assert time.monotonic() < end, expression
        page.wait_for_timeout(20)


def told_its_part(page):
    ring = [[float(x), float(y)] for x, y in hat.hat().parts[0].points[0]]
    page.evaluate("points => tooncap.act('capture.outline', {part: 'character', frame: 0, points})", ring)
    wait(page, "tooncap.state.capture.parts[0].keys[0].outline.length > 0")


def tab(page, name):
    page.get_by_role("tab", name=name).click()
    page.wait_for_timeout(100)


def test_the_start_page_has_no_faults(opened, judged, tmp_path):
    (tmp_path / "empty").mkdir()
    assert judged(opened(folder=tmp_path / "empty")) == []
    assert judged(opened()) == []


def test_a_page_without_its_token_says_so_and_has_no_faults(opened, judged):
    page = opened()
    page.evaluate("localStorage.clear()")
    page.reload()
    page.get_by_text("Open the address that tooncap printed").wait_for()
    assert judged(page) == []


def test_the_capture_desk_has_no_faults(opened, judged):
    page = opened("hat.mp4")
    assert judged(page) == []
    page.keyboard.press("Enter")  # cannot be done yet
    page.wait_for_selector(".said:not([hidden])")
    assert judged(page) == []
    told_its_part(page)
    page.evaluate("tooncap.act('capture.add_part', {name: 'ribbon', frame: 0})")
    wait(page, "tooncap.state.capture.parts.length === 2")
    page.session._tell({"kind": "progress", "work": "capture.capture", "label": "fitting", "done": 3, "total": 9})
    page.wait_for_selector(".work:not([hidden])")
    assert judged(page) == []


@pytest.mark.parametrize("desk", ["Stage", "Pose"])
def test_the_other_desks_have_no_faults_while_they_are_empty(opened, judged, desk):
    page = opened("hat.mp4")
    tab(page, desk)
    assert judged(page) == []


def test_the_stage_desk_has_no_faults(opened, judged):
    page = opened("hop.motion.json")
    assert judged(page) == []
    page.evaluate("tooncap.act('stage.play', {files: tooncap.state.stage.drawings})")
    wait(page, "tooncap.state.stage.number > 0")
    page.evaluate("tooncap.act('stage.pin_feet', {part: 'frog'})")
    wait(page, "tooncap.state.stage.cast.keep.length === 1")
    page.wait_for_timeout(500)
    assert judged(page) == []


def test_the_posing_desk_has_no_faults(opened, judged):
    page = opened("kick.bvh")
    for mode in ("Pose", "Dance", "Rubber"):
        page.locator(".rail").get_by_role("button", name=mode).click()
        page.wait_for_timeout(300)
        assert judged(page) == [], mode
