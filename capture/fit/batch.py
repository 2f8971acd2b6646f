"""Many shots, each captured for itself, through any executor of `concurrent.futures`: threads, processes, a cluster.

What goes wrong with one shot is told in one sentence and does not stop the rest, even where a whole process dies.
"""

import gc
import os
import signal
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import (
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    as_completed,
)
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from capture.errors import InputError

if TYPE_CHECKING:
    from capture.motion.tracks import CartoonMotion
    from capture.pictures.clip import Clip
    from capture.pictures.shot import Shot


@dataclass(frozen=True)
class Job:
    """A shot file, and the motion file to make of it; absolute paths, for a worker may stand in another folder."""

    shot: str
    out: str
    refined: bool = False  # whether the whole clip is refined at once after capture
    device: str = "auto"  # where that is done: auto, cpu or cuda


@dataclass(frozen=True)
class Outcome:
    """What came of a job: the summary of its motion, or the cause why there is none."""

    job: Job
    captured: bool
    said: str
    notes: tuple[str, ...] = ()  # what a user should be told of the clip, a sentence each


Work = Callable[[Job], Outcome]


def capture(job: Job) -> Outcome:
    """Capture a shot file into a motion file, which is written whole or not at all."""
    from capture.fit import video
    from capture.motion import tracks
    from capture.pictures.shot import read_shot

    shot = read_shot(job.shot)
    clip = video.open_clip(shot)
    motion = capture_to(Path(job.out), shot, clip, job.refined, job.device)
    return Outcome(job, True, tracks.summary(motion, shot.start), clip.notes)


def capture_to(out: Path, shot: "Shot", clip: "Clip", refined: bool = False, device: str = "auto") -> "CartoonMotion":
    """Capture a shot and save its motion, refined over the whole clip at once where that is asked for.

    After an interrupt the same call goes on from where the capture was: what is done is kept meanwhile in a file
    beside `out`, named like it with ".part" added.
    """
    from capture.fit import video

    if refined:
        from capture.fit import refine

        device = refine.device_of(device)  # refused now, if it must be, and not after the capture
    motion = video.capture(shot, clip, keep_beside(out), stays=True)
    if refined:
        motion = refine.refine(motion, shot, clip, device)
    put(motion, out)
    return motion


def keep_beside(out: Path) -> Path:
    """Where an interrupted capture keeps what it has done."""
    return out.with_name(out.name + ".part")


def put(motion: "CartoonMotion", out: Path) -> None:
    """Save a captured motion; only then goes what an interruption would have gone on from."""
    from capture.motion import tracks
    from capture.progress import working

    with working("saving"):  # the last place where who listens may stop it
        tracks.save(motion, out)
    keep_beside(out).unlink(missing_ok=True)


def run(
    jobs: list[Job],
    executor: Executor,
    work: Work = capture,
    afresh: Callable[[], Executor] | None = None,
    at_once: int = 1,
) -> Iterator[Outcome]:
    """Work through the jobs, and yield what came of each as it is done, in whatever order.

    A worker that dies may take down jobs that ran beside it.  All that are lost so are run again, each in an executor
    of its own that `afresh` opens (one process of this machine if not given), `at_once` side by side; and those
    that die there too, one by one: memory may have run out only because others had their share.  What dies alone
    is at fault.  If the caller stops listening, or is interrupted, what has not begun is cancelled.
    """
    afresh = partial(processes, 1) if afresh is None else afresh
    left: list[Job] = []
    with _one_thread_in_opencv():
        yield from _through(jobs, executor, partial(attempt, work), left)
        for together in dict.fromkeys((at_once, 1)):
            if left:
                jobs, left = left, []
                with ThreadPoolExecutor(together) as threads:
                    yield from _through(jobs, threads, partial(_alone, work, afresh), left)
    for job in left:
        yield Outcome(job, False, "the process that captured it died, even when nothing ran beside it")


def in_order(jobs: list[Job], outcomes: Iterable[Outcome]) -> Iterator[Outcome]:
    """The outcomes in the order of the jobs, each as soon as all before it are there."""
    known: dict[Job, Outcome] = {}
    waiting = list(jobs)
    for outcome in outcomes:
        known[outcome.job] = outcome
        while waiting and waiting[0] in known:
            yield known.pop(waiting.pop(0))


def processes(count: int | None = None) -> Executor:
    """Processes of this machine, as many as it has cores if not told, each with one thread in every library.

    They are begun anew (spawned), so a script that opens them must keep its doings under
    `if __name__ == "__main__":`.
    """
    from multiprocessing import get_context

    return ProcessPoolExecutor(cores() if count is None else count, get_context("spawn"), _begin_worker)


