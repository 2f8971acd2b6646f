"""The gallery's cartoons: what the demos and the road from a clip to a new drawing leave, drawn small."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from capture.motion import tracks
from capture.motion.tracks import CartoonMotion
from capture.pictures import overlay
from capture.pictures.decode import read_clip
from fixtures import backdrop, ball, broom
from notebooks.gallery import small
from retarget.characters.casts import cast, castfile
from retarget.stage import draw2d, staging
from retarget.stage.perform import perform

INK, PALE, PAPER = "#2b2b2b", "#c9c6bd", (250, 249, 246)
DEMO = Path("demo")


def demo(name: str, width: int, stacked: bool, step: int = 1) -> list[NDArray]:
    """The source and what was made of it, of the demo of that name."""
    source, made = small.cut(panels(DEMO / name / "demo.mp4", 2, step))
    return small.scaled((small.above if stacked else small.beside)(source, made), width)


def frog_to_bunny() -> list[NDArray]:
    """The source, the proof and the new drawing, one below the other."""
    return small.scaled(small.above(*_frog()), 260)


def frog_to_bunny_still() -> NDArray:
    """The same three beside each other, at three moments below each other."""
    wide = small.beside(*_frog())
    return np.concatenate(small.scaled([wide[t] for t in (14, 26, 38)], 1200))


def broom_to_flower() -> list[NDArray]:
    """A broom with its line of action, and the flower that bends along that line."""
    toon = broom.broom()
    flower = read_clip("flower")
    lined = [_with_line(toon.frame(t), toon.line[t]) for t in range(len(toon))]
    paper = backdrop.plain(broom.GROUND, (240, 234, 222))
    bent = [_laid(frame, paper) for frame in flower]
    return small.scaled(small.above(*small.cut([lined, bent])), 300)


def more_of_a_cartoon() -> list[NDArray]:
    """A pumpkin as it was captured, exaggerated, and exaggerated on twos."""
    said = {
        DEMO / "ball/ball.motion.json": "captured",
        Path("more.motion.json"): "more",
        Path("twos.motion.json"): "on twos",
    }
    behind = backdrop.plain(ball.GROUND, (244, 234, 214))
    clips = [_played(tracks.load(file), DEMO / "ball/pumpkin.cast.toml", behind) for file in said]
    shown = [small.scaled(clip, 320) for clip in small.cut(clips)]
    return small.above(*(small.named(clip, name) for clip, name in zip(shown, said.values(), strict=True)))


def keys_and_weights() -> list[NDArray]:
    """The frog with its outline; its key drawings, each as dark as its weight; and the weights over time."""
    motion = tracks.load(DEMO / "frog.motion.json")
    return small.above(small.scaled(_frog()[1], 300), _charts(motion, (300, 240)))


def panels(file: Path, count: int, step: int = 1) -> list[list[NDArray]]:
    """A clip that shows so many side by side, taken apart; of its frames every `step`-th."""
    frames = [frame[..., :3] for frame in read_clip(file)][::step]
    wide = frames[0].shape[1] // count
    return [[frame[:, n * wide : (n + 1) * wide] for frame in frames] for n in range(count)]


def _frog() -> list[list[NDArray]]:
    """Source, proof and new drawing of the main demo, cut to where the animals are."""
    clips = panels(DEMO / "demo.mp4", 3)
    return small.cut(clips, by=clips[::2])


def _charts(motion: CartoonMotion, size: tuple[int, int]) -> list[NDArray]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    track, keyset = motion.tracks[0], motion.keysets[0]
    weights, colors = track.key_weights(), np.array(overlay.COLORS) / 255
    figure = Figure(figsize=(size[0] / 100, size[1] / 100), dpi=100, facecolor=np.array(PAPER) / 255)
    canvas = FigureCanvasAgg(figure)
    bodies = []
    reach = 0.54 * max(np.ptp(points, axis=0).max() for points in keyset.points)
    for k, name in enumerate(track.keys):
        axis = figure.add_axes((k / len(track.keys), 0.53, 1 / len(track.keys), 0.4))
        outline = keyset.points[k][keyset.outline]
        bodies += axis.fill(*outline.T, facecolor=colors[k], edgecolor=INK, linewidth=1)
        x, y = 0.5 * (outline.min(axis=0) + outline.max(axis=0))
        axis.set(xlim=(x - reach, x + reach), ylim=(y + reach, y - reach), aspect="equal")
        axis.axis("off")
        figure.text((k + 0.5) / len(track.keys), 0.95, name, ha="center", va="center", fontsize=8.5, color=INK)
    chart = figure.add_axes((0.07, 0.09, 0.9, 0.4), facecolor="none")
    for k, color in enumerate(colors[: len(track.keys)]):
        chart.plot(weights[:, k], color=color, linewidth=0.8, alpha=0.3)
    lines = [chart.plot([], [], color=color, linewidth=2)[0] for color in colors[: len(track.keys)]]
    dots = [chart.plot([], [], "o", color=color, markersize=4.5)[0] for color in colors[: len(track.keys)]]
    chart.set(xlim=(-1, len(weights)), ylim=(-0.2, 1.15), yticks=(0, 1), xticks=())
    chart.tick_params(labelsize=8, color=PALE, labelcolor=INK)
    for side, spine in chart.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set_color(PALE)
    chart.axhline(0, color=PALE, linewidth=0.8)
    made = []
    for t, row in enumerate(weights):
        for k, weight in enumerate(row):
            bodies[k].set_alpha(float(np.clip(weight, 0.04, 1)))
            lines[k].set_data(np.arange(t + 1), weights[: t + 1, k])
            dots[k].set_data([t], [weight])
        canvas.draw()
        made.append(np.asarray(canvas.buffer_rgba())[..., :3].copy())
    return made


def _played(motion: CartoonMotion, played_by: Path, behind: NDArray) -> list[NDArray]:
    chosen = castfile.read_cast(played_by)
    performance = staging.stand(perform(motion, cast.targets(chosen, motion)), motion)
    return list(draw2d.draw_frames(performance, behind))


def _with_line(frame: NDArray, line: NDArray) -> NDArray:
    import cv2

    picture = np.ascontiguousarray(frame)
    points = np.round(line * 16).astype(np.int32)
    cv2.polylines(picture, [points], False, (255, 255, 255), 7, cv2.LINE_AA, 4)
    cv2.polylines(picture, [points], False, overlay.COLORS[0], 4, cv2.LINE_AA, 4)
    return picture


def _laid(frame: NDArray, paper: NDArray) -> NDArray:
    """A frame with alpha over a page, from the top left on, as far as both go."""
    page = paper.copy()
    height, width = np.minimum(frame.shape[:2], page.shape[:2])
    seen, frame = page[:height, :width], frame[:height, :width]
    alpha = frame[..., 3:] / 255
    seen[:] = np.rint(frame[..., :3] * alpha + seen * (1 - alpha))
    return page
