"""A bean that hops, drawn by formula, and how tests talk to a session about it; they get that as the fixture `hop`."""

import time
from types import SimpleNamespace

import numpy as np
import pytest

from capture.pictures.encode import write_clip
from retarget.workbench.session import Session

FRAMES, POINTS = 36, 40


def drawn_at(t):
    """The bean's outline (POINTS, 2) in frame t: it goes to the right, hops, and bends up and down."""
    beat = 2 * np.pi * t / 12
    angles = 2 * np.pi * np.arange(POINTS) / POINTS
    x, y = 34 * np.cos(angles), 14 * np.sin(angles) * (1 - 0.3 * np.cos(angles))
    return np.column_stack([50 + 4 * t + x, 120 - 40 * abs(np.sin(beat / 2)) + y + 14 * np.cos(beat) * (x / 34) ** 2])


def picture(t):
    import cv2

    image = np.full((180, 240, 3), (226, 236, 242), np.uint8)
    points = np.round(drawn_at(t) * 16).astype(np.int32)
    cv2.fillPoly(image, [points], (214, 96, 58), cv2.LINE_AA, 4)
    cv2.polylines(image, [points], True, (60, 20, 12), 2, cv2.LINE_AA, 4)
    mark = np.round((drawn_at(t).mean(axis=0) + (6, -6)) * 16).astype(int)
    cv2.circle(image, tuple(map(int, mark)), 5 * 16, (250, 240, 200), -1, cv2.LINE_AA, 4)
    return image


def around(t):
    low, high = drawn_at(t).min(axis=0) - 8, drawn_at(t).max(axis=0) + 8
    return [float(v) for v in (*low, *(high - low))]


def done(session, what, /, **fields):
    events = session.act({"do": what, **fields})
    assert events[-1]["kind"] == "done", events
    return events


def refused(session, message):
    before = session.state
    (event,) = session.act(message)
    assert event["kind"] == "refused" and session.state is before
    return event["sentence"]


def finished(session, seconds=60):
    end = time.monotonic() + seconds
    while session.running is not None:
        assert time.monotonic() < end
        time.sleep(0.02)
    with session._lock:  # what came of it is put in place before anything else can be done
        pass


def until(true, seconds=30):
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end
        time.sleep(0.02)


def outline_of(session, key=0):
    return np.array(session.state.shot.parts[0].keys[key].outline)


def ring(t=0):
    return [list(map(float, point)) for point in drawn_at(t)]


@pytest.fixture(scope="session")
def hop():
    """What is above, by name."""
    return SimpleNamespace(
        frames=FRAMES,
        points=POINTS,
        drawn_at=drawn_at,
        picture=picture,
        around=around,
        ring=ring,
        done=done,
        refused=refused,
        finished=finished,
        until=until,
        outline_of=outline_of,
    )


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    path = tmp_path_factory.mktemp("clip") / "hop.mp4"
    write_clip(path, [picture(t) for t in range(FRAMES)], 24)
    return path


@pytest.fixture
def folder(clip, tmp_path):
    (tmp_path / "hop.mp4").write_bytes(clip.read_bytes())
    return tmp_path


@pytest.fixture
def session(folder):
    opened = Session(folder, "hop.mp4")
    yield opened
    opened.close()
