"""The workbench for everybody: judged by axe-core, worked by keys alone, on small screens and large."""

import re
import shutil
import time

import numpy as np
import pytest
from PIL import Image

from capture.motion import tracks
from capture.pictures.encode import write_clip
from fixtures import frog, hat, skeletons, write
from mocap.skeletons.bvh import write_bvh
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion
from retarget.workbench.serving import server
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
    tracks.save(tracks.trim(write.motion_of(frog.frog()), 0, 36), folder / "hop.motion.json")
    for file in write.CHARACTERS.glob("bunny_*.svg"):
        shutil.copy(file, folder)
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
        own = re.compile(rf"(https?|ws)://127\.0\.0\.1:{serving.port}/|data:|blob:")
        one.on("request", lambda request: None if own.match(request.url) else told.append(request.url))
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
    page.evaluate("tooncap.act('stage.play', {files: tooncap.state.stage.offers.find(({ fits }) => fits).files})")
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


# --- by keys alone ---------------------------------------------------------------------------------------------------

FOCUSED = """() => { const one = document.activeElement;
    return one === document.body ? "nothing" : one.getAttribute("aria-label") ||
        (one.closest("label") ?? one).textContent.trim().slice(0, 60) || one.tagName; }"""
MARKED = """() => { const style = getComputedStyle(document.activeElement);
    return document.activeElement.matches(":focus-visible") && style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 1; }"""


def tabbed_to(page, text, most=60):
    """The Tab key until what has the focus is called that."""
    for _ in range(most):
        page.keyboard.press("Tab")
        if page.evaluate(FOCUSED).startswith(text):
            return
    raise AssertionError(f"{text} cannot be reached, the focus is on {page.evaluate(FOCUSED)}")


def test_from_the_start_page_to_an_export_without_a_mouse(opened):
    page = opened()
    (page.folder / "bunny.svg").write_bytes((page.folder / "bunny_sit.svg").read_bytes())
    tabbed_to(page, "hat.mp4")
    page.keyboard.press("Enter")
    wait(page, "document.querySelector('canvas.view').view?.frame === 0")
    assert page.evaluate(FOCUSED).startswith("The clip")  # what was opened, and not nowhere
    page.keyboard.press("x")
    wait(page, "document.querySelector('.hint').textContent.startsWith('Box')")
    for key in ("ArrowLeft", "Shift+ArrowRight", "Shift+ArrowRight", "ArrowUp", "Shift+ArrowDown", "Enter"):
        page.keyboard.press(key)
    wait(page, "tooncap.state.capture.parts[0].box !== null")
    x, y, w, h = page.session.state.shot.parts[0].box
    points = hat.hat().parts[0].points[0]
    assert x < points[:, 0].min() and y < points[:, 1].min() and w * h < 3 * np.prod(np.ptp(points, axis=0))
    page.keyboard.press("Enter")
    wait(page, "tooncap.state.capture.motion !== null && !tooncap.running", seconds=90)
    page.keyboard.press("PageDown")
    tabbed_to(page, "bunny.svg")
    page.keyboard.press("Space")
    page.keyboard.press("Enter")
    wait(page, "tooncap.state.stage.cast !== null", seconds=60)
    tabbed_to(page, "Export as")
    page.keyboard.type("GIF")
    page.keyboard.press("Tab")
    page.keyboard.press("e")
    wait(page, "!tooncap.running && document.querySelector('.said.good') !== null", seconds=90)
    with Image.open(page.folder / "hat.retarget.gif") as gif:
        assert gif.n_frames == len(SHOWN)


def test_everything_can_be_reached_in_order_and_shows_that_it_has_the_focus(opened):
    page = opened("hat.mp4")
    told_its_part(page)
    page.evaluate("document.activeElement.blur()")
    places, seen = [], []
    for _ in range(40):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement === document.body"):
            break
        assert page.evaluate(MARKED), page.evaluate(FOCUSED)
        seen.append(page.evaluate(FOCUSED))
        places.append(page.evaluate("document.activeElement.closest('.bar, .rail, .stage, .side, .below').className"))
    order = [one for n, one in enumerate(places) if n == 0 or one != places[n - 1]]
    assert order == ["bar", "rail", "stage", "side", "below"]  # as it is read
    assert {"Capture", "Box", "Find keys", "Play (Space)", "Frame"} <= set(seen)


