"""The workbench in a headless Chromium, as a person uses it: pointer and keys, and what is seen and kept."""

import re
import shutil
import time

import numpy as np
import pytest

from capture.motion import tracks
from capture.pictures.encode import write_clip
from capture.pictures.shot import read_shot
from fixtures import hat
from retarget.workbench.serving import server
from retarget.workbench.session import Session

SHOWN = (0, 2, 4, 6, 8, 10, 14, 18, 22, 26, 28, 30, 32)
DRAG = """async () => {
    const canvas = document.querySelector("canvas.view"), view = canvas.view, bench = window.tooncap;
    const key = bench.state.capture.parts[0].keys[0];
    const box = canvas.getBoundingClientRect();
    const point = (kind, x, y) => canvas.dispatchEvent(new PointerEvent(kind, { bubbles: true, button: 0, pointerId: 1,
        clientX: box.left + x, clientY: box.top + y }));
    canvas.setPointerCapture = () => {};
    let told = () => {};
    bench.on("state", () => told());
    const [x, y] = view.toScreen(key.outline[5]), taken = [];
    point("pointerdown", x, y);
    for (let n = 1; n <= 60; n++) {
        const began = performance.now();
        const answered = new Promise((resolve) => { told = resolve; });
        point("pointermove", x + n, y + n / 2);
        await answered;
        await new Promise((resolve) => { view.drawn = resolve; view.draw(); });
        taken.push(performance.now() - began);
    }
    view.drawn = undefined;
    point("pointerup", x + 60, y + 30);
    return taken;
}"""
SCRUB = """async (count) => {
    const view = document.querySelector("canvas.view").view, time = document.querySelector("canvas.strip").time;
    const began = performance.now();
    for (let frame = 1; frame < count; frame++) {
        time.go(frame);
        do await new Promise(requestAnimationFrame); while (view.frame !== frame);
    }
    return (count - 1) / ((performance.now() - began) / 1000);
}"""  # a frame counts when the screen has had time to show it, so 60 is the most


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    """Some drawings of a witch's hat, 640 x 480."""
    path = tmp_path_factory.mktemp("clip") / "hat.mp4"
    write_clip(path, [hat.hat().frame(t) for t in SHOWN], 24)
    return path


@pytest.fixture
def bench(flat_browser, clip, tmp_path):
    """A workbench in a folder that holds the clip; bench() opens a page of it, `told` is what its console said."""
    shutil.copy(clip, tmp_path / "hat.mp4")
    serving = server.start(Session(tmp_path))
    context = flat_browser.new_context(viewport={"width": 1280, "height": 720})
    told = []

    def page(opened=True):
        one = context.new_page()
        one.on("pageerror", lambda error: told.append(str(error)))
        one.on("console", lambda line: told.append(line.text) if line.type in ("error", "warning") else None)
        one.on("request", lambda request: told.append(request.url) if _elsewhere(request.url, serving.port) else None)
        one.goto(serving.address)
        if opened:
            if not serving.session.state.name:
                one.get_by_text("hat.mp4").click()
            wait(one, "document.querySelector('canvas.view').view.frame === 0")
        return one

    page.folder, page.session = tmp_path, serving.session
    yield page
    context.close()
    serving.stop()
    assert told == []


def _elsewhere(url, port):
    return not re.match(rf"(https?|ws)://127\.0\.0\.1:{port}/|data:|blob:", url)


def wait(page, expression, seconds=15):
    """Until an expression is true; the page itself refuses to evaluate text, so it is asked from outside."""
    end = time.monotonic() + seconds
    while not page.evaluate(expression):
        assert time.monotonic() < end, expression
        page.wait_for_timeout(20)


def at(page, x, y):
    """Where a pixel of the picture is on the page."""
    return page.evaluate(
        """([x, y]) => { const canvas = document.querySelector("canvas.view");
            const box = canvas.getBoundingClientRect(), [left, top] = canvas.view.toScreen([x, y]);
            return [box.left + left, box.top + top]; }""",
        [float(x), float(y)],
    )


