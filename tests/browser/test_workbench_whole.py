"""From nothing to a GIF of one's own clip, by the mouse alone: the clicks are counted, and what comes is looked at."""

import re
import time

import numpy as np
import pytest
from PIL import Image

from capture.motion import tracks
from capture.pictures.encode import write_clip
from fixtures import hat, write
from retarget.workbench.serving import server
from retarget.workbench.session import Session

SHOWN = (0, 2, 4, 6, 8, 10, 14, 18, 22, 26, 28, 30, 32)
FPS = 20  # a GIF counts in hundredths of a second: 5 of them a frame
COUNT = (
    "addEventListener('pointerdown', () => localStorage.setItem('n', Number(localStorage.getItem('n') ?? 0) + 1), true)"
)
IN_THE_DIALOG = 2  # the system's own window: a file, and "Open"


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    """Somebody's own clip, far from the folder that is worked in: a witch's hat, 640 x 480."""
    path = tmp_path_factory.mktemp("elsewhere") / "my hat.mp4"
    write_clip(path, [hat.hat().frame(t) for t in SHOWN], FPS)
    return path


@pytest.fixture
def page(flat_browser, tmp_path):
    """The page of a workbench in an empty folder, as `tooncap workbench` opens it there."""
    serving = server.start(Session(tmp_path))
    context = flat_browser.new_context(viewport={"width": 1280, "height": 720}, accept_downloads=True)
    context.add_init_script(COUNT)
    one, told = context.new_page(), []
    one.on("pageerror", lambda error: told.append(str(error)))
    one.on("console", lambda line: told.append(line.text) if line.type in ("error", "warning") else None)
    ours = re.compile(rf"(https?|ws)://127\.0\.0\.1:{serving.port}/|data:|blob:")
    one.on("request", lambda request: None if ours.match(request.url) else told.append(request.url))
    one.goto(serving.address)
    one.get_by_role("button", name="Open a clip…").wait_for()
    wait(one, "window.tooncap?.state.folder?.at !== undefined")
    one.session, one.folder = serving.session, tmp_path.resolve()
    yield one
    context.close()
    serving.stop()
    assert told == []


def wait(page, expression, seconds=90):
    end = time.monotonic() + seconds
    while not page.evaluate(expression):
        assert time.monotonic() < end, expression
        page.wait_for_timeout(30)


def clicks(page):
    return page.evaluate("Number(localStorage.getItem('n') ?? 0)")


def chosen(page, clip):
    with page.expect_file_chooser() as choosing:
        page.get_by_role("button", name="Open a clip…").click()
    choosing.value.set_files(clip)
    wait(page, "document.querySelector('canvas.view').view.frame === 0")


def dropped(page, *files):
    """Files let go over the page, as the browser tells of them."""
    import base64

    told = [[file.name, base64.b64encode(file.read_bytes()).decode()] for file in files]
    page.evaluate(
        """files => { const data = new DataTransfer();
            for (const [name, text] of files) data.items.add(new File([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))], name));
            const over = document.querySelector(".tooncap .room");
            for (const kind of ["dragenter", "dragover", "drop"])
                over.dispatchEvent(new DragEvent(kind, { bubbles: true, cancelable: true, dataTransfer: data })); }""",
        told,
    )


def boxed(page):
    points = hat.hat().parts[0].points[SHOWN[0]]
    corners = page.evaluate(
        """corners => { const { view } = document.querySelector("canvas.view"), box = view.canvas.getBoundingClientRect();
            return corners.map((at) => { const [x, y] = view.toScreen(at); return [box.left + x, box.top + y]; }); }""",
        [(points.min(axis=0) - 8).tolist(), (points.max(axis=0) + 8).tolist()],
    )
    page.mouse.move(*corners[0])
    page.mouse.down()
    page.mouse.move(*corners[1], steps=5)
    page.mouse.up()
    wait(page, "tooncap.state.capture.parts[0].box !== null")


def pressed(page, name):
    """A click on the button, and all the work that comes of it."""
    page.get_by_role("button", name=name, exact=True).locator("visible=true").first.click()
    wait(page, "tooncap.running !== ''")
    wait(page, "tooncap.running === ''")


def test_one_s_own_clip_becomes_a_gif_in_under_ten_clicks(page, clip):
    chosen(page, clip)
    boxed(page)
    pressed(page, "Find keys")
    pressed(page, "Capture")
    assert "next" in page.get_by_role("tab", name="Stage").get_attribute("class")
    page.get_by_role("tab", name="Stage").click()
    page.locator(".offer button.primary").click()  # the first offer: nobody has these keys, so they are proposed
    wait(page, "tooncap.state.stage.cast !== null && tooncap.running === ''")
    pressed(page, "Export")
    assert clicks(page) + IN_THE_DIALOG == 9

    made = page.locator(".made")
    path = page.folder / "my hat.retarget.gif"
    assert str(path) in made.inner_text() and "13 frames at 20 a second" in made.inner_text()
    assert re.search(r"captured to within [\d.]+ px", made.inner_text())
    looked_at(path)

    page.get_by_role("button", name="Look at it").click()
    wait(page, "document.querySelector('dialog.shown img')?.naturalWidth === 640")
    with page.expect_download() as saving:
        page.locator("dialog.shown").get_by_role("button", name="Save a copy…").click()
    assert saving.value.suggested_filename == path.name
    saved = page.folder / "saved"
    saving.value.save_as(saved)
    assert saved.read_bytes() == path.read_bytes()
    page.keyboard.press("Escape")
    page.wait_for_selector("dialog.shown", state="detached")
    page.reload()
    page.get_by_role("tab", name="Stage").click()
    assert str(path) in page.locator(".made").inner_text()


