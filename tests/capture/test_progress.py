"""Progress is shown on a terminal only, one bar at a time, and never changes what is yielded."""

import pytest
from rich.console import Console

from capture import progress as shown
from capture.progress import listening, progress, silence, working


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(Console, "is_terminal", property(lambda self: True))


def test_items_pass_through_off_a_terminal(capsys):
    assert list(progress(iter("abc"), "letters", 3)) == ["a", "b", "c"]
    assert capsys.readouterr().err == ""


def test_work_inside_work_shows_one_bar_and_does_not_fail(terminal, capsys):
    inner = [list(progress(range(3), "inner")) for _ in progress(range(2), "outer", 2)]
    assert inner == [[0, 1, 2]] * 2
    with working("thinking"):
        assert list(progress(range(2), "inner", 2)) == [0, 1]
    assert "outer" in capsys.readouterr().err


def test_the_next_bar_is_shown_after_one_that_failed(terminal, capsys):
    with pytest.raises(ZeroDivisionError):
        [1 / n for n in progress([1, 0], "first", 2)]
    capsys.readouterr()
    assert list(progress([1], "second", 1)) == [1]
    assert "second" in capsys.readouterr().err


def test_a_total_may_grow_and_a_part_may_have_been_done_before(terminal, monkeypatch, capsys):
    monkeypatch.setattr("capture.progress.SHOWN_EVERY", 0)
    total = [6]
    for n in progress(range(4), "frames", lambda: total[0], done=3):
        if n == 2:
            total[0] = 9
    assert "7/9" in capsys.readouterr().err


def test_a_silenced_process_shows_nothing_any_more(terminal, capsys, monkeypatch):
    monkeypatch.setattr(shown, "_shown", False)  # and what it was comes back after the test
    silence()
    assert list(progress(range(3), "numbers", 3)) == [0, 1, 2]
    with working("thinking"):
        pass
    assert capsys.readouterr().err == ""


def test_a_listener_hears_of_outer_work_only_up_to_its_end_and_the_terminal_nothing(terminal, monkeypatch, capsys):
    monkeypatch.setattr("capture.progress.SHOWN_EVERY", 0)
    heard = []
    with listening(lambda *told: heard.append(told)):
        for _ in progress(range(2), "outer", 2):
            list(progress(range(3), "inner", 3))
        with working("thinking"):
            pass
    assert {label for label, *_ in heard} == {"outer", "thinking"}
    assert heard[-2:] == [("outer", 2, 2), ("thinking", 0, None)]
    assert capsys.readouterr().err == ""


def test_a_listener_can_stop_the_work_and_the_next_is_heard_again(monkeypatch):
    monkeypatch.setattr("capture.progress.SHOWN_EVERY", 0)

    def stop(label, done, total):
        raise KeyboardInterrupt

    with listening(stop), pytest.raises(KeyboardInterrupt):
        list(progress(range(5), "stopped", 5))
    heard = []
    with listening(lambda *told: heard.append(told)):
        list(progress(range(5), "whole", 5))
    assert heard[-1] == ("whole", 5, 5)
