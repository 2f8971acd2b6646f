"""Long work in a process of its own, so that the page stays quick, and nothing of it dies with the workbench."""

import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Thread, Timer
from typing import Any

PATIENCE = 20.0  # seconds that cancelled work has to put away what it has done


@dataclass(eq=False)
class Running:
    """Work that is being done."""

    name: str
    process: subprocess.Popen
    cancelled: bool = False


def start(name: str, arguments: dict[str, Any], hears: Callable[[Running, dict[str, Any]], None]) -> Running:
    """Start a process that does the work called `name`.

    `hears` is called from a thread with every message: progress, then one of result, refused or stopped.
    """
    import msgspec

    root = str(Path(__file__).resolve().parents[2])
    paths = [root, *filter(None, [os.environ.get("PYTHONPATH")])]
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "retarget.workbench.worker"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
        start_new_session=True,  # a ^C in the terminal is not for it: it ends in its own way when its input does
    )
    running = Running(name, process)
    asked = msgspec.json.encode({"work": name, "arguments": arguments}) + b"\n"
    Thread(target=_converse, args=(running, asked, hears), daemon=True).start()
    return running


def cancel(running: Running) -> None:
    """Stop the work; what a capture has done is kept, and it goes on from there next time."""
    running.cancelled = True
    Thread(target=_close, args=(running,), daemon=True).start()
    last = Timer(PATIENCE, running.process.kill)
    last.daemon = True
    last.start()


def _converse(running: Running, asked: bytes, hears: Callable[[Running, dict[str, Any]], None]) -> None:
    """Ask, and hear what is said; a pipe takes much only once the process reads, which is a second or two from now."""
    import msgspec

    with suppress(OSError, ValueError):  # it has died, or was cancelled
        running.process.stdin.write(asked)
        running.process.stdin.flush()
    ended = False
    with running.process.stdout as told:
        for line in told:
            said = msgspec.json.decode(line)
            ended = said["kind"] != "progress"
            hears(running, said)
            if ended:
                break
    running.process.wait()
    _close(running)
    if not ended:
        code = running.process.returncode
        said = "stopped" if running.cancelled else f"the process died (exit code {code}): start it again"
        hears(running, {"kind": "stopped", "sentence": said})


def _close(running: Running) -> None:
    """End what the process reads; that waits for what is being written."""
    with suppress(OSError):
        running.process.stdin.close()
