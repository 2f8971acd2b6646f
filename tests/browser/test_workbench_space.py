"""Models on the stage drawn by the page's card: where they are, how they look, how quickly, and what if there is none."""

import base64
import re
import time
from contextlib import contextmanager
from dataclasses import replace
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from capture.motion import tracks
from fixtures import frog, walker, write
from retarget.stage import draw2d
from retarget.workbench.serving import server
from retarget.workbench.session import Session
from retarget.workbench.staging import solids
from retarget.workbench.staging.orbit import turned
from retarget.workbench.staging.staged import played_of

FRAMES = 36
VIEW = "document.querySelector('[aria-label=Stage] canvas.view')"
DRAWN = f"""async ([t, turn, tilt]) => {{
    const view = {VIEW}.view, orbit = {VIEW}.scene.orbit, [width, height] = view.size;
    Object.assign(view, {{ scale: 1, x: 8, y: 4 }});
    Object.assign(orbit, {{ turn, tilt, shift: [0, 0], scenery: false }});
    while (!orbit.draw(t) || orbit.frame !== t) await new Promise((went) => setTimeout(went, 20));
    const copy = Object.assign(document.createElement("canvas"), {{ width, height }});
    copy.getContext("2d").drawImage(orbit.canvas, -8, -4);
    return copy.toDataURL();
}}"""
POINTS = f"""async ([who, t]) => {{
    const {{ space, last }} = {VIEW}.scene.orbit;
    let points = null;
    while (!(points = space.shown && space.points(who, t, last))) await new Promise((went) => setTimeout(went, 20));
    return [...points];
}}"""
DRAWS = f"""async () => {{
    const orbit = {VIEW}.scene.orbit, gl = orbit.canvas.getContext("webgl2"), pixel = new Uint8Array(4), times = [];
    for (let n = 0; n < 60; n++) {{
        const began = performance.now();
        orbit.turn = 0.3 + n / 40;
        orbit.draw(orbit.frame);
        gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel); // until it is drawn indeed
        times.push(performance.now() - began);
    }}
    return times.sort((a, b) => a - b)[30] / 1000;
}}"""


HEAD = """<svg xmlns="http://www.w3.org/2000/svg" width="80" height="100">
<path d="M40 5 L75 50 L40 95 L5 50 Z" fill="#3070c0" stroke="#102030" stroke-width="4"/></svg>"""


