"""How quickly pictures are drawn, as ratios to the rates a person needs to judge a motion while it plays."""

from time import thread_time

import numpy as np

from capture.fit.contour import capture_outlines
from capture.motion import triangulate
from fixtures import frog
from fixtures.write import CHARACTERS
from retarget.characters.drawing import read_drawing
from retarget.characters.picture import DrawnPicture, Layer, halved
from retarget.stage import draw2d
from retarget.stage.perform import perform

SIZE = (640, 480)


def rows():
    """Frames a second at 640 x 480: a vector character against 60, a bent photograph of 5,000 triangles against 30."""
    return {
        "drawing.fps_ratio_to_60": _rate(_frames_of_a_drawing()) / 60,
        "photo.fps_ratio_to_30": _rate(_frames_of_a_photo()) / 30,
    }


def _rate(frames, rounds=3):
    """Frames a second, the best of a few rounds; the first frame, which compiles, is not counted."""
    frames[0]()
    times = []
    for _ in range(rounds):
        start = thread_time()
        for frame in frames:
            frame()
        times.append(thread_time() - start)
    return len(frames) / min(times)


def _frames_of_a_drawing():
    """The bunny in the frog's true motion."""
    toon = frog.frog()
    part = toon.parts[0]
    motion = capture_outlines(part.points, list(part.key_frames), toon.fps, SIZE, part.name)
    files = [CHARACTERS / f"bunny_{name}.svg" for name in part.key_names]
    performance = perform(motion, [read_drawing(part.name, motion.tracks[0].keys, files)])
    return [lambda t=t: draw2d.draw(performance, t, "white") for t in range(0, len(toon), 4)]


def _frames_of_a_photo(triangles=5000):
    """Noise on a round mesh that fills the page and sways."""
    image = np.random.default_rng(0).integers(0, 256, (480, 640, 4)).astype(np.uint8)
    image[..., 3] = 255
    angle = np.linspace(0, 2 * np.pi, 160, endpoint=False)
    outline = [320, 240] + np.stack([250 * np.cos(angle), 200 * np.sin(angle)], axis=-1)
    spacing = np.sqrt(np.pi * 250 * 200 / triangles * 2) * 1.03
    outlines, ring, inside, faces = triangulate.triangulate(outline[None], spacing)
    points = np.vstack([outlines[0], inside])
    layer = Layer(halved(image), points, (640, 480))
    print(f"photo: {len(faces)} triangles")
    frames = []
    for turn in np.linspace(0, 2 * np.pi, 8, endpoint=False):
        swayed = points + np.stack([30 * np.sin(points[:, 1] / 80 + turn), 15 * np.cos(points[:, 0] / 60 + turn)], -1)
        things = [DrawnPicture(swayed, faces, (ring,), ((layer, 1.0),), 1.0)]
        frames.append(lambda things=things: draw2d.draw_things(things, SIZE, "white"))
    return frames
