"""Work that `capture.fit.batch` can hand to other processes, which import it by name: a shot's name says what it does."""

import os
import time
from pathlib import Path

import cv2

from capture.errors import InputError
from capture.fit.batch import Job, Outcome


class Stubborn(Exception):
    """An error that cannot be unpickled, as some libraries have them."""

    def __init__(self, one: int, two: int) -> None:
        super().__init__(f"{one}\nand {two}")


def work(job: Job) -> Outcome:
    """What the shot's name asks for; every begin is one more line in its file."""
    with open(job.out, "a") as tries:
        tries.write("begun\n")
    name = job.shot.split(".")[0].rstrip("0123456789")
    if name == "dies":
        os._exit(3)
    if name == "greedy" and len(Path(job.out).read_text().splitlines()) < 3:
        os._exit(3)  # dies among others, and in a process of its own beside another; not when it is alone
    if name == "refused":
        raise InputError(f"{job.shot}: a shot must be\nbetter than this")
    if name == "faulty":
        raise Stubborn(1, 2)
    if name == "slow":
        time.sleep(60)
    libraries = {os.environ.get(f"{name}_NUM_THREADS") for name in ("OMP", "OPENBLAS")}
    return Outcome(job, True, f"{cv2.getNumThreads()} thread in OpenCV, {libraries} in the rest")