def looked_at(path):
    """A GIF with the clip's frames and timing, in which somebody moves as the hat did."""
    with Image.open(path) as gif:
        assert (gif.n_frames, gif.size) == (len(SHOWN), (640, 480))
        frames, lasting = [], []
        for n in range(gif.n_frames):
            gif.seek(n)
            lasting.append(gif.info["duration"])
            frames.append(np.asarray(gif.convert("RGBA")).astype(float))
    assert lasting == [1000 / FPS] * len(SHOWN)
    places, colours = [], set()
    for picture in frames:
        inked = (picture[..., 3] > 128) & (picture[..., :3].min(axis=-1) < 235)
        assert 2000 < inked.sum() < 0.5 * inked.size
        places.append(np.argwhere(inked).mean(axis=0)[::-1])
        colours |= set(map(tuple, picture[inked][::50, :3].astype(int)))
    assert len(colours) > 5
    truth = np.array([hat.hat().parts[0].points[t].mean(axis=0) for t in SHOWN])
    moved = np.array(places) - places[0]
    assert np.ptp(truth, axis=0).max() > 50  # or there was nothing to follow
    assert np.corrcoef(moved[:, 1], truth[:, 1])[0, 1] > 0.8, np.column_stack([moved, truth])


def test_a_clip_that_is_dropped_on_the_page_is_opened_and_the_folder_has_it(page, clip):
    dropped(page, clip)
    wait(page, "window.tooncap.state.folder.at.open === 'my hat'")
    assert (page.folder / clip.name).read_bytes() == clip.read_bytes()
    page.get_by_role("button", name="Open…").click()
    page.get_by_role("button", name="my hat.mp4").click()
    wait(page, "window.tooncap.state.folder.at.open === 'my hat'")


def test_what_is_no_clip_is_refused_on_the_page_and_leaves_nothing(page, tmp_path_factory):
    broken = tmp_path_factory.mktemp("broken") / "broken.mp4"
    broken.write_bytes(b"no video" * 200_000)
    dropped(page, broken)
    page.wait_for_selector(".said:not([hidden])")
    assert "broken.mp4" in page.inner_text(".said")
    wait(page, "document.querySelector('.arriving').hidden")
    assert list(page.folder.iterdir()) == [] and page.evaluate("tooncap.state.folder.at.open") == ""


def test_a_single_picture_is_asked_how_large_its_drawings_are(page, tmp_path_factory):
    import cv2

    sheet = np.zeros((60, 160, 4), np.uint8)
    for n in range(8):
        y, x = divmod(n, 4)
        sheet[30 * y + 4 : 30 * y + 22 + n, 40 * x + 6 : 40 * x + 30] = (200, 90, 40, 255)
    picture = tmp_path_factory.mktemp("sheet") / "run.png"
    cv2.imwrite(str(picture), sheet)
    dropped(page, picture)
    across = page.get_by_label("Width of a drawing")
    across.wait_for()
    assert (across.input_value(), page.get_by_label("Height of a drawing").input_value()) == ("40", "30")
    page.get_by_role("button", name="Open the sheet").click()
    wait(page, "tooncap.state.capture.clip?.frames === 8")


def test_a_drawing_that_is_dropped_on_the_stage_is_ticked_and_its_keys_can_be_proposed(page):
    tracks.save(write.motion_of(hat.hat()), page.folder / "hop.motion.json")
    page.reload()
    page.get_by_role("button", name="hop.motion.json").click()
    page.locator(".offer", has_text="witch hat").wait_for()
    assert page.locator(".offer").first.inner_text().startswith("witch hat")  # it has the hat's keys
    dropped(page, write.CHARACTERS / "bottle.svg")
    page.get_by_role("checkbox", name="bottle.svg", checked=True).wait_for()
    assert (page.folder / "bottle.svg").read_bytes() == (write.CHARACTERS / "bottle.svg").read_bytes()
    assert "primary" in page.get_by_role("button", name="Propose keys").get_attribute("class")
    assert page.locator(".offer .small").first.evaluate("image => image.decode().then(() => image.naturalWidth)") > 20


def test_files_in_folders_below_are_listed_by_folder_and_opened(page, clip):
    below = page.folder / "takes" / "one"
    below.mkdir(parents=True)
    (below / "hat.mp4").write_bytes(clip.read_bytes())
    page.reload()
    page.get_by_role("heading", name=f"{page.folder.name} / takes / one").wait_for()
    page.get_by_role("button", name="hat.mp4").click()
    wait(page, "window.tooncap.state.folder.at.open === 'takes/one/hat'")