def model(folder):
    """An OBJ with a textured vase, round but with a rim, on a plain box, whose edges are hard."""
    lines, around, rows = ["mtllib model.mtl"], 40, 24
    for v in np.linspace(0, 1, rows):
        for u in np.linspace(0, 2 * np.pi, around + 1):
            r = 0.5 + 0.2 * np.sin(5 * v) + 0.05 * np.cos(3 * u)
            lines += [f"v {r * np.sin(u):.6f} {2 * v + 0.4:.6f} {r * np.cos(u):.6f}", f"vt {u / np.pi:.6f} {v:.6f}"]
    lines.append("usemtl painted")
    for row in range(rows - 1):
        for k in range(around):
            a, b = row * (around + 1) + k + 1, (row + 1) * (around + 1) + k + 1
            lines.append(f"f {a}/{a} {a + 1}/{a + 1} {b + 1}/{b + 1} {b}/{b}")
    box = len([line for line in lines if line.startswith("v ")])
    lines += [f"v {x} {y} {z}" for x in (-0.8, 0.8) for y in (0, 0.4) for z in (-0.8, 0.8)]
    lines.append("usemtl plain")
    for face in ((1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)):
        lines.append("f " + " ".join(str(box + corner) for corner in face))
    (folder / "model.obj").write_text("\n".join(lines), encoding="utf-8")
    (folder / "model.mtl").write_text(
        "newmtl painted\nKd 1 1 1\nmap_Kd paint.png\nnewmtl plain\nKd 0.9 0.5 0.2\n", encoding="utf-8"
    )
    y, x = np.mgrid[:64, :64]
    picture = np.stack([4 * x, 4 * y, 128 + 60 * np.sin(x / 4)], axis=-1).astype(np.uint8)
    cv2.imwrite(str(folder / "paint.png"), picture)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A hop, a model that plays it, and the same seen with perspective."""
    made = tmp_path_factory.mktemp("space")
    model(made)
    hop = tracks.trim(write.motion_of(frog.frog()), 0, FRAMES)
    tracks.save(hop, made / "hop.motion.json")
    tracks.save(hop, made / "near.motion.json")
    part = '[[parts]]\nname = "frog"\ndrawing = "model.obj"\ncarried = true\nplane = [0.5, 0.3, 1.0]\n'
    (made / "hop.cast.toml").write_text(part, encoding="utf-8")
    (made / "near.cast.toml").write_text(f"{part}distance = 1.5\n", encoding="utf-8")
    tracks.save(write.motion_of(walker.walker()), made / "mixed.motion.json")
    glass = (made / "model.mtl").read_text(encoding="utf-8") + "d 0.7\n"  # the box, in which the vase stands
    (made / "glass.mtl").write_text(glass, encoding="utf-8")
    solid = (made / "model.obj").read_text(encoding="utf-8").replace("model.mtl", "glass.mtl")
    (made / "glass.obj").write_text(solid, encoding="utf-8")
    (made / "head.svg").write_text(HEAD, encoding="utf-8")
    parts = '[[parts]]\nname = "torso"\ndrawing = "glass.obj"\ncarried = true\nplane = [0.5, 0.6, 1.0]\n'
    parts += '[[parts]]\nname = "head"\ndrawing = "head.svg"\n[[parts]]\nname = "far arm"\ndrawing = "head.svg"\n'
    (made / "mixed.cast.toml").write_text(parts, encoding="utf-8")
    return made


@pytest.fixture(scope="module")
def opened(browser, folder):
    with _page(browser, folder) as page:
        yield page


@contextmanager
def _page(browser, folder):
    serving = server.start(Session(folder, "hop.motion.json"))
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    page, told = context.new_page(), []
    page.on("pageerror", lambda error: told.append(str(error)))
    ours = re.compile(rf"(https?|ws)://127\.0\.0\.1:{serving.port}/|data:|blob:")
    page.on("request", lambda request: None if ours.match(request.url) else told.append(request.url))
    page.goto(serving.address)
    wait(page, f"{VIEW}?.view.frame === 0")
    yield SimpleNamespace(page=page, session=serving.session)
    context.close()
    serving.stop()
    assert told == []


def wait(page, expression, seconds=60):
    end = time.monotonic() + seconds
    while not page.evaluate(expression):
        assert time.monotonic() < end, expression
        page.wait_for_timeout(20)


def by_card(opened, t, turn=0.0, tilt=0.0):
    url = opened.page.evaluate(DRAWN, [t, turn, tilt])
    return cv2.imdecode(np.frombuffer(base64.b64decode(url.split(",")[1]), np.uint8), cv2.IMREAD_UNCHANGED)[
        ..., [2, 1, 0, 3]
    ]


def by_processor(performance, t, turn=0.0, tilt=0.0):
    """The exported picture of models turned about the middle of the stage."""
    middle = np.array([*(np.array(performance.size) - 1) / 2, 0])
    rotation = turned(turn, tilt)
    roles = [
        replace(role, points=(role.points - middle) @ rotation.T + middle) if solids.is_solid(role) else role
        for role in performance.roles
    ]
    return draw2d.draw(replace(performance, roles=tuple(roles)), t)


def alike(ours, theirs):
    """How well two pictures' silhouettes agree, and how far apart their colours are where both have some."""
    a, b = ours[..., 3] > 127, theirs[..., 3] > 127
    both = a & b
    apart = np.abs(ours[both][:, :3].astype(float) - theirs[both][:, :3]).mean()
    return both.sum() / (a | b).sum(), apart


@pytest.mark.parametrize("t", [0, 33])
@pytest.mark.parametrize(("turn", "tilt"), [(0.0, 0.0), (0.9, 0.3), (2.8, -0.5)])
def test_a_model_looks_as_it_does_when_it_is_exported_from_every_side(opened, t, turn, tilt):
    performance = played_of(opened.session.state).performance
    agree, apart = alike(by_card(opened, t, turn, tilt), by_processor(performance, t, turn, tilt))
    assert agree > 0.98 and apart < 3, (agree, apart)


def test_with_perspective_too(opened):
    with showing(opened, "near"):
        performance = played_of(opened.session.state).performance
        for turn, tilt in ((0.0, 0.0), (-0.7, 0.2)):
            ours = by_card(opened, 20, turn, tilt)
            agree, apart = alike(ours, by_processor(performance, 20, turn, tilt))
            assert agree > 0.98 and apart < 3, (agree, apart)
        away = tuple(replace(role, target=replace(role.target, distance=None)) for role in performance.roles)
        from_away = by_processor(replace(performance, roles=away), 20)
        assert alike(by_card(opened, 20), from_away)[0] < 0.97  # so it can be told from what has no perspective


def test_drawings_lie_before_and_behind_the_model_and_what_is_clear_shows_them(opened):
    with showing(opened, "mixed"):
        performance = played_of(opened.session.state).performance
        ours, theirs = by_card(opened, 9), by_processor(performance, 9)
        agree, apart = alike(ours, theirs)
        assert agree > 0.98 and apart < 1.5, (agree, apart)
        assert ((theirs[..., 3] > 150) & (theirs[..., 3] < 220)).sum() > 500  # some of it is clear
        assert np.abs(ours[..., 3].astype(float) - theirs[..., 3]).mean() < 0.5
        from_behind = by_card(opened, 9, np.pi)[:, ::-1]
        changed = np.abs(from_behind.astype(float) - ours).max(axis=2) > 60
        assert changed.sum() > 500  # there the far arm is the nearest


