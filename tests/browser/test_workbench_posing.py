"""The posing desk in a headless Chromium: a joint is dragged and the pose follows, quickly; postures dance; rubber moves."""

import time

import numpy as np
import pytest

from fixtures import skeletons
from mocap.skeletons.bvh import read_bvh, write_bvh
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion
from retarget.workbench import server
from retarget.workbench.session import Session

DRAG = """async (name) => {
    const canvas = document.querySelector("[aria-label=Pose] canvas.view"), sticks = canvas.sticks;
    const joint = tooncap.state.posing.figure.names.indexOf(name), box = canvas.getBoundingClientRect();
    const point = (kind, x, y) => canvas.dispatchEvent(new PointerEvent(kind, { bubbles: true, button: 0, pointerId: 1,
        clientX: box.left + x, clientY: box.top + y }));
    canvas.setPointerCapture = () => {};
    let told = () => {};
    tooncap.on("state", () => told());
    const [x, y] = sticks.seen(tooncap.state.posing.pose[joint]), taken = [];
    point("pointerdown", x, y);
    for (let n = 1; n <= 60; n++) {
        const began = performance.now();
        const answered = new Promise((resolve) => { told = resolve; });
        point("pointermove", x - n / 2, y - n);
        await answered;
        await new Promise((resolve) => { sticks.drawn = resolve; sticks.draw(); });
        taken.push(performance.now() - began);
    }
    sticks.drawn = undefined;
    point("pointerup", x - 30, y - 60);
    return taken;
}"""
SPOT = """(name) => {
    const canvas = document.querySelector("[aria-label=Pose] canvas.view"), box = canvas.getBoundingClientRect();
    const joint = tooncap.state.posing.figure.names.indexOf(name);
    const [x, y] = canvas.sticks.seen(tooncap.state.posing.pose[joint]);
    return [box.left + x, box.top + y];
}"""


@pytest.fixture
def bench(browser, tmp_path):
    """A page of a workbench on a kick from formulas, as a BVH file."""
    figure = skeletons.kick(1.5, 30.0)
    skeleton = Skeleton(figure.names, figure.parents, np.array(figure.offsets, float))
    write_bvh(SkeletonMotion(skeleton, figure.translation, figure.rotation, 30.0), tmp_path / "kick.bvh")
    serving = server.start(Session(tmp_path))
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    page, told = context.new_page(), []
    page.on("pageerror", lambda error: told.append(str(error)))
    page.on("console", lambda line: told.append(line.text) if line.type in ("error", "warning") else None)
    page.goto(serving.address)
    page.get_by_text("kick.bvh").click()
    page.wait_for_selector(".postures")
    page.session, page.folder = serving.session, tmp_path
    yield page
    context.close()
    serving.stop()
    assert told == []


def wait(page, expression, seconds=30):
    end = time.monotonic() + seconds
    while not page.evaluate(expression):
        assert time.monotonic() < end, expression
        page.wait_for_timeout(20)


def places(page):
    return page.session.state.figure.pose.positions


def dragged(page, name, right, down):
    x, y = page.evaluate(SPOT, name)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + right, y + down, steps=6)
    page.mouse.up()


def test_a_joint_is_dragged_the_pose_follows_a_pinned_foot_stays_and_undo_brings_it_back(bench):
    names = bench.session.state.figure.skeleton.names
    before = places(bench)
    bench.mouse.move(*bench.evaluate(SPOT, "LeftFoot"))
    bench.keyboard.press("p")
    wait(bench, "tooncap.state.posing.pinned.length === 1")
    dragged(bench, "RightHand", -40, -90)
    wait(bench, "tooncap.undo === 'drag a joint'")
    bench.wait_for_timeout(200)
    after = places(bench)
    moved = dict(zip(names, np.linalg.norm(after - before, axis=1), strict=True))
    assert moved["RightHand"] > 0.15 and moved["RightForeArm"] > 0.03 and moved["LeftFoot"] < 1e-6
    bench.keyboard.press("Control+z")
    wait(bench, "tooncap.undo !== 'drag a joint'")
    assert (places(bench) == before).all()
    bench.reload()
    bench.wait_for_selector(".postures")
    assert bench.evaluate("tooncap.state.posing.pinned.length") == 1


def test_a_drag_is_drawn_within_a_thirtieth_of_a_second(bench, slow):
    dragged(bench, "RightHand", -10, -10)  # the springs' machine code is made when they are first needed
    bench.wait_for_timeout(500)
    wait(bench, "tooncap.undo === 'drag a joint'", seconds=60)
    taken = min((bench.evaluate(DRAG, "LeftHand") for _ in range(2)), key=np.median)
    assert np.median(taken) <= 33 * slow


def test_a_posture_is_mixed_kept_put_on_a_beat_and_danced(bench):
    slider = bench.get_by_label("arms up")
    slider.focus()
    for _ in range(4):
        bench.keyboard.press("ArrowRight")
    wait(bench, "Math.abs(tooncap.state.posing.extents['arms up'] - 0.2) < 1e-9")
    bench.get_by_label("Name of the posture").fill("hello")
    bench.get_by_role("button", name="Keep pose").click()
    wait(bench, "tooncap.state.posing.pool.includes('hello')")
    bench.get_by_role("button", name="Dance", exact=True).click()
    bench.get_by_label("Posture to put", exact=True).select_option("hello")
    bench.get_by_role("button", name="On this beat").click()
    wait(bench, "tooncap.state.posing.dance.steps.length === 1")
    wait(bench, "document.querySelector('[aria-label=Pose] .frame').textContent > '0.2'")
    bench.get_by_role("button", name="Export", exact=True).click()
    bench.wait_for_selector("[aria-label=Pose] .result", timeout=60_000)
    assert "kick.dance.bvh" in bench.inner_text("[aria-label=Pose] .result")
    assert len(read_bvh(bench.folder / "kick.dance.bvh")) > 10


def test_rubber_is_shown_beside_the_clip_and_a_slider_acts_while_it_plays(bench):
    bench.get_by_role("button", name="Rubber", exact=True).click()
    wait(bench, "document.querySelector('[aria-label=Pose] canvas.view').sticks.figures.length === 2")
    spread = """(() => { const at = document.querySelector("[aria-label=Pose] canvas.view").sticks.figures[1].places;
        return JSON.stringify(at); })()"""
    bench.keyboard.press("Home")
    before = bench.evaluate(spread)
    slider = bench.get_by_label("Omega")
    slider.focus()
    for _ in range(10):
        bench.keyboard.press("ArrowRight")
    wait(bench, f"{spread} !== {before!r}")
    assert bench.evaluate("tooncap.undo") == ""
