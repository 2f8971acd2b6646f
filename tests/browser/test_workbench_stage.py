"""The stage desk in a headless Chromium, as a person uses it: a drawing is chosen, seen, pinned, pulled and exported."""

import re
import shutil
import time

import numpy as np
import pytest

from capture.motion import tracks
from capture.pictures.decode import read_clip
from fixtures import frog, write
from retarget.workbench.serving import server
from retarget.workbench.session import Session
from retarget.workbench.staging import playing

FRAMES = 36
STAGE = "document.querySelector('[aria-label=Stage]')"
VIEW = f"{STAGE}.querySelector('canvas.view').view"
SCRUB = """async (count) => {
    const place = document.querySelector("[aria-label=Stage]"), time = place.querySelector("canvas.strip").time;
    const view = place.querySelector("canvas.view").view;
    const began = performance.now();
    for (let frame = 1; frame <= count; frame++) {
        time.go(frame);
        while (view.frame !== frame) await new Promise(requestAnimationFrame);
    }
    return count / ((performance.now() - began) / 1000);
}"""
SEEN = """async () => {
    const bitmap = document.querySelector("[aria-label=Stage] canvas.view").view.picture;
    const canvas = new OffscreenCanvas(bitmap.width, bitmap.height), context = canvas.getContext("2d");
    context.drawImage(bitmap, 0, 0);
    return [...context.getImageData(0, 0, bitmap.width, bitmap.height).data];
}"""


@pytest.fixture(scope="module")
def hop():
    """The frog's first hop: the page draws ahead what nobody has asked for yet, so every frame is paid for."""
    return tracks.trim(write.motion_of(frog.frog()), 0, FRAMES)


@pytest.fixture
def bench(flat_browser, hop, tmp_path):
    """A page of a workbench in a folder with the frog's motion and the bunny's drawings."""
    folder = tmp_path / "work"
    folder.mkdir()
    tracks.save(hop, folder / "hop.motion.json")
    for file in write.CHARACTERS.glob("bunny_*.svg"):
        shutil.copy(file, folder)
    serving = server.start(Session(folder, "hop.motion.json"))
    context = flat_browser.new_context(viewport={"width": 1280, "height": 720})
    page, told = context.new_page(), []
    page.on("pageerror", lambda error: told.append(str(error)))
    page.on("console", lambda line: told.append(line.text) if line.type in ("error", "warning") else None)
    ours = re.compile(rf"(https?|ws)://127\.0\.0\.1:{serving.port}/|data:|blob:")
    page.on("request", lambda request: None if ours.match(request.url) else told.append(request.url))
    page.goto(serving.address)
    page.wait_for_selector(".choices")
    page.session, page.folder = serving.session, folder
    yield page
    context.close()
    serving.stop()
    assert told == []


def wait(page, expression, seconds=40):
    end = time.monotonic() + seconds
    while not page.evaluate(expression):
        assert time.monotonic() < end, expression
        page.wait_for_timeout(20)


def at(page, x, y):
    """Where a pixel of the picture is on the page."""
    return page.evaluate(
        """([x, y]) => { const canvas = document.querySelector("[aria-label=Stage] canvas.view");
            const box = canvas.getBoundingClientRect(), [left, top] = canvas.view.toScreen([x, y]);
            return [box.left + left, box.top + top]; }""",
        [float(x), float(y)],
    )


def seen(page):
    size = page.evaluate(f"[{VIEW}.picture.height, {VIEW}.picture.width]")
    return np.array(page.evaluate(SEEN), np.uint8).reshape(*size, 4)[..., :3]


def played(page):
    page.locator(".choice", has_text="bunny").locator("input").check()
    page.get_by_role("button", name="Let it play").click()
    wait(page, f"{VIEW}.frame === 0")


def go(page, frame):
    page.evaluate(f"{STAGE}.querySelector('canvas.strip').time.go({frame})")
    wait(page, f"{VIEW}.frame === {frame} && {VIEW}.number === tooncap.state.stage.number")


