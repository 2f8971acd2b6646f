"""How far work has come that may take longer than a second: a bar, only on a terminal and one at a time.

A program that shows it in another way listens instead of the terminal.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from operator import length_hint
from time import monotonic
from typing import Any, TypeVar

Item = TypeVar("Item")
SHOWN_EVERY = 0.1  # seconds

Listener = Callable[[str, int, int | None], None]
"""Is told what is being done, how much of it is done, and of how much; it may raise to stop the work."""

_shown = False  # a terminal has room for one: what runs inside shown work is part of it
_listener: Listener | None = None


def progress(
    items: Iterable[Item], label: str, total: int | Callable[[], int] | None = None, done: int = 0
) -> Iterator[Item]:
    """Yield the items; on a terminal show how many are done, how many a second, and the time left.

    A `total` that only shows as the work goes on is a function, asked now and then.  `done` were done before.
    """
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, TextColumn, TimeRemainingColumn
    from rich.text import Text

    class Rate(ProgressColumn):
        def render(self, task) -> Text:  # noqa: ANN001 - rich's own type
            return Text(f"{task.speed:.1f}/s" if task.speed else "")

    count = total if callable(total) else lambda: length_hint(items) or None if total is None else total
    if _listener is not None and not _shown:
        yield from _heard(items, label, count, done)
        return
    with _terminal() as console:
        if console is None:
            yield from items
            return
        columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), Rate(), TimeRemainingColumn())
        with Progress(*columns, console=console, transient=True) as bar:
            task, shown = bar.add_task(label, total=count(), completed=done), monotonic()
            for number, item in enumerate(items, done + 1):
                yield item
                if monotonic() - shown > SHOWN_EVERY:
                    bar.update(task, completed=number, total=count())
                    shown = monotonic()


@contextmanager
def working(label: str) -> Iterator[None]:
    """Show on a terminal that something is being done whose length is not known."""
    if _listener is not None and not _shown:
        _listener(label, 0, None)
    with _terminal() as console:
        if console is None:
            yield
            return
        with console.status(label):
            yield


def silence() -> None:
    """Show nothing in this process from now on: the terminal belongs to the process that began it."""
    global _shown
    _shown = True


@contextmanager
def listening(listener: Listener) -> Iterator[None]:
    """Tell all progress of this process to a listener, at most ten times a second, and nothing to a terminal."""
    global _listener
    before, _listener = _listener, listener
    try:
        yield
    finally:
        _listener = before


def _heard(items: Iterable[Item], label: str, count: Callable[[], int | None], done: int) -> Iterator[Item]:
    """The items, with the listener told of them; what runs inside is part of it and is not told."""
    global _shown
    told = -SHOWN_EVERY
    number, _shown = done, True
    try:
        for number, item in enumerate(items, done + 1):
            yield item
            if monotonic() - told > SHOWN_EVERY:
                _listener(label, number, count())
                told = monotonic()
    finally:
        _shown = False
    _listener(label, number, count())


@contextmanager
def _terminal() -> Iterator[Any]:
    """The terminal, if there is one and nothing is shown on it yet."""
    global _shown
    from rich.console import Console

    console = Console(stderr=True)
    if _shown or _listener is not None or not console.is_terminal:
        yield None
        return
    _shown = True
    try:
        yield console
    finally:
        _shown = False