def cores() -> int:
    """How many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def cluster(address: str, patience: str = "10s") -> Iterator[tuple[Callable[[], Executor], int]]:
    """What opens executors on the workers of a Dask scheduler (extra `dask`), and how many workers it has now.

    The address is such as "tcp://10.0.0.7:8786".  The workers must have this tooncap, and find the files under the
    same paths.
    """
    from importlib.machinery import ModuleSpec
    from importlib.util import find_spec

    try:
        from distributed import Client
    except ImportError:
        raise InputError(
            "a scheduler needs Dask, which is not installed here: install tooncap with its extra, tooncap[dask]"
        ) from None
    trouble = ""
    try:
        client = Client(address, timeout=patience, set_as_default=False)
    except (OSError, ValueError) as error:
        trouble = _one_line(error) or type(error).__name__
    if trouble:
        gc.collect()  # a client half made is freed here: freed while another one starts, it locks that out for good
        raise InputError(
            f'a Dask scheduler must answer at the address, such as "tcp://10.0.0.7:8786", and none does at {address!r} '
            f"({trouble}): start one there, or leave the address out to work on this machine"
        )
    with client:
        # a worker that cannot unpickle what it is handed dies of it, without a word to us: so ask first
        found = client.run(find_spec, __name__, on_error="return")
        lacking = sorted(worker for worker, spec in found.items() if not isinstance(spec, ModuleSpec))
        if lacking:
            raise InputError(
                f"every worker must have this tooncap, {lacking[0]} has not ({len(lacking)} of {len(found)}): "
                "install it there and start the worker again"
            )
        # not "pure": Dask would hand out its earlier result for a file that has changed since
        yield partial(client.get_executor, pure=False), len(found)


def attempt(work: Work, job: Job) -> Outcome:
    """Do a job wherever this runs; what goes wrong comes back as a sentence, for not every error can travel."""
    try:
        with _interruptible(), _one_thread_in_opencv():
            return work(job)
    except InputError as error:
        cause = _one_line(error)
    except Exception as error:
        cause = f"{_named(error)}; `tooncap capture {job.shot}` shows where"
    return Outcome(job, False, cause.removeprefix(f"{job.shot}: "))


def _through(jobs: list[Job], executor: Executor, work: Work, left: list[Job]) -> Iterator[Outcome]:
    """Outcomes as they come; jobs whose worker died are put into `left` instead."""
    futures: dict[Future, Job] = {}
    try:
        for job in jobs:
            try:
                futures[executor.submit(work, job)] = job
            except BrokenExecutor:  # by one of the jobs before
                left.append(job)
        for future in as_completed(futures):
            job = futures.pop(future)
            outcome = _outcome(job, future)
            del future  # Dask does a job anew if its worker is lost later and somebody still holds on to the result
            if outcome is None:
                left.append(job)
            else:
                yield outcome
    finally:
        for future in futures:
            future.cancel()


def _outcome(job: Job, future: Future) -> Outcome | None:
    """What came of a job; None if its worker died."""
    try:
        return future.result()
    except CancelledError:
        return Outcome(job, False, "the scheduler let go of it, or is gone")
    except Exception as error:  # `attempt` lets none through, so it is the executor's own
        if isinstance(error, BrokenExecutor) or type(error).__name__ == "KilledWorker":  # so Dask calls it
            return None
        return Outcome(job, False, f"{_named(error)}; no worker could begin it")


def _alone(work: Work, afresh: Callable[[], Executor], job: Job) -> Outcome:
    """Do a job in an executor of its own; if its worker dies this raises what the executor says to that."""
    with afresh() as executor:
        return executor.submit(attempt, work, job).result()


_is_worker = _interrupted = False  # whether this process was begun by `processes`, and whether Ctrl-C came to it


def _begin_worker() -> None:
    """See that a process stays within its core, shows nothing on the terminal, and is not woken by an interrupt."""
    global _is_worker
    from capture.progress import silence

    _is_worker = True
    for library in ("OMP", "OPENBLAS", "MKL", "VECLIB_MAXIMUM", "NUMBA"):
        os.environ[f"{library}_NUM_THREADS"] = "1"
    silence()
    signal.signal(signal.SIGINT, signal.SIG_IGN)


@contextmanager
def _interruptible() -> Iterator[None]:
    """Let Ctrl-C end the job at hand, and those that wait in this process already: those can no more be cancelled."""
    global _interrupted
    if not _is_worker:
        yield
        return
    if _interrupted:
        raise KeyboardInterrupt
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    except KeyboardInterrupt:
        _interrupted = True
        raise
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


@contextmanager
def _one_thread_in_opencv() -> Iterator[None]:
    """Jobs side by side leave OpenCV's own threads no more than each other's cores."""
    import cv2

    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(before)


def _named(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split()).rstrip(" :.")


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())