def drag(page, begin, end, steps=6):
    page.mouse.move(*at(page, *begin))
    page.mouse.down()
    page.mouse.move(*at(page, *end), steps=steps)
    page.mouse.up()


def boxed(page):
    points = hat.hat().parts[0].points[SHOWN[0]]
    drag(page, points.min(axis=0) - 8, points.max(axis=0) + 8)
    wait(page, "tooncap.state.capture.parts[0].box !== null")


def outlined(page):
    """The part told by its true outline in the first frame."""
    ring = [[float(x), float(y)] for x, y in hat.hat().parts[0].points[SHOWN[0]]]
    page.evaluate("points => tooncap.act('capture.outline', {part: 'character', frame: 0, points})", ring)
    wait(page, "tooncap.state.capture.parts[0].keys[0].outline.length > 0")


def kept(bench):
    """The first key's outline in the shot file, once that holds what the session does: within a second."""
    file, end = bench.folder / "hat.shot.toml", time.monotonic() + 1
    while read_shot(file).parts != bench.session.state.shot.parts:
        assert time.monotonic() < end
    return read_shot(file).parts[0].keys[0].outline


def test_from_a_folder_to_a_motion_by_hand(bench):
    page = bench()
    assert "Drag a box" in page.inner_text(".hint")
    boxed(page)
    wait(page, "document.querySelector('.hint').textContent.startsWith('Blue')", seconds=30)
    page.get_by_role("button", name="Find keys").click()
    wait(page, "tooncap.state.capture.parts[0].keys.length > 1 && !tooncap.running", seconds=60)
    page.get_by_role("button", name="Capture", exact=True).click()
    wait(page, "tooncap.state.capture.motion !== null && !tooncap.running", seconds=60)
    motion = tracks.load(bench.folder / "hat.motion.json")
    assert len(motion.times) == len(SHOWN)
    for t, shown in enumerate(SHOWN):
        drawn = hat.hat().parts[0].points[shown]
        off = np.linalg.norm(motion.outline("character")[t][:, None] - drawn, axis=-1).min(axis=1)
        assert np.median(off) < 6  # an outline lies round the ink
    page.keyboard.press("End")
    worst = page.evaluate("tooncap.state.capture.motion.worst")
    x = page.evaluate(
        """frame => { const strip = document.querySelector("canvas.strip"), box = strip.getBoundingClientRect();
            const inside = box.width - 52 - 16;
            return [box.left + 52 + (frame + 0.5) / (strip.time.last + 1) * inside, box.top + 20]; }""",
        worst[0],
    )
    page.mouse.click(*x)
    assert page.evaluate("document.querySelector('canvas.strip').time.frame") == worst[0]
    assert worst[0] not in [key.frame for key in bench.session.state.shot.parts[0].keys]
    page.keyboard.press("f")
    wait(page, "tooncap.state.capture.stale")
    (marked,) = page.evaluate("document.querySelector('canvas.strip').time.again")
    assert marked["first"] <= worst[0] <= marked["last"]
    again = page.get_by_role("button", name=re.compile(f"^Track again {marked['first']}.{marked['last']}$"))
    assert "primary" in again.get_attribute("class")
    page.keyboard.press("Enter")  # the key is for what stands out
    page.wait_for_selector(".said.good:not([hidden])", timeout=60_000)
    said = f"Tracked again: character in {marked['first']} to {marked['last']}."
    assert page.inner_text(".said") == said and not page.evaluate("tooncap.state.capture.stale")
    assert page.evaluate("document.querySelector('canvas.strip').time.again.length") == 0


