"""Motions lent to drawings: a ball's affine motion, a hat and a dance in key drawings, and a line of action."""

from pathlib import Path

import numpy as np

from capture.fit import action
from capture.motion import tracks
from capture.pictures import lineart
from capture.pictures.clip import Clip, clip_of
from capture.pictures.encode import write_clip
from capture.progress import progress
from fixtures import backdrop, ball, hat, pencil, props, sack, write
from retarget.characters.casts.castcheck import BEND
from retarget.characters.casts.castlist import Cast, CastKey, CastPart
from retarget.demos.shown import Shown, captured, drawn, leave, played, point_errors, write_text
from retarget.stage import plate


def ball_to_pumpkin(folder: Path, zoom: float = 1.0) -> Shown:
    """A ball bounces, squashed and stretched by nothing but affine maps; a pumpkin bounces like it (figure 3)."""
    toon, _, clip, motion = captured(ball.ball(), folder, zoom)
    cast = Cast((CastPart("ball", drawing=_character("pumpkin")),))
    performance = played(cast, motion, folder / "pumpkin.cast.toml")
    made = drawn(performance, backdrop.backdrop(True, ball.GROUND, (0, 0, 0), (214, 150, 84)))
    shown = Shown(clip, made, motion, performance, float(np.median(point_errors(motion, toon))))
    leave(shown, folder)
    return shown


def hat_to_witch_hat(folder: Path, zoom: float = 1.0) -> Shown:
    """A top hat is flung about before a meadow; it is taken out, and a witch hat put in its place (figure 10)."""
    toon, shot, clip, motion = captured(hat.hat(busy=True), folder, zoom)
    keys = tuple(CastKey(key, str(folder / f"witch_hat_{key}.svg")) for key in hat.KEYS)
    for key in keys:
        write_text(Path(key.drawing), props.witch_hat(key.name))
    cast = Cast((CastPart("hat", keys, height=1.1),), ground=False)
    performance = played(cast, motion, folder / "witch_hat.cast.toml")
    made = list(progress(plate.into(performance, shot, motion, clip), "drawing", len(clip)))
    clean = plate.without(shot, motion, ("hat",), clip)
    behind = toon.background.astype(float)
    ghost = float(np.mean([np.abs(clean[t] - behind).mean() for t in range(0, len(clip), 7)]))
    also = f"the meadow behind it is found within {ghost:.2f} of 255"
    shown = Shown(clip, made, motion, performance, float(np.median(point_errors(motion, toon))), also)
    leave(shown, folder)
    return shown


def dance_to_flower(folder: Path, zoom: float = 1.0) -> Shown:
    """A flour sack dances in four key drawings, hops and leaps; a flower dances like it (figure 11)."""
    toon, _, clip, motion = captured(sack.sack(), folder, zoom)
    keys = tuple(CastKey(key, _character(f"flower_{key}")) for key in sack.KEYS)
    cast = Cast((CastPart("sack", keys),))
    performance = played(cast, motion, folder / "flower.cast.toml")
    made = drawn(performance, backdrop.backdrop(True, sack.GROUND, (0, 0, 0), (120, 176, 104)))
    shown = Shown(clip, made, motion, performance, float(np.median(point_errors(motion, toon))))
    leave(shown, folder)
    return shown


def line_to_bottle(folder: Path, zoom: float = 1.0) -> Shown:
    """A pencil test has one line of action a drawing; a bottle bends along it as it leaps (figure 13).

    The lines are found in the drawings; `zoom` is for cartoons in colour and changes nothing here.
    """
    test = clip_of(pencil.frames(), 24.0)
    write_clip(folder / "line.mp4", progress(test, "drawing the pencil test", len(test)), test.fps)
    motion = action.capture_line(_lines(test), most_keys=6, size=test.size)
    tracks.save(motion, folder / "line.motion.json")
    cast = Cast((CastPart("line", drawing=_character("bottle"), between=BEND),))
    performance = played(cast, motion, folder / "bottle.cast.toml")
    made = drawn(performance, backdrop.plain(pencil.GROUND, (240, 226, 206)))
    found = [action.even(line, 60) for line in action.centre_lines(motion.points("line"))]
    off = float(np.median(np.linalg.norm(np.stack(found) - pencil.lines(60), axis=-1)))
    shown = Shown(test, made, motion, performance, off)
    leave(shown, folder)
    return shown


def _lines(test: Clip) -> np.ndarray:
    """The longest pencil line of every drawing (T, 60, 2), from its foot, which stands lower than its top in the first.

    After that a line goes the way of the one before it.  A drawing that is held is looked at once.
    """
    lines: list[np.ndarray] = []
    for t in progress(range(len(test)), "finding the lines", len(test)):
        if t > 0 and np.array_equal(test[t], test[t - 1]):
            lines.append(lines[-1])
            continue
        line = action.even(lineart.pencil_lines(test[t])[0].points, 60)
        before = lines[-1] if lines else np.array([[0.0, 1], [0, 0]])[[0] * 30 + [1] * 30]
        turned = ((line - line.mean(axis=0)) * (before - before.mean(axis=0))).sum() < 0
        lines.append(line[::-1] if turned else line)
    return np.stack(lines)


def _character(name: str) -> str:
    return str(write.CHARACTERS / f"{name}.svg")
