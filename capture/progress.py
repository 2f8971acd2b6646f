"""A progress bar for work that may take longer than a second; only on a terminal, and one at a time."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from operator import length_hint
from time import monotonic
from typing import Any, TypeVar

Item = TypeVar("Item")
SHOWN_EVERY = 0.1  # seconds

_shown = False  # a terminal has room for one: what runs inside shown work is part of it


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

    with _terminal() as console:
        if console is None:
            yield from items
            return
        columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), Rate(), TimeRemainingColumn())
        count = total if callable(total) else lambda: length_hint(items) or None if total is None else total
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
def _terminal() -> Iterator[Any]:
    """The terminal, if there is one and nothing is shown on it yet."""
    global _shown
    from rich.console import Console

    console = Console(stderr=True)
    if _shown or not console.is_terminal:
        yield None
        return
    _shown = True
    try:
        yield console
    finally:
        _shown = False