def test_a_drawing_is_picked_seen_and_exported_and_the_file_is_what_was_seen(bench):
    played(bench)
    go(bench, 30)
    shown = seen(bench)
    bench.get_by_label("Export as").select_option("/")
    bench.get_by_role("button", name="Export", exact=True).click()
    bench.wait_for_selector("[aria-label=Stage] .result", timeout=90_000)
    assert "hop-frames" in bench.inner_text("[aria-label=Stage] .result")
    made = read_clip(bench.folder / "hop-frames")
    assert len(made) == FRAMES
    alpha = made[30][..., 3:] / 255.0
    assert np.abs(made[30][..., :3] * alpha + 255 * (1 - alpha) - shown).max() <= 1.0


def test_a_gif_comes_of_a_motion_in_four_clicks(bench):
    played(bench)  # two
    bench.get_by_label("Export as").select_option(".gif")
    bench.get_by_role("button", name="Export", exact=True).click()
    bench.wait_for_selector("[aria-label=Stage] .result", timeout=90_000)
    assert len(read_clip(bench.folder / "hop.retarget.gif")) == FRAMES


def test_a_pin_is_put_where_one_clicks_and_holds(bench):
    played(bench)
    go(bench, 28)
    role = playing.play(bench.session.state.motion, bench.session.state.cast).performance.roles[0]
    place = role.mesh()[28][role.target.keys.faces].mean(axis=1)[40]
    bench.keyboard.press("p")
    bench.mouse.click(*at(bench, *place))
    wait(bench, "tooncap.state.stage.cast.keep.length === 1")
    (keep,) = bench.session.state.cast.keep
    assert keep.frames[0] == 28 and np.allclose(keep.at, place, atol=1.5)
    bench.keyboard.press("Control+z")
    wait(bench, "tooncap.state.stage.cast.keep.length === 0")


def test_a_key_is_pulled_into_shape_and_the_drawing_that_came_is_kept(bench):
    played(bench)
    before = (bench.folder / "bunny_crouch.svg").read_bytes()
    bench.locator(".keys .key", has_text="crouch").click()
    wait(bench, f"{VIEW}.picture.width !== tooncap.state.stage.motion.width")
    size = bench.evaluate(f"{VIEW}.size")
    bench.mouse.move(*at(bench, size[0] / 2, size[1] / 2))
    bench.mouse.down()
    bench.mouse.move(*at(bench, size[0] / 2, size[1] / 2 - 30), steps=4)
    bench.mouse.up()
    wait(bench, "tooncap.state.stage.cast.parts[0].keys.some(({ file }) => file === 'bunny_crouch.edit1.svg')")
    assert (bench.folder / "bunny_crouch.svg").read_bytes() == before
    assert (bench.folder / "bunny_crouch.edit1.svg").exists()


def test_a_drawing_from_elsewhere_is_loaded_into_the_folder(bench):
    other = write.CHARACTERS / "pumpkin.svg"
    bench.locator("input[type=file]").set_input_files(other)
    bench.wait_for_selector(".choice >> text=pumpkin.svg")
    assert (bench.folder / "pumpkin.svg").read_bytes() == other.read_bytes()


def test_scrubbing_a_performance_that_nobody_has_seen_yet_goes_at_24_frames_a_second(bench, slow):
    played(bench)
    rates = []
    for height in (0.9, 1.1):  # another performance each time: no frame of it is drawn yet
        bench.evaluate(f"tooncap.act('stage.stand', {{ who: 'frog', height: {height} }})")
        go(bench, 0)
        rates.append(bench.evaluate(SCRUB, FRAMES - 1))
    assert max(rates) >= 24 / slow


def test_what_was_done_is_there_again_after_a_reload(bench):
    played(bench)
    bench.get_by_label("Background").fill("#336699")
    bench.get_by_label("Background").press("Enter")
    wait(bench, "tooncap.state.stage.cast.background === '#336699'")
    bench.reload()
    bench.wait_for_selector(".choices")
    wait(bench, f"{VIEW}.frame === 0")
    assert (seen(bench)[5, 5] == [0x33, 0x66, 0x99]).all()
