"""Nobody waits for another: what takes long at one page keeps no other from being heard, and is not lost by it."""

import threading
import time
from dataclasses import replace
from types import SimpleNamespace

import pytest

from retarget.workbench import working
from retarget.workbench.desks import Desk
from retarget.workbench.session import Session
from retarget.workbench.state import State


@pytest.fixture
def held(tmp_path):
    """A session with an action that waits until it is let go, one that writes and waits, and a quick one."""
    goes, begun = threading.Event(), threading.Semaphore(0)
    said = []

    def slow(state: State, name: str) -> State:
        begun.release()
        assert goes.wait(10)
        said.append(state.captured)
        return replace(state, shot=name)

    def writes(state: State) -> State:
        said.append("written")
        return slow(state, "") and state

    def quick(state: State, to: str) -> State:
        return replace(state, captured=to)

    def shown(state: State) -> dict:
        return {"seen": [state.shot, state.captured]}

    table = Desk("test", shown, actions={"slow": slow, "quick": quick}, writes={"writes": writes})
    session = Session(tmp_path, tables=(table,))
    yield SimpleNamespace(session=session, goes=goes, begun=begun, said=said)
    goes.set()
    session.close()


def at_once(session, what, **fields):
    """Do something in another thread; gives that and what it will be answered."""
    events = []
    thread = threading.Thread(target=lambda: events.extend(session.act({"do": what, **fields})))
    thread.start()
    return thread, events


@pytest.mark.parametrize(("what", "fields"), [("test.slow", {"name": "a"}), ("test.writes", {})])
def test_while_one_thing_takes_long_another_is_answered_at_once(held, hop, what, fields):
    thread, events = at_once(held.session, what, **fields)
    assert held.begun.acquire(timeout=5)
    began = time.monotonic()
    hop.done(held.session, "test.quick", to="b")
    assert held.session.shown()["changed"]["test"]["seen"][1] == "b"
    assert time.monotonic() - began < 0.2
    held.goes.set()
    thread.join(10)
    assert events[-1]["kind"] == "done" and held.session.state.captured == "b"  # what came meanwhile stays


def test_what_took_long_is_worked_out_again_from_what_was_done_meanwhile(held, hop):
    thread, _ = at_once(held.session, "test.slow", name="a")
    assert held.begun.acquire(timeout=5)
    hop.done(held.session, "test.quick", to="b")
    held.goes.set()
    thread.join(10)
    assert held.said == [None, "b"] and held.session.state.shot == "a"
    hop.done(held.session, "undo")
    assert (held.session.state.shot, held.session.state.captured) == (None, "b")  # one step each


def test_what_writes_is_done_once_whatever_comes_meanwhile(held, hop):
    thread, _ = at_once(held.session, "test.writes")
    assert held.begun.acquire(timeout=5)
    hop.done(held.session, "test.quick", to="b")
    held.goes.set()
    thread.join(10)
    assert held.said.count("written") == 1


def test_what_was_asked_of_one_work_is_not_done_to_another(held):
    thread, events = at_once(held.session, "test.slow", name="a")
    assert held.begun.acquire(timeout=5)
    held.session.history = replace(held.session.history, state=replace(held.session.state, name="other"))
    held.goes.set()
    thread.join(10)
    assert "opened meanwhile" in events[-1]["sentence"] and held.session.state.shot is None


def test_while_a_slow_drawing_is_learnt_others_are_answered_and_it_plays_then(
    tmp_path, by_hand, worm, hop, monkeypatch
):
    import numpy as np

    from capture.motion import tracks
    from retarget.characters.casts import cast as casting

    lean = np.linspace(0, 1, 8)
    tracks.save(by_hand.motion(by_hand.tumble(8), np.column_stack([1 - lean, lean])), tmp_path / "hop.motion.json")
    session = Session(tmp_path, "hop.motion.json")
    learns, quickly = threading.Event(), casting.targets

    def slowly(*given):
        learns.set()
        time.sleep(0.8)
        return quickly(*given)

    monkeypatch.setattr(casting, "targets", slowly)
    thread, events = at_once(session, "stage.play", files=sorted(file.name for file in tmp_path.glob("worm_*.svg")))
    assert learns.wait(20)
    began = time.monotonic()
    session.act({"do": "undo"})
    assert session.shown()["changed"]["stage"]["cast"] is None
    assert time.monotonic() - began < 0.2
    thread.join(20)
    assert events[-1]["kind"] == "done" and session.state.cast is not None
    session.close()


def test_work_with_more_to_say_than_a_pipe_holds_begins_at_once_and_can_be_cancelled():
    told = []
    began = time.monotonic()
    running = working.start("none.none", {"much": "x" * 2**21}, lambda _, said: told.append(said))
    working.cancel(running)
    assert time.monotonic() - began < 0.2
    running.process.wait(20)


def test_work_with_more_to_say_than_a_pipe_holds_is_heard_whole(hop):
    told = []
    working.start("none.none", {"much": "x" * 2**21}, lambda _, said: told.append(said))
    hop.until(lambda: told)
    assert told[-1]["kind"] == "refused" and "none.none" in told[-1]["sentence"]
