"""Many shots through threads, processes and a cluster: each as if captured alone, and no shot harms another."""

import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from capture.errors import InputError
from capture.fit import batch, video
from capture.fit.batch import Job, Outcome
from capture.motion import tracks
from capture.motion.tracks import CartoonMotion
from capture.pictures.clip import clip_of
from capture.pictures.shot import read_shot
from fixtures import ball, write

HERE, ROOT = Path(__file__).parent, Path(__file__).parents[2]


@pytest.fixture(scope="module")
def shots(tmp_path_factory: pytest.TempPathFactory) -> dict[Path, CartoonMotion | None]:
    """Three shots of a few frames of the ball, and what they are captured alone; the second one's clip is missing."""
    folder = tmp_path_factory.mktemp("shots")
    toon = ball.ball()
    frames = np.stack([toon.frame(t) for t in range(4)])
    counts = {"early": 3, "gone": 1, "late": 4}
    files = [write.write_toon(replace(toon, name=n), folder, clip_of(frames[:count])) for n, count in counts.items()]
    (folder / "gone.mp4").unlink()
    return {file: None if "gone" in file.name else video.capture(read_shot(file)) for file in files}


@pytest.fixture
def pretended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Work by name, and jobs of such names: pretended("fine", "dies") -> work, jobs."""
    monkeypatch.syspath_prepend(HERE)
    from pretend import work

    return lambda *names: (work, [Job(f"{name}.shot.toml", str(tmp_path / f"{name}.tries")) for name in names])


@contextmanager
def opened(kind: str, request: pytest.FixtureRequest) -> Executor:
    if kind == "cluster":
        with batch.cluster(request.getfixturevalue("cluster")) as (afresh, _), afresh() as executor:
            yield executor
    else:
        with ThreadPoolExecutor(2) if kind == "threads" else batch.processes(2) as executor:
            yield executor


def tries(job: Job) -> int:
    return len(Path(job.out).read_text().splitlines())


@pytest.mark.parametrize("kind", ["threads", "processes", "cluster"])
def test_shots_are_captured_as_if_alone_and_the_one_that_fails_is_told(kind, shots, tmp_path, request):
    jobs = [Job(str(shot), str(tmp_path / f"{shot.stem}.motion.json")) for shot in shots]
    with opened(kind, request) as executor:
        early, gone, late = batch.in_order(jobs, batch.run(jobs, executor))
    assert not gone.captured and "gone.mp4: the clip must exist" in gone.said
    assert sorted(tmp_path.iterdir()) == sorted(Path(job.out) for job in (early.job, late.job))
    for outcome in (early, late):
        alone = shots[Path(outcome.job.shot)]
        assert outcome.captured and outcome.said == tracks.summary(alone)
        off = tracks.load(outcome.job.out).tracks[0].affine - alone.tracks[0].affine
        assert np.abs(off).max() < 1e-6  # pixels; threads may add up in another order


@pytest.mark.parametrize("kind", ["threads", "processes"])
def test_a_failure_is_one_sentence_even_where_the_error_itself_could_not_travel(kind, pretended, request):
    work, jobs = pretended("refused", "fine", "faulty")
    with opened(kind, request) as executor:
        refused, fine, faulty = batch.in_order(jobs, batch.run(jobs, executor, work))
    assert (refused.captured, refused.said) == (False, "a shot must be better than this")
    assert not faulty.captured
    assert faulty.said == "Stubborn: 1 and 2; `tooncap capture faulty.shot.toml` shows where"
    assert fine.captured


def test_a_process_that_dies_takes_only_its_own_shot_with_it(pretended):
    work, jobs = pretended("fine1", "dies1", "fine2", "fine3", "dies2", "fine4")
    with batch.processes(2) as executor:
        outcomes = list(batch.in_order(jobs, batch.run(jobs, executor, work, at_once=2)))
    assert [outcome.captured for outcome in outcomes] == [True, False, True, True, False, True]
    assert "the process that captured it died" in outcomes[1].said


def test_a_shot_that_dies_beside_others_is_tried_once_more_alone(pretended):
    work, jobs = pretended("greedy", "fine")
    with batch.processes(2) as executor:
        greedy, fine = batch.in_order(jobs, batch.run(jobs, executor, work, at_once=2))
    assert greedy.captured and tries(greedy.job) == 3
    assert fine.captured


def test_a_worker_of_a_cluster_that_dies_takes_only_its_own_shot_with_it(cluster, pretended):
    work, jobs = pretended("fine1", "fine2", "dies", "fine3", "fine4")
    with batch.cluster(cluster) as (afresh, _), afresh() as executor:
        outcomes = list(batch.in_order(jobs, batch.run(jobs, executor, work, afresh)))
    assert [outcome.captured for outcome in outcomes] == [True, True, False, True, True]


@pytest.mark.parametrize("kind", ["processes", "cluster"])
def test_every_worker_keeps_to_one_thread(kind, pretended, request):
    work, jobs = pretended("fine")
    with opened(kind, request) as executor:
        (outcome,) = batch.run(jobs, executor, work)
    assert outcome.said == "1 thread in OpenCV, {'1'} in the rest"


def test_a_shot_that_has_changed_is_captured_again_by_a_cluster(cluster, pretended):
    work, jobs = pretended("fine")
    with batch.cluster(cluster) as (afresh, _), afresh() as executor:
        for count in (1, 2):
            assert [outcome.captured for outcome in batch.run(jobs, executor, work)] == [True]
            assert tries(jobs[0]) == count


def test_what_has_not_begun_is_cancelled_when_nobody_listens_any_more():
    begun, go_on = [], threading.Event()

    def work(job: Job) -> Outcome:
        begun.append(job.shot)
        if job.shot != "a":
            go_on.wait(10)
        return Outcome(job, True, "")

    with ThreadPoolExecutor(1) as executor:
        outcomes = batch.run([Job(name, "") for name in "abcdefg"], executor, work)
        assert next(outcomes).job.shot == "a"
        outcomes.close()
        go_on.set()
    assert begun in (["a"], ["a", "b"])


@pytest.mark.skipif(os.name != "posix", reason="Ctrl-C is sent to a whole group of processes, as a terminal does it")
def test_an_interrupt_ends_what_runs_and_what_waits_without_a_word(pretended, tmp_path):
    _, jobs = pretended("slow1", "slow2", "slow3", "slow4", "slow5")
    script = tmp_path / "script.py"
    script.write_text(
        f"import sys; sys.path[:0] = {[str(HERE), str(ROOT)]!r}\n"
        "from capture.fit import batch\nfrom pretend import work\n"
        'if __name__ == "__main__":\n'
        "    try:\n"
        f"        jobs = [batch.Job(*pair) for pair in {[(job.shot, job.out) for job in jobs]!r}]\n"
        "        with batch.processes(2) as executor:\n"
        "            list(batch.run(jobs, executor, work))\n"
        "    except KeyboardInterrupt:\n"
        "        sys.exit(130)\n"
    )
    process = subprocess.Popen([sys.executable, str(script)], stderr=subprocess.PIPE, text=True, start_new_session=True)
    until = time.monotonic() + 60
    while not (Path(jobs[0].out).exists() and Path(jobs[1].out).exists()) and time.monotonic() < until:
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGINT)
    _, said = process.communicate(timeout=45)  # one of them alone takes 60 s
    assert (process.returncode, said) == (130, "")
    assert [Path(job.out).exists() for job in jobs] == [True, True, False, False, False]


def test_outcomes_are_told_in_the_order_of_the_jobs_as_soon_as_that_can_be():
    jobs = [Job(name, "") for name in "abc"]
    seen = []

    def finished():
        for name in "cab":
            seen.append(name)
            yield Outcome(Job(name, ""), True, "")

    told = batch.in_order(jobs, finished())
    assert next(told).job.shot == "a" and seen == ["c", "a"]
    assert [outcome.job.shot for outcome in told] == ["b", "c"]


def test_a_scheduler_that_does_not_answer_is_refused():
    pytest.importorskip("distributed", reason="the extra 'dask' is not installed")
    refused = pytest.raises(InputError, match=r"scheduler must answer .* none does at 'tcp://127.0.0.1:9'")
    with refused, batch.cluster("tcp://127.0.0.1:9", patience="0.3s"):
        pass
    with pytest.raises(InputError, match="none does at 'nowhere'"), batch.cluster("nowhere", patience="0.3s"):
        pass


def test_workers_without_this_tooncap_are_refused_before_they_are_handed_anything(cluster, monkeypatch):
    with sys.modules["distributed"].Client(cluster, set_as_default=False) as client:
        client.wait_for_workers(2, timeout=60)  # one may be coming back from a test in which it died
    monkeypatch.setattr(batch, "__name__", "capture.fit.not_there")
    refused = pytest.raises(InputError, match=r"every worker must have this tooncap, tcp://.* has not \(2 of 2\)")
    with refused, batch.cluster(cluster):
        pass


def test_without_dask_a_scheduler_is_refused_and_the_extra_is_named(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"tooncap\[dask\]"), batch.cluster("tcp://127.0.0.1:9"):
        pass


def test_handing_out_work_loads_nothing_heavy():
    loaded = "import sys; from capture.fit import batch; print(*sys.modules)"
    said = subprocess.run([sys.executable, "-c", loaded], cwd=ROOT, capture_output=True, text=True, check=True)
    assert not set(said.stdout.split()) & {"numpy", "cv2", "scipy", "distributed"}
