"""What stands on the stage of a state, for all that looks at it or changes it; what is missing is refused."""

from dataclasses import replace
from itertools import count
from pathlib import Path
from threading import Lock
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion.tracks import CartoonMotion
from retarget.characters.casts.castcheck import checked
from retarget.characters.casts.castfile import Cast
from retarget.workbench import pictures
from retarget.workbench.desks import Seen
from retarget.workbench.folder import filenames
from retarget.workbench.staging import casts, playing
from retarget.workbench.staging.playing import Played
from retarget.workbench.state import State

_numbers = count(1)  # of what is played, so that the page knows one from another
_numbered: WeakKeyDictionary[CartoonMotion, list[tuple[Cast, int]]] = WeakKeyDictionary()
_numbering = Lock()  # for sessions in one process may be several
KEPT = 8  # casts of a motion that are known again


def motion_of(state: State) -> CartoonMotion:
    """The motion that is lent."""
    if state.motion is None:
        raise InputError("there must be a captured motion to be played: capture one first, or open one")
    return state.motion


def cast_of(state: State) -> Cast:
    """Who plays it."""
    motion_of(state)
    if state.cast is None:
        raise InputError("somebody must play: choose a drawing first")
    return state.cast


def played_of(state: State) -> Played:
    """The performance."""
    return playing.play(motion_of(state), cast_of(state))


def with_cast(state: State, cast: Cast) -> State:
    """The state with another cast, if that can be."""
    return replace(state, cast=checked(cast))


def check_frame(state: State, frame: int) -> None:
    """Refuse a frame that the motion does not have."""
    frames = len(motion_of(state).times)
    if frame >= frames:
        raise InputError(f"the motion has frames 0 to {frames - 1}, there is no frame {frame}")


def file_of_key(state: State, part: str, key: str) -> Path:
    """The file of a key's drawing; the page sees none that lies outside the folder."""
    cast = cast_of(state)
    one, drawn = casts.key_of(cast, part, key)
    return inside(state, cast, drawn.drawing or one.drawing)


def inside(state: State, cast: Cast, drawing: str) -> Path:
    """The file of a cast's drawing, which must lie in the folder."""
    return filenames.inside(state.folder, str((cast.folder / drawing).resolve()))


def number_of(state: State) -> int:
    """The same for the same motion and cast, 0 where nothing can be played."""
    motion, cast = state.motion, state.cast
    if motion is None or cast is None:
        return 0
    with _numbering:
        known = _numbered.setdefault(motion, [])
        for who, number in known:
            if who is cast or who == cast:
                return number
        known.insert(0, (cast, next(_numbers)))
        del known[KEPT:]
        return known[0][1]


def png(picture: NDArray) -> Seen:
    """A picture as the page gets it."""
    return Seen("image/png", pictures.png(np.ascontiguousarray(picture)))
