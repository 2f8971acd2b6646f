"""The command that makes a captured cartoon more of a cartoon."""

from pathlib import Path

from retarget.commands import flags
from retarget.console import Out, stem


def exaggerate(
    motion: Path,
    out: Out = None,
    *,
    amount: flags.Amount = 1.0,
    seconds: flags.Move = None,
    anticipation: flags.Before = 1.0,
    overshoot: flags.After = 1.0,
    follow: float = 0.04,
    away: float = 1.0,
    ease: flags.Ease = 0.0,
    drawings: flags.Drawings = None,
    slide: flags.Slide = False,
) -> str:
    """Exaggerate a captured motion: anticipation, follow-through, more squash, quicker moves between longer poses.

    Parameters
    ----------
    motion
        The *.motion.json that was captured.
    out
        The *.motion.json to write.
    follow
        Seconds that each part comes later than the one it hangs on.
    away
        Besides: how many times as far as it is from its average the motion goes.
    """
    import numpy as np

    from capture.motion import tracks
    from mocap.curves import cartoon_curves, timing
    from retarget.stage import footing, staging

    source = tracks.load(motion)
    out = out or Path(stem(motion) + ".exaggerated.motion.json")
    ours = source
    if away != 1:
        ours = cartoon_curves.exaggerated(ours, away)
    if amount:
        ours = cartoon_curves.cartoon(ours, amount, seconds, follow, anticipation, overshoot)
    if not slide:
        ours = footing.footed(ours, source)
    moved = {t.part: np.abs(ours.outline(t.part) - source.outline(t.part)).max(axis=(1, 2)) for t in source.tracks}
    if ease:
        feet = {frame for contact in staging.contacts(source) for frame in (contact.start, contact.stop - 1)}
        paths = np.hstack([source.outline(t.part).reshape(len(source.times), -1) for t in source.tracks])
        ours = timing.played_drawings(ours, timing.eased(paths, source.fps, ease, sorted(feet)))
    if drawings is not None:
        ours = timing.played_drawings(ours, timing.on_twos(len(source.times), source.fps, drawings))
    tracks.save(ours, out)
    part = max(moved, key=lambda name: moved[name].max())
    frame = int(np.argmax(moved[part]))
    return f"{out}: {len(source.times)} frames, moved by up to {moved[part][frame]:.0f} px at frame {frame} ({part})"
