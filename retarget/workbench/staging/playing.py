"""The performance of a motion by a cast, as the page sees it: by the code that exports it, the latest ones kept."""

from collections.abc import Callable
from dataclasses import replace
from threading import RLock
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from capture.motion.tracks import CartoonMotion
from retarget.characters.casts import cast as casting
from retarget.characters.casts.castlist import Cast, files_of
from retarget.characters.target import Target
from retarget.stage.perform import Performance

KEPT = 6  # performances, and casts whose drawings are learnt

_work = RLock()  # one at a time: learning a drawing twice at once would only take longer
_learnt: list[tuple[CartoonMotion, Cast, list[float], Any]] = []
_played: list[tuple[CartoonMotion, Cast, list[float], Any]] = []


class Played(NamedTuple):
    """A performance and what is behind it."""

    performance: Performance
    background: Any  # as `draw2d.draw` takes it
    said: str  # how far feet slide, or nothing
    notes: tuple[str, ...]  # what readers of drawings have to say


def play(motion: CartoonMotion, cast: Cast) -> Played:
    """The performance, made anew only where motion, cast or one of its files changed."""
    from retarget.stage.direct import direct
    from retarget.stage.perform import perform

    def made() -> Played:
        actors = [_placed(actor, cast) for actor in learnt(motion, cast)]
        performance, slid = direct(perform(motion, actors), cast, motion)
        notes = tuple(note for actor in actors for note in getattr(actor, "notes", ()))
        moved = slid is not None and max(slid.before, slid.after) >= 0.05
        return Played(performance, casting.backdrop(cast), str(slid) if moved else "", notes)

    return _kept(_played, motion, cast, made)


def learnt(motion: CartoonMotion, cast: Cast) -> list[Target]:
    """The cast's drawings as targets of height 1; that takes seconds, and is done once for a set of drawings."""
    parts = tuple(replace(part, height=1.0, pivot=None, order=None) for part in cast.parts)
    bodies = tuple(replace(body, height=1.0, order=None) for body in cast.bodies)
    who = Cast(parts, folder=cast.folder, bodies=bodies)
    return _kept(_learnt, motion, who, lambda: casting.targets(who, motion))


def picture(played: Played, t: int) -> NDArray:
    """Frame t (H, W, 3) as an mp4 of it would show: over white where nothing is behind."""
    from capture.pictures.encode import over
    from retarget.stage import draw2d

    with _work:
        drawn = draw2d.draw(played.performance, t, played.background)
    return over(drawn)


def _placed(actor: Target, cast: Cast) -> Target:
    """A learnt target, as tall as the cast says and turning where it says."""
    inner = getattr(getattr(actor, "inner", None), "part", None)
    for body in cast.bodies:
        if body.drawing == inner:
            return replace(actor, height=body.height)
    part = next(part for part in cast.parts if part.name == actor.part)
    return replace(actor, height=part.height, pivot=None if part.pivot is None else np.array(part.pivot, float))


def _kept(kept: list, motion: CartoonMotion, cast: Cast, make: Callable[[], Any]) -> Any:
    with _work:
        files = [file.stat().st_mtime if file.exists() else 0.0 for file in files_of(cast)]
        for entry in kept:
            if entry[0] is motion and entry[1] == cast and entry[1].folder == cast.folder and entry[2] == files:
                return entry[3]
        made = make()
        kept.insert(0, (motion, cast, files, made))
        del kept[KEPT:]
        return made
