"""The process that long work runs in: arguments come in as a line of JSON, progress and the result go out as lines.

When its input ends, because somebody cancels or because the workbench is gone, the work is interrupted as by a key:
a capture then keeps what it has done.
"""

import os
import sys
from threading import Event, Thread
from time import sleep
from typing import Any

GRACE = 1.5  # seconds from the end of the input to the interrupt
LAST = 15.0  # seconds from there to the end, come what may: nobody else would end it when the workbench is gone


def main() -> None:
    """Do the work that the first line of the input asks for."""
    import _thread

    import msgspec

    from capture.errors import InputError
    from capture.progress import listening
    from retarget.workbench import desks
    from retarget.workbench.tables import DESKS

    out = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # what a library prints must not be taken for an answer

    def say(kind: str, **said: Any) -> None:
        out.write(msgspec.json.encode({"kind": kind, **said}) + b"\n")

    over = Event()

    def heard(label: str, done: int, total: int | None) -> None:
        if over.is_set():
            raise KeyboardInterrupt
        say("progress", label=label, done=done, total=total)

    def until_it_ends() -> None:
        os.read(0, 1)
        over.set()
        sleep(GRACE)  # compiled code takes an interrupt badly: first it may stop by itself
        _thread.interrupt_main()
        sleep(LAST)
        os._exit(130)

    asked = msgspec.json.decode(sys.stdin.buffer.readline())
    Thread(target=until_it_ends, daemon=True).start()
    try:
        with listening(heard):
            say("result", **desks.find(DESKS, "work", asked["work"]).run(**asked["arguments"])._asdict())
    except InputError as error:
        say("refused", sentence=str(error))
    except (KeyboardInterrupt, BrokenPipeError):
        os._exit(130)  # the thread still waits for input
    except Exception as error:
        if over.is_set():  # what an interrupt became on its way
            os._exit(130)
        import traceback

        traceback.print_exc()
        say("refused", sentence=f"this went wrong, and is a fault of tooncap: {error!r}")
    os._exit(0)


if __name__ == "__main__":
    main()
