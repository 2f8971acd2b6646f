"""Keys corrected by hand in a headless Chromium: a stroke is drawn, a joint dragged, the source laid over the result."""

import re
import time
from contextlib import contextmanager

import numpy as np
import pytest

from capture.motion import tracks
from capture.pictures.encode import write_clip
from capture.pictures.shot import write_shot
from fixtures import frog, walker, write
from retarget.workbench import pictures
from retarget.workbench.serving import server
from retarget.workbench.session import Session
from retarget.workbench.staging import redraw

VIEW = "document.querySelector('[aria-label=Stage] canvas.view').view"
COLOR = f"""([x, y]) => {{
    const [left, top] = {VIEW}.toScreen([x, y]).map(Math.round);
    const context = new OffscreenCanvas(1, 1).getContext("2d");
    context.drawImage({VIEW}.canvas, left, top, 1, 1, 0, 0, 1, 1);
    return [...context.getImageData(0, 0, 1, 1).data];
}}"""


@contextmanager
def opened(browser, folder, file):
    serving = server.start(Session(folder, file))
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    page, told = context.new_page(), []
    page.on("pageerror", lambda error: told.append(str(error)))
    page.on("console", lambda line: told.append(line.text) if line.type in ("error", "warning") else None)
    ours = re.compile(rf"(https?|ws)://127\.0\.0\.1:{serving.port}/|data:|blob:")
    page.on("request", lambda request: None if ours.match(request.url) else told.append(request.url))
    page.goto(serving.address)
    page.get_by_role("tab", name="Stage").click()
    page.session, page.folder = serving.session, folder
    yield page
    context.close()
    serving.stop()
    assert told == []


def bean(lean, tall):
    """A bean with a spot, a line for its mouth; leaning and as tall as told."""
    angle = np.linspace(0, 2 * np.pi, 13)[:-1]
    x = 100 + 50 * np.cos(angle) + lean * (1 - np.sin(angle)) ** 2
    y = 150 + 80 * tall * np.sin(angle)
    ring = " ".join(f"{a:.2f},{b:.2f}" for a, b in np.column_stack([x, y]))
    return f"""<svg xmlns="http://www.w3.org/2000/svg" width="220" height="260">
<path d="M{ring.split()[0]} C{" ".join(ring.split()[1:])} {ring.split()[0]} Z" fill="#c08050" stroke="#302018"/>
<path d="M85,150 L115,150 L115,170 L85,170 Z" fill="#f0e0c0"/></svg>"""


@pytest.fixture
def bench(flat_browser, tmp_path):
    """A page with a motion of four keys, a clip of plain frames that it is taken to be from, and a bean that plays it."""
    toon = frog.frog()
    motion = tracks.trim(write.motion_of(toon), 0, 37)  # to the last of its key frames
    tracks.save(motion, tmp_path / "frog.motion.json")
    width, height = motion.size
    frames = (np.full((height, width, 3), (40 + 2 * t, 90, 160), np.uint8) for t in range(len(motion.times)))
    write_clip(tmp_path / "frog.mp4", frames, motion.fps)
    write_shot(write.shot_of(toon, str(tmp_path / "frog.mp4")), tmp_path / "frog.shot.toml")
    for n, key in enumerate(motion.tracks[0].keys):
        (tmp_path / f"bean_{key}.svg").write_text(bean(5 * n, 1 - 0.1 * n), encoding="utf-8")
    with opened(flat_browser, tmp_path, "frog.motion.json") as page:
        page.locator(".choice", has_text="bean").locator("input").check()
        page.get_by_role("button", name="Let it play").click()
        wait(page, f"{VIEW}.frame === 0")
        yield page


def wait(page, expression, seconds=60):
    end = time.monotonic() + seconds
    while not page.evaluate(expression):
        assert time.monotonic() < end, expression
        page.wait_for_timeout(20)


def at(page, place):
    return page.evaluate(
        f"""([x, y]) => {{ const box = {VIEW}.canvas.getBoundingClientRect(), [left, top] = {VIEW}.toScreen([x, y]);
            return [box.left + left, box.top + top]; }}""",
        [float(value) for value in place],
    )


def drag(page, places):
    page.mouse.move(*at(page, places[0]))
    page.mouse.down()
    for place in places[1:]:
        page.mouse.move(*at(page, place))
    page.mouse.up()


