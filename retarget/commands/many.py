"""The command for many shots at once."""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from retarget.commands import flags
from retarget.console import Failed, Out, device_needs_refine, folder_at, given_files, stem

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from capture.fit.batch import Job, Outcome


def batch(
    *shots: Path,
    out: Out = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    missing: bool = False,
    refine: flags.Refine = False,
    device: flags.Device = "auto",
) -> str:
    """Capture many shots side by side; one that fails is told, and does not stop the rest.

    Parameters
    ----------
    shots
        The *.shot.toml files.
    out
        A folder for the motion files; NAME.motion.json beside each shot if not given.
    jobs
        How many shots to work on at a time; as many as there are cores if not given.
    scheduler
        The address of a Dask scheduler, such as tcp://10.0.0.7:8786: its workers do the work, not this machine.
    missing
        Pass over the shots whose motion file is there already.
    """
    from capture.errors import InputError
    from capture.fit import batch as captures
    from capture.progress import progress

    if jobs is not None and scheduler is not None:
        raise InputError("--jobs is for this machine and a scheduler has workers of its own: leave one of the two out")
    if jobs is not None and jobs < 1:
        raise InputError(f"--jobs must be at least 1 shot at a time, got {jobs}")
    device_needs_refine(refine, device)
    targets = _targets(given_files(shots), out)
    there = [target for target in targets if missing and target.exists()]
    targets = {target: shot for target, shot in targets.items() if target not in there}
    passed_over = f", {len(there)} passed over whose motion is there" if there else ""
    if not targets:
        return f"no shot left to capture{passed_over}"
    names = {
        captures.Job(os.path.abspath(shot), os.path.abspath(target), refine, device): shot
        for target, shot in targets.items()
    }
    at_once = min(captures.cores() if jobs is None else jobs, len(names))
    # a bar takes what is printed above it along to its own stream, which is right on a terminal only
    stream = None if sys.stdout.isatty() else sys.stdout
    try:
        with _executors(at_once, scheduler) as (executor, afresh):
            if out is not None:
                folder_at(out)
            found = captures.run(list(names), executor, afresh=afresh, at_once=1 if scheduler else at_once)
            outcomes = captures.in_order(list(names), progress(found, "shots", len(names)))
            failed = [shot.name for shot, captured in _told(outcomes, names, stream) if not captured]
    except KeyboardInterrupt:
        raise KeyboardInterrupt("interrupted; the same command with --missing goes on from where it was") from None
    said = f"{len(names) - len(failed)} of {len(names)} shots captured{passed_over}"
    if failed:
        raise Failed(f"{said}, {len(failed)} failed: {', '.join(failed)}")
    return said


def _told(
    outcomes: "Iterator[Outcome]", names: "dict[Job, Path]", stream: TextIO | None
) -> Iterator[tuple[Path, bool]]:
    """Print a line for each shot; yields the shot, and whether it was captured."""
    for outcome in outcomes:
        shot = names[outcome.job]
        for note in outcome.notes:
            print(f"tooncap: {shot}: {note}", file=sys.stderr)
        print(f"{shot}: {'' if outcome.captured else 'failed: '}{outcome.said}", file=stream, flush=True)
        yield shot, outcome.captured


def _targets(shots: list[Path], folder: Path | None) -> dict[Path, Path]:
    """The shot for each motion file that will be written; two shots for one file are refused."""
    from capture.errors import InputError

    targets: dict[Path, Path] = {}
    taken: dict[str, Path] = {}
    for shot in shots:
        target = (shot.parent if folder is None else folder) / (stem(shot) + ".motion.json")
        real = os.path.normcase(os.path.realpath(target))
        if real in taken:
            raise InputError(
                f"every shot must get a file of its own, {taken[real]} and {shot} would both be written to {target}: "
                "rename one of them, or leave it out"
            )
        taken[real] = targets[target] = shot
    return targets


@contextmanager
def _executors(at_once: int, scheduler: str | None) -> "Iterator[tuple[Executor, Callable[[], Executor] | None]]":
    """What the shots go through, and what opens another such for those whose worker died."""
    from capture.fit import batch as captures

    if scheduler is None:
        with captures.processes(at_once) as executor:
            yield executor, None
        return
    with captures.cluster(scheduler) as (opened, workers), opened() as executor:
        if not workers:
            print(f"tooncap: {scheduler} has no workers yet, the shots wait for the first to join", file=sys.stderr)
        yield executor, opened