def test_a_dragged_point_is_kept_and_undone_by_the_keyboard(bench):
    page = bench()
    outlined(page)
    before = bench.session.state.shot.parts[0].keys[0].outline
    page.keyboard.press("v")
    drag(page, before[10], np.array(before[10]) + (25, -18), steps=12)
    wait(page, "tooncap.undo.startsWith('drag') && tooncap.idle()")
    moved = np.array(kept(bench))
    assert np.linalg.norm(moved[10] - before[10] - (25, -18)) < 1.5
    page.keyboard.press("Control+z")
    wait(page, "tooncap.redo.startsWith('drag')")
    assert bench.session.state.shot.parts[0].keys[0].outline == before
    page.keyboard.press("Control+Shift+z")
    wait(page, "tooncap.redo === ''")
    assert np.array_equal(bench.session.state.shot.parts[0].keys[0].outline, moved)


def test_the_pivot_is_a_cross_that_can_be_dragged(bench):
    page = bench()
    outlined(page)
    page.keyboard.press("End")
    page.keyboard.press("p")  # it is told in the first key's frame
    assert page.evaluate("document.querySelector('canvas.strip').time.frame") == 0
    drag(page, (300, 200), (330, 260))
    wait(page, "tooncap.state.capture.parts[0].pivot !== null && tooncap.idle()")
    assert np.allclose(bench.session.state.shot.parts[0].pivot, (330, 260), atol=1.5)
    page.keyboard.press("Control+z")
    wait(page, "tooncap.state.capture.parts[0].pivot === null")


def test_a_reload_loses_nothing(bench):
    page = bench()
    outlined(page)
    page.evaluate("tooncap.act('capture.add_part', {name: 'ribbon', frame: 0})")
    wait(page, "tooncap.state.capture.parts.length === 2")
    before = page.evaluate("JSON.stringify(tooncap.state.capture.parts)")
    page.reload()
    wait(page, "window.tooncap?.state.capture?.parts.length === 2")
    assert page.evaluate("JSON.stringify(tooncap.state.capture.parts)") == before
    page.keyboard.press("Control+z")  # the past is there as well
    wait(page, "tooncap.state.capture.parts.length === 1")


def test_two_tabs_see_the_same_and_do_not_undo_each_other_s_files(bench):
    one = bench()
    outlined(one)
    two = bench()
    start = bench.session.state.shot.parts[0].keys[0].outline
    moves = """async ([index, x, y]) => { for (let n = 1; n <= 20; n++) await tooncap.act("capture.drag_point",
        {part: "character", key: "rest", index, to: [x + n, y]}, {gesture: "tab" + index}); }"""
    far = len(start) // 2
    one.evaluate(f"void (window.going = ({moves})([0, {start[0][0]}, {start[0][1]}]))")
    two.evaluate(moves, [far, *start[far]])
    one.evaluate("window.going")
    points = kept(bench)
    assert abs(points[0][0] - start[0][0] - 20) < 1e-2 and abs(points[far][0] - start[far][0] - 20) < 1e-2
    for page in (one, two):
        wait(page, f"Math.abs(tooncap.state.capture.parts[0].keys[0].outline[0][0] - {points[0][0]}) < 1e-6")


def test_a_drag_is_answered_and_drawn_within_33_ms(bench, record_property, slow):
    page = bench()
    outlined(page)
    page.keyboard.press("v")
    page.wait_for_timeout(300)
    taken = np.array(page.evaluate(DRAG))
    record_property("workbench.drag_ms", float(np.median(taken)))
    print(f"workbench.drag_ms: median {np.median(taken):.1f}, 95 % {np.percentile(taken, 95):.1f}")
    assert np.median(taken) <= 33 * slow


def test_scrubbing_shows_24_frames_a_second(bench, slow):
    """Of a clip that is not here yet: each frame is decoded, packed, sent and unpacked once."""
    write_clip(bench.folder / "long.mp4", _textures(90), 24)
    page = bench()
    page.evaluate("tooncap.act('folder.open', {file: 'long.mp4'})")
    wait(page, "tooncap.state.capture.clip.frames === 90")
    rate = page.evaluate(SCRUB, 90)
    print(f"workbench.scrub_fps: {rate:.0f}")
    assert rate >= 24 / slow


