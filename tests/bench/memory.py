"""Memory of captures of long clips, 1280 x 720: its peak, and how it grows with the frames.

Each capture runs in a process of its own, on a video that is encoded on the fly with rare key frames.
"""

import subprocess
import sys
import tempfile
from fractions import Fraction
from pathlib import Path

import numpy as np

SIZE, FPS = (1280, 720), 30
LENGTHS = (600, 2400)  # frames
TEN_MINUTES = 10 * 60 * FPS  # frames
CORNERS = np.array([[-60.0, -45], [60, -45], [60, 15], [15, 45], [-60, 45]])

CAPTURE = """
import sys, time
import numpy as np
from capture.fit import video
from capture.pictures.shot import read_shot
shot, kept = read_shot(sys.argv[1]), sys.argv[2]
start = time.process_time()
motion = video.capture(shot, keep=kept)
spent = time.process_time() - start
status = dict(line.split(":", 1) for line in open("/proc/self/status"))
lost = sum(int((~track.visible).sum()) for track in motion.tracks)
print(float(status["VmHWM"].split()[0]) / 1024, len(motion.times) / spent, lost)
"""


def rows():
    """Peak MiB by length, MiB for each 1,000 frames more, what ten minutes come to, and frames a second."""
    found = {frames: measured(frames) for frames in LENGTHS}
    (short, long), peaks = LENGTHS, {frames: peak for frames, (peak, _, _) in found.items()}
    slope = (peaks[long] - peaks[short]) / (long - short)
    figures = {f"{frames}_frames_peak_mib": peak for frames, peak in peaks.items()}
    figures["mib_per_1000_frames"] = 1000 * slope
    figures["ten_minutes_peak_mib"] = peaks[long] + max(slope, 0) * (TEN_MINUTES - long)
    figures["fps"], figures["lost"] = found[long][1:]
    return figures


def measured(frames):
    """Peak MiB, frames a second of processor time and frames lost of a capture from a key in the clip's middle."""
    with tempfile.TemporaryDirectory() as folder:
        shot = encoded(Path(folder), frames)
        done = subprocess.run(
            [sys.executable, "-c", CAPTURE, shot, Path(folder, "kept.part")],
            stdout=subprocess.PIPE, text=True, check=True, cwd=Path(__file__).parents[2],
        )  # fmt: skip
    return tuple(float(word) for word in done.stdout.split())


def encoded(folder, frames):
    """A video of a patch that goes round over a painted background, on twos, and its shot file; returns the latter."""
    import av

    from capture.pictures.shot import KeyDrawing, Part, Shot, write_shot

    options = {"preset": "ultrafast", "x264-params": "keyint=250:scenecut=0"}
    with av.open(str(folder / "long.mp4"), "w") as container:
        stream = container.add_stream("libx264", rate=FPS, options=options)
        stream.width, stream.height, stream.pix_fmt = *SIZE, "yuv420p"
        for t in range(frames):
            picture = av.VideoFrame.from_ndarray(drawn(t), format="rgb24")
            picture.pts, picture.time_base = t, Fraction(1, FPS)
            container.mux(stream.encode(picture))
        container.mux(stream.encode(None))
    middle = frames // 2
    key = KeyDrawing("middle", middle, tuple(map(tuple, (where(middle) + CORNERS).tolist())))
    write_shot(Shot(str(folder / "long.mp4"), (Part("patch", (key,)),)), folder / "long.shot.toml")
    return folder / "long.shot.toml"


def where(t):
    """The middle of the patch in frame t."""
    angle = 0.08 * (t // 2)
    return np.array([640 + 400 * np.cos(angle), 360 + 220 * np.sin(angle)])


def drawn(t):
    """Frame t (720, 1280, 3)."""
    import cv2

    picture = BACKGROUND.copy()
    for colour, scale in (((40, 110, 60), 1.0), ((220, 190, 60), 0.5), ((30, 50, 90), 0.2)):
        corners = np.rint((where(t) + scale * CORNERS) * 16).astype(np.int32)
        cv2.fillPoly(picture, [corners], colour, cv2.LINE_AA, 4)
    return picture


def _background():
    from fixtures.backdrop import backdrop

    small = backdrop(True, 418.0, (236, 240, 232), (222, 72, 58))
    return np.ascontiguousarray(np.tile(small, (2, 2, 1))[: SIZE[1], : SIZE[0]])


BACKGROUND = _background()