def test_a_stroke_of_a_key_is_drawn_anew_seen_in_the_result_and_taken_back(bench):
    before = (bench.folder / "bean_crouch.svg").read_bytes()
    bench.locator("[aria-label=Stage] .keys .key", has_text="crouch").click()
    bench.get_by_role("button", name="Draw", exact=True).click()
    wait(bench, f"{VIEW}.picture.width === 220")
    strokes = redraw.lines_of(bench.folder / "bean_crouch.svg")
    body = strokes[0][0]
    line = body[len(body) // 8 : len(body) // 3]
    away = line - body.mean(axis=0)
    bump = line + 25 * np.sin(np.linspace(0, np.pi, len(line)))[:, None] * away / np.linalg.norm(away, axis=1)[:, None]
    bench.wait_for_timeout(200)
    drag(bench, bump[::2])
    wait(bench, "tooncap.state.stage.cast.parts[0].keys.some(({ file }) => file === 'bean_crouch.edit1.svg')")
    assert (bench.folder / "bean_crouch.svg").read_bytes() == before
    redrawn = redraw.lines_of(bench.folder / "bean_crouch.edit1.svg")
    moved = [n for n, (old, new) in enumerate(zip(strokes, redrawn, strict=True)) if np.abs(old[0] - new[0]).max() > 5]
    assert moved == [0]
    bench.keyboard.press("Escape")
    wait(bench, f"{VIEW}.number === tooncap.state.stage.number")  # it plays
    bench.keyboard.press("Control+z")
    wait(bench, "tooncap.state.stage.cast.parts[0].keys.every(({ file }) => !file.includes('edit'))")


def test_each_key_stands_beside_the_source_s(bench):
    pairs = "[...document.querySelectorAll('[aria-label=Stage] .pair')]"
    count = len(bench.session.state.motion.tracks[0].keys)
    wait(bench, f"{pairs}.length === {count} && {pairs}.every((one) => "
         "[...one.querySelectorAll('img')].filter(({ naturalWidth }) => naturalWidth > 20).length === 2)")  # fmt: skip


def test_the_source_is_laid_over_the_result_and_beside_it_and_the_result_stays_what_it_is(bench):
    clip = bench.session.state.shot
    bench.evaluate("document.querySelector('[aria-label=Stage] canvas.strip').time.go(30)")
    wait(bench, f"{VIEW}.frame === 30")
    source = pictures.frame(clip, 30)[20, 20].astype(float)
    result = np.array(bench.evaluate(COLOR, [20, 20])[:3], float)
    assert np.abs(source - result).max() > 10
    bench.keyboard.press("g")
    wait(bench, f"{VIEW}.canvas.scene.sourceFrame === 30")
    bench.wait_for_timeout(100)
    assert np.array(bench.evaluate(COLOR, [20, 20])[:3]) == pytest.approx((source + result) / 2, abs=4)
    bench.keyboard.press("g")
    bench.wait_for_timeout(200)
    width = bench.session.state.motion.size[0]
    assert bench.evaluate(f"{VIEW}.toScreen([-{width} - 10, 0])[0] > 0")  # all of it is in the window
    assert np.array(bench.evaluate(COLOR, [20, 20])[:3]) == pytest.approx(result, abs=1)
    assert np.array(bench.evaluate(COLOR, [20 - width - 12, 20])[:3]) == pytest.approx(source, abs=4)
    bench.keyboard.press("g")
    assert bench.get_by_role("button", name="Source: off").is_enabled()


def test_a_body_s_joint_is_dragged_and_taken_back(flat_browser, tmp_path):
    tracks.save(write.motion_of(walker.walker()), tmp_path / "walk.motion.json")
    (tmp_path / "bean.svg").write_text(bean(0, 1), encoding="utf-8")
    with opened(flat_browser, tmp_path, "walk.motion.json") as page:
        assert page.get_by_role("button", name="Source: off").is_disabled()  # the clip is not here
        page.locator(".choice", has_text="bean").locator("input").check()
        page.get_by_role("button", name="Let it play").click()
        page.locator("[aria-label=Stage] .keys .key", has_text="bean").click()
        page.get_by_role("button", name="Lines").wait_for()
        shown = page.evaluate(
            "tooncap.look('stage.body', { who: tooncap.state.stage.cast.bodies[0].drawing }).then(({ event }) => event)"
        )
        joints = {limb["part"]: np.array(limb["joint"]) for limb in shown["limbs"]}
        part = max(joints, key=lambda one: min(np.linalg.norm(joints[one] - joints[o]) for o in joints if o != one))
        drag(page, [joints[part], joints[part] + [6, 3], joints[part] + [12, 8]])
        wait(page, "tooncap.state.stage.cast.bodies[0].parts.length > 1")
        pivots = {limb.name: limb.pivot for limb in page.session.state.cast.bodies[0].parts}
        assert pivots.pop(part) == pytest.approx(joints[part] + [12, 8], abs=1)
        assert set(pivots.values()) == {None}
        page.keyboard.press("Control+z")
        wait(page, "tooncap.state.stage.cast.bodies[0].parts.length === 0")