@contextmanager
def showing(opened, name):
    """Another motion open for a while."""
    for open_now in (name, "hop"):
        opened.page.evaluate(f"tooncap.act('folder.open', {{ file: '{open_now}.motion.json' }})")
        here = f"{VIEW}.scene.orbit.space.shown === tooncap.state.stage.number"
        wait(opened.page, f"tooncap.state.folder.at.open === '{open_now}' && {here}")
        if open_now == name:
            yield


def test_points_in_the_page_are_those_of_the_performance(opened):
    role = played_of(opened.session.state).performance.roles[0]
    point = solids.corners(role.target.surface).point
    for t in (0, 33, FRAMES - 1):
        points = np.array(opened.page.evaluate(POINTS, [0, t])).reshape(-1, 3)
        assert (points == role.mesh()[t][point].astype(np.float32)).all()


def test_a_model_is_turned_30_times_a_second(opened, slow):
    opened.page.evaluate(DRAWN, [0, 0.3, 0.1])
    opened.page.evaluate(f"{VIEW}.scene.orbit.scenery = true")
    assert min(opened.page.evaluate(DRAWS) for _ in range(3)) <= slow / 30
    opened.page.evaluate(f"{VIEW}.scene.home(), {VIEW}.view.fit()")


def test_a_drag_turns_the_model_about_where_it_is_and_a_double_click_brings_it_back(opened):
    page = opened.page
    orbit = f"{VIEW}.scene.orbit"
    role = played_of(opened.session.state).performance.roles[0]
    t = page.evaluate("document.querySelector('[aria-label=Stage] canvas.strip').time.frame")
    page.evaluate(DRAWN, [t, 0.2, 0])  # its points are here
    page.evaluate(f"{VIEW}.scene.home(), {orbit}.scenery = true, {VIEW}.view.fit()")
    middle = ((role.mesh()[t].min(axis=0) + role.mesh()[t].max(axis=0)) / 2).tolist()
    box = page.locator("[aria-label=Stage] canvas.view").bounding_box()
    page.mouse.move(box["x"] + 400, box["y"] + 200)
    page.mouse.down()
    page.mouse.move(box["x"] + 520, box["y"] + 230, steps=4)
    page.mouse.up()
    assert page.evaluate(f"{orbit}.turn") == pytest.approx(120 / 115, abs=0.02)
    assert page.evaluate(f"{orbit}.place({middle})")[:2] == pytest.approx(middle[:2], abs=0.5)
    page.mouse.dblclick(box["x"] + 400, box["y"] + 200)
    assert page.evaluate(f"[{orbit}.turn, {orbit}.tilt, ...{orbit}.shift]") == [0, 0, 0, 0]


def test_where_the_card_is_lost_python_draws_and_the_card_is_taken_again_when_it_is_back(opened):
    page = opened.page
    orbit = f"{VIEW}.scene.orbit"
    page.evaluate(DRAWN, [5, 0.5, 0.1])
    lost = "getContext('webgl2').getExtension('WEBGL_lose_context')"
    page.evaluate(f"(window.lost = {orbit}.canvas.{lost}).loseContext()")
    wait(page, f"!{orbit}.works")
    page.evaluate(f"window.before = {VIEW}.view.picture, Object.assign({orbit}, {{ turn: 0.5 }}), {VIEW}.scene.show(7)")
    wait(page, f"{VIEW}.view.picture !== window.before")
    page.evaluate("window.lost.restoreContext()")
    wait(page, f"{orbit}.works")
    assert (by_card(opened, 5, 0.5, 0.1)[..., 3] > 127).sum() > 1000
    page.evaluate(f"{VIEW}.scene.home(), {VIEW}.view.fit()")


def test_where_there_is_no_card_at_all_a_turned_model_is_seen_all_the_same(launch, folder):
    without = launch("--disable-gpu", "--disable-3d-apis")
    with _page(without, folder) as opened:
        page = opened.page
        box = page.locator("[aria-label=Stage] canvas.view").bounding_box()
        page.evaluate(f"window.before = {VIEW}.view.picture")
        page.mouse.move(box["x"] + 400, box["y"] + 200)
        page.mouse.down()
        page.mouse.move(box["x"] + 480, box["y"] + 200, steps=3)
        page.mouse.up()
        wait(page, f"!{VIEW}.scene.orbit.works && {VIEW}.view.picture !== window.before")
    without.close()