def test_keys_play_step_and_stop(bench):
    page = bench()
    frame = "document.querySelector('canvas.strip').time.frame"
    for key, now in (("ArrowRight", 1), ("Shift+ArrowRight", 11), ("ArrowLeft", 10), ("End", 12), ("Home", 0)):
        page.keyboard.press(key)
        assert page.evaluate(frame) == now
    page.keyboard.press("Space")
    wait(page, f"{frame} > 2")
    page.keyboard.press("Space")
    assert not page.evaluate("document.querySelector('canvas.strip').time.playing")


def test_every_control_has_a_name_and_text_stands_out(bench):
    page = bench()
    outlined(page)
    nameless = page.evaluate(
        """() => [...document.querySelectorAll("button, input, select, [role=slider]")].filter((element) =>
            !(element.textContent || element.title || element.getAttribute("aria-label") || element.closest("label")))
            .map((element) => element.outerHTML)"""
    )
    assert nameless == []
    contrasts = page.evaluate(
        """() => { const light = ([r, g, b]) => { const [R, G, B] = [r, g, b].map((v) => (v /= 255) <= 0.04045 ? v / 12.92
                : ((v + 0.055) / 1.055) ** 2.4); return 0.2126 * R + 0.7152 * G + 0.0722 * B; };
            const rgb = (text) => text.match(/[\\d.]+/g).map(Number);
            const ground = (element) => { for (let one = element; one; one = one.parentElement) {
                const color = rgb(getComputedStyle(one).backgroundColor); if (color.length < 4 || color[3] > 0.9) return color; }
                return [255, 255, 255]; };
            return [...document.querySelectorAll("button, p, h1, h2, span, small, b, output, strong")]
                .filter((element) => element.offsetParent && element.textContent && !element.disabled)
                .map((element) => { const [a, b] = [light(rgb(getComputedStyle(element).color)), light(ground(element))];
                    return [(Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), element.textContent]; }); }"""
    )
    assert len(contrasts) > 15 and min(contrasts)[0] >= 4.5, min(contrasts)


def test_nothing_needs_scrolling_on_a_small_screen(bench):
    page = bench()
    outlined(page)
    assert page.evaluate(
        "document.documentElement.scrollHeight <= innerHeight && document.documentElement.scrollWidth <= innerWidth"
    )
    for name in ("Find keys", "Capture"):
        box = page.get_by_role("button", name=name, exact=True).last.bounding_box()
        assert box["y"] + box["height"] < 720 - 148


def test_what_is_refused_is_said_on_the_page(bench):
    page = bench()
    page.keyboard.press("Enter")  # to capture, with nothing told
    page.wait_for_selector(".said:not([hidden])")
    assert "draw a box round it" in page.inner_text(".said")


def test_a_file_that_was_changed_outside_can_be_read_again(bench):
    page = bench()
    outlined(page)
    file = bench.folder / "hat.shot.toml"
    file.write_text(file.read_text().replace('name = "character"', 'name = "hat"'))
    page.evaluate("tooncap.act('capture.add_part', {name: 'ribbon', frame: 0})")
    page.get_by_role("button", name="Read it again").click()
    wait(page, "tooncap.state.capture.parts[0].name === 'hat' && tooncap.state.capture.parts.length === 1")


def test_an_empty_folder_says_what_to_do_first(flat_browser, tmp_path):
    serving = server.start(Session(tmp_path))
    page = flat_browser.new_page()
    page.goto(serving.address)
    page.get_by_role("button", name="Try it on the built-in frog").wait_for()
    page.get_by_role("button", name="Open a clip…").wait_for()
    assert "drop it here" in page.inner_text(".card")
    page.close()
    serving.stop()


def _textures(count):
    """Frames of something moving, 640 x 480, that fills the picture with detail."""
    y, x = np.mgrid[:480, :640]
    waves = [np.sin(0.11 * x + 0.07 * y), np.sin(0.05 * x - 0.13 * y), np.sin(0.02 * x * y / 99)]
    first = (127 + 120 * np.stack(waves, axis=-1)).astype(np.uint8)
    return [np.roll(first, (5 * t, 3 * t), axis=(0, 1)) for t in range(count)]
