"""`tooncap workbench` killed (SIGKILL) while it captures a long clip and is worked at; and opened again."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path

import pytest

from capture.pictures.encode import write_clip
from capture.pictures.shot import read_shot
from retarget.workbench.session import Session

ROOT = Path(__file__).resolve().parents[3]
LENGTH = 80  # frames: to and fro, so that the bean stays in the picture
pytestmark = pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="workers are found as Linux lists them")


@pytest.fixture
def long_folder(hop, tmp_path):
    there = [*range(hop.frames), *range(hop.frames - 2, 0, -1)]
    pictures = {t: hop.picture(t) for t in set(there)}
    write_clip(tmp_path / "long.mp4", [pictures[there[t % len(there)]] for t in range(LENGTH)], 24)
    return tmp_path


class Worked:
    """A workbench in a process of its own, and what a page that is connected to it hears."""

    def __init__(self, folder, file, until_the_end):
        from websockets.sync.client import connect

        command = [sys.executable, "-m", "retarget.cli", "workbench", str(folder / file), "--no-open"]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT)
        port, token = re.search(r":(\d+)/\?token=([\w-]+)", self.process.stdout.readline()).groups()
        address = f"ws://127.0.0.1:{port}/socket?token={token}"
        until_the_end.callback(self.kill)
        self.socket = until_the_end.enter_context(connect(address, origin=f"http://127.0.0.1:{port}", max_size=2**26))
        self.done, self.last = 0, 0

    def hear(self):
        event = json.loads(self.socket.recv(timeout=60))
        if event["kind"] == "progress" and event["total"]:
            self.done = event["done"]
        return event

    def act(self, **message):
        self.last += 1
        self.socket.send(json.dumps({**message, "id": self.last}))
        while (event := self.hear()).get("id") != self.last:
            pass
        assert event["kind"] == "done", event

    def workers(self):
        children = Path(f"/proc/{self.process.pid}/task").glob("*/children")
        return [int(pid) for one in children for pid in one.read_text().split()]

    def kill(self):
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()


@pytest.fixture
def bench(long_folder):
    with ExitStack() as until_the_end:
        yield Worked(long_folder, "long.mp4", until_the_end)


def alive(pid):
    state = Path(f"/proc/{pid}/stat")
    return state.exists() and state.read_text().rpartition(")")[2].split()[0] != "Z"


def test_killed_while_it_captures_no_finished_frame_is_lost_and_no_edit_older_than_a_second(hop, bench, long_folder):
    for t in (0, hop.frames - 1):
        bench.act(do="capture.outline", part="character", frame=t, points=hop.ring(t))
    bench.act(work="capture.capture")
    while bench.done < 20:
        bench.hear()
    bench.act(do="capture.outline", part="character", frame=12, points=hop.ring(12))  # meanwhile another key
    drag = {"do": "capture.drag_point", "part": "character", "key": "k12", "index": 3, "gesture": "g"}
    places, step = [], 0
    while bench.done < 35:  # a drag that does not end, and of which every place is answered
        step += 1
        bench.act(**drag, to=[100.0 + 0.01 * step, 90.0])
        places.append((time.time(), round(100.0 + 0.01 * step, 3)))
    (worker,) = bench.workers()
    done, at = bench.done, time.time()
    bench.kill()
    hop.until(lambda: not alive(worker), seconds=20)  # idle it takes two; beside other work more
    ended = time.time() - at
    print(f"\nkilled after {done} of {LENGTH} frames; its worker ended {ended:.1f} s later")

    motion, kept = long_folder / "long.motion.json", long_folder / "long.motion.json.part"
    assert kept.exists() and not motion.exists()
    x = read_shot(long_folder / "long.shot.toml").parts[0].keys[2].outline[3][0]
    lost = [when for when, place in places if place > x + 1e-6]
    assert not lost or at - min(lost) < 1
    assert not list(long_folder.glob(".unfinished*"))

    told = []
    again = Session(long_folder, "long.shot.toml")
    again.listen(told.append)
    assert again.shown()["changed"]["capture"]["kept"]
    again.act({"work": "capture.capture"})
    hop.finished(again, seconds=170)
    counted = [event for event in told if event["kind"] == "progress" and event["label"] == "character"]
    first = counted[0]["done"]
    print(f"captured again: {max(0, done - first + 1)} of {done} frames")
    assert first > done and again.state.motion is not None  # then the stretch round the new key is tracked
    assert told[-1]["sentence"].startswith("The capture that was interrupted is finished; tracked again")
    assert not kept.exists() and not again.shown()["changed"]["capture"]["stale"]
    again.close()


def test_a_worker_left_alone_writes_over_nothing(hop, bench, long_folder):
    bench.act(do="capture.outline", part="character", frame=0, points=hop.ring())
    bench.act(work="capture.capture")
    while bench.done < 10:
        bench.hear()
    (worker,) = bench.workers()
    os.kill(worker, signal.SIGSTOP)  # it sleeps while its workbench dies, and another comes and captures less
    bench.kill()
    second = Session(long_folder, "long.shot.toml")
    hop.done(second, "capture.stretch", start=0, stop=3)
    second.act({"work": "capture.capture"})
    hop.finished(second)
    written = (long_folder / "long.motion.json").read_bytes()
    os.kill(worker, signal.SIGCONT)
    hop.until(lambda: not alive(worker), seconds=20)
    assert (long_folder / "long.motion.json").read_bytes() == written
    assert read_shot(long_folder / "long.shot.toml").stop == 3
    second.close()
