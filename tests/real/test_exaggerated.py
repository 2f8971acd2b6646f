"""Real cartoons, captured and exaggerated on their own curves: the snowman's hat from pictures, the rabbit from outlines.

What the filter adds must be seen as animation, not as jitter: a captured curve has noise, and none of it may grow.
"""

from pathlib import Path

import numpy as np

from capture.motion.tracks import CartoonMotion, check
from capture.pictures import overlay
from capture.pictures.encode import write_picture
from mocap.curves import cartoon_curves
from retarget.characters.casts import cast as casting
from retarget.stage import draw2d, footing, staging
from retarget.stage.perform import perform


def test_the_hat_jumps_farther_and_does_not_jitter(data: Path, snowman_hat: CartoonMotion, sheets: Path):
    hat = snowman_hat
    ours = check(cartoon_curves.cartoon(hat, 1.0))
    was, now = _reach(hat), _reach(ours)
    print(
        f"\nhat: width {cartoon_curves.pace(hat):.3f} s, goes {now / was:.2f} times as far, jerk {_jerk(ours, hat):.2f}"
    )
    assert 1.05 < now / was < 2 and _jerk(ours, hat) < 2
    drawing = data / "drawings" / "openclipart" / "tophat_benji_park_01.svg"
    rows = []
    for motion in (hat, ours):
        targets = casting.targets(casting.cast_of(drawing, motion), motion)
        rows += [picture[:330] for picture in draw2d.draw_frames(perform(motion, targets), "#cfe2f3")][:60:6]
    write_picture(sheets / "hat_exaggerated.png", overlay.contact_sheet(rows, columns=10, width=190))


def test_the_rabbit_hops_higher_on_the_same_ground(rabbit: CartoonMotion, sheets: Path):
    ours = check(footing.footed(cartoon_curves.cartoon(rabbit, 1.0), rabbit))
    level = staging.ground(rabbit)
    low = [motion.outline("body")[..., 1].max(axis=1) for motion in (rabbit, ours)]
    print(
        f"\nrabbit: width {cartoon_curves.pace(rabbit):.3f} s, hops {(level - low[0]).max():.0f} px, now {(level - low[1]).max():.0f}, jerk {_jerk(ours, rabbit):.2f}"
    )
    assert (level - low[1]).max() > 1.05 * (level - low[0]).max()
    touches = np.abs(low[0] - level) < 1
    np.testing.assert_allclose(low[1][touches], low[0][touches], atol=0.01)
    assert low[1].max() <= max(level, low[0].max()) + 0.01
    paper = [np.full((512, 512, 3), 235, np.uint8)] * len(rabbit.times)
    rows = [picture for motion in (rabbit, ours) for picture in list(overlay.draw_over(paper, motion))[::4]]
    write_picture(sheets / "rabbit_exaggerated.png", overlay.contact_sheet(rows, columns=len(rows) // 2, width=190))


def _reach(motion: CartoonMotion) -> float:
    """How far its middle goes from its average place, pixels, root mean square."""
    middle = motion.outline(motion.tracks[0].part).mean(axis=1)
    return float(np.sqrt(((middle - middle.mean(axis=0)) ** 2).sum(axis=1).mean()))


def _jerk(ours: CartoonMotion, source: CartoonMotion) -> float:
    """Third differences of ours, times the source's."""
    sizes = [np.abs(np.diff(motion.outline(motion.tracks[0].part), 3, axis=0)).mean() for motion in (ours, source)]
    return float(sizes[0] / sizes[1])