def test_the_focus_stays_when_a_panel_is_made_anew(opened):
    page = opened("hat.mp4")
    told_its_part(page)
    page.get_by_role("button", name="Add a part").focus()
    page.keyboard.press("Enter")
    wait(page, "tooncap.state.capture.parts.length === 2")
    assert page.evaluate(FOCUSED) == "Add a part"
    page.get_by_role("button", name="Undo").focus()
    page.keyboard.press("Enter")
    page.keyboard.press("Enter")
    wait(page, "tooncap.undo === ''")
    assert page.evaluate(FOCUSED) == "Redo"  # there is nothing more to undo
    page.keyboard.press("Enter")
    page.keyboard.press("Enter")
    wait(page, "tooncap.redo === ''")
    page.evaluate("tooncap.act('undo')")
    wait(page, "tooncap.state.capture.parts.length === 1")
    page.get_by_role("button", name="Find keys").focus()
    page.session._tell({"kind": "progress", "work": "capture.suggest", "label": "looking", "done": 1, "total": 9})
    wait(page, "document.querySelector('.side .primary').disabled")
    assert page.evaluate("document.querySelector('.side').contains(document.activeElement)")
    page.session._tell({"kind": "ended", "work": "capture.suggest", "sentence": "", "made": False})
    wait(page, "!document.querySelector('.side .primary').disabled")
    assert page.evaluate(FOCUSED) == "Find keys"  # as soon as it can have it again


def test_escape_leaves_a_box_and_stops_what_runs_and_question_mark_lists_all_keys(opened):
    page = opened("hat.mp4")
    page.keyboard.press("x")
    wait(page, "document.querySelector('.hint').textContent.startsWith('Box')")
    page.keyboard.press("Escape")
    wait(page, "document.querySelector('.hint').textContent.startsWith('Drag')")
    assert page.session.state.shot.parts[0].box is None
    tabbed_to(page, "Outline")
    page.keyboard.press("?")
    listed = page.locator("dialog[open] kbd").all_inner_texts()
    assert {"Space", "K", "X", "1-9", "Ctrl+Z", "?"} <= set(listed) and len(set(listed)) == len(listed)
    page.keyboard.press("b")  # is for nobody behind the list
    page.keyboard.press("Escape")
    assert page.locator("dialog[open]").count() == 0 and page.evaluate(FOCUSED) == "Outline"


def test_points_and_joints_are_moved_without_a_mouse(opened):
    page = opened("hat.mp4")
    told_its_part(page)
    before = np.array(page.session.state.shot.parts[0].keys[0].outline)
    for key in ("n", "n", "n", "Shift+N", "Shift+ArrowRight", "ArrowDown", "ArrowDown"):
        page.keyboard.press(key)
    assert "Point 1 of" in page.inner_text("[aria-label=Capture] .hint")
    wait(page, "tooncap.undo.startsWith('drag') && tooncap.idle()")
    moved = np.array(page.session.state.shot.parts[0].keys[0].outline)
    assert np.allclose(moved[1] - before[1], (8, 2), atol=1e-2)
    page.keyboard.press("Escape")
    page.keyboard.press("ArrowRight")
    assert page.evaluate("document.querySelector('canvas.strip').time.frame") == 1
    page.keyboard.press("Control+z")  # all of it was one step
    wait(page, "tooncap.undo.startsWith('draw')")


def test_a_joint_is_moved_without_a_mouse(opened):
    page = opened("kick.bvh")
    names = page.evaluate("tooncap.state.posing.figure.names")
    for _ in range(names.index("LeftHand") + 1 if "LeftHand" in names else len(names)):
        page.keyboard.press("n")
    joint = names.index("LeftHand") if "LeftHand" in names else len(names) - 1
    before = page.session.state.figure.pose.positions[joint].copy()
    for _ in range(4):
        page.keyboard.press("Shift+ArrowUp")
    wait(page, "tooncap.undo.startsWith('drag') && tooncap.idle()", seconds=60)
    assert page.session.state.figure.pose.positions[joint][1] > before[1] + 0.03
    page.keyboard.press("p")
    wait(page, f"tooncap.state.posing.pinned.includes({joint})")


def test_one_click_boxes_what_moves(opened):
    page = opened("hat.mp4")
    page.get_by_role("button", name="Box what moves").click()
    wait(page, "tooncap.state.capture.parts[0].box !== null")
    assert page.get_by_role("button", name="Box what moves").count() == 0


def test_a_screen_reader_hears_the_timeline(opened):
    page = opened("hop.motion.json")
    page.get_by_role("slider", name="Frame").first.focus()
    page.keyboard.press("ArrowRight")
    strip = page.get_by_role("slider", name="Frame").first
    assert strip.get_attribute("aria-valuenow") == "1" and strip.get_attribute("aria-valuemax") == "35"
    assert strip.get_attribute("aria-valuetext").startswith("frame 1 of 35")


def test_an_empty_desk_leads_to_where_there_is_something_to_do(opened):
    page = opened("hop.motion.json")
    tab(page, "Capture")
    assert "clip is not" in page.inner_text("[aria-label=Capture] .hint")
    page.get_by_role("button", name="To the stage").click()
    assert page.get_by_role("tab", name="Stage").get_attribute("aria-selected") == "true"
    tab(page, "Capture")
    page.get_by_role("button", name="Open a clip").click()
    page.get_by_text("hat.mp4").click()
    tab(page, "Stage")
    page.get_by_role("button", name="To the capture desk").click()
    assert page.get_by_role("tab", name="Capture").get_attribute("aria-selected") == "true"


# --- screens ---------------------------------------------------------------------------------------------------------

CUT = """() => { const whole = document.querySelector(".tooncap").getBoundingClientRect(), found = [];
    for (const one of document.querySelectorAll(".tooncap :is(button, input, select, canvas)")) {
        if (!one.checkVisibility() || one.closest("dialog")) continue;
        const box = one.getBoundingClientRect();
        let scrolls = false, cut = box.right > whole.right + 1 || box.bottom > whole.bottom + 1;
        for (let up = one.parentElement; !up.matches(".tooncap"); up = up.parentElement) {
            const { overflowX, overflowY } = getComputedStyle(up), room = up.getBoundingClientRect();
            if (up.matches(".side") && box.right > room.right + 1) found.push("beside its panel: " + one.outerHTML.slice(0, 60));
            if (/auto|scroll/.test(overflowX + overflowY)) scrolls = true;
            else if (/hidden|clip/.test(overflowX + overflowY)) cut ||= box.right > room.right + 1 || box.bottom > room.bottom + 1;
        }
        if (cut && !scrolls) found.push(one.outerHTML.slice(0, 90));
        if (one.matches("canvas.view") && (box.width < whole.width / 2 || box.height < whole.height / 2.2)) found.push(`a picture of ${box.width} x ${box.height}`);
    }
    if (document.documentElement.scrollWidth > innerWidth) found.push("wider than the screen");
    if (document.documentElement.scrollHeight > innerHeight) found.push("taller than the screen");
    return found; }"""
SCREENS = [(1280, 720, 1), (1024, 600, 1), (640, 360, 2), (700, 640, 1), (3840, 2160, 1)]  # the third is 1280 at 200 %


@pytest.mark.parametrize(("width", "height", "dense"), SCREENS)
def test_nothing_is_cut_off_on_any_screen(opened, width, height, dense):
    page = opened("hat.mp4", viewport={"width": width, "height": height}, device_scale_factor=dense)
    told_its_part(page)
    page.evaluate("tooncap.act('capture.add_part', {name: 'ribbon', frame: 0})")
    page.session._tell({"kind": "progress", "work": "capture.capture", "label": "fitting " * 5, "done": 3, "total": 9})
    page.wait_for_selector(".work:not([hidden])")
    for name in ("Capture", "Stage", "Pose"):
        tab(page, name)
        assert page.evaluate(CUT) == [], name


@pytest.mark.parametrize("how", [{"reduced_motion": "reduce"}, {"forced_colors": "active"}])
def test_calm_and_forced_colours_are_usable(opened, how):
    page = opened("kick.bvh", **how)
    page.locator(".rail").get_by_role("button", name="Rubber").click()
    wait(
        page, "document.querySelector('.hint') && document.querySelector('[aria-label=Pose] .frame').textContent !== ''"
    )
    if "reduced_motion" in how:
        assert page.get_by_role("button", name="Play (Space)").last.is_visible()  # nothing moves by itself
    else:
        chosen = page.get_by_role("tab", name="Pose")
        assert chosen.evaluate("one => getComputedStyle(one).outlineStyle") == "solid"


def test_what_is_said_is_said_to_all(opened):
    """Hints and messages are live regions, so that they are heard without being sought."""
    page = opened("hat.mp4")
    for place in (".said", "[aria-label=Capture] .hint"):
        assert page.locator(place).get_attribute("role") == "status"


def test_the_token_is_seen_nowhere_and_the_page_can_be_loaded_again(opened):
    page = opened("hat.mp4")
    assert "token" not in page.url
    page.reload()
    wait(page, "window.tooncap?.state.capture?.clip?.frames > 0")
    other = page.context.new_page()
    other.goto(page.url)
    wait(other, "window.tooncap?.state.capture?.clip?.frames > 0")
