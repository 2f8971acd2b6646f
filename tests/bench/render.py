"""How quickly pictures are drawn, as ratios to the rates a person needs to judge a motion while it plays."""

from time import thread_time

import numpy as np

from capture.fit.contour import capture_outlines
from capture.motion import triangulate
from fixtures import frog
from fixtures.write import CHARACTERS
from retarget.characters.drawings.drawing import read_drawing
from retarget.characters.models.mesh import mesh
from retarget.characters.models.model import Material, Model
from retarget.characters.photos.picture import DrawnPicture, Layer, halved
from retarget.stage import draw2d
from retarget.stage.perform import perform

SIZE = (640, 480)


def rows():
    """Frames a second at 640 x 480, as ratios.

    A vector character against 60, a bent photograph of 5,000 triangles against 30, a lit and textured model of 10,000
    against 10.
    """
    return {
        "drawing.fps_ratio_to_60": _rate(_frames_of_a_drawing()) / 60,
        "photo.fps_ratio_to_30": _rate(_frames_of_a_photo()) / 30,
        "meshes.fps_ratio_to_10": _rate(_frames_of_a_model()) / 10,
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


def _frames_of_a_model():
    """A lumpy ball of 71 x 142 fields that turns before the viewer."""
    rings = 71
    v, u = np.meshgrid(np.linspace(0, np.pi, rings + 1), np.linspace(0, 2 * np.pi, rings + 1), indexing="ij")
    lumps = 1 + 0.1 * np.sin(5 * u) * np.sin(v) ** 2
    points = (lumps[..., None] * np.stack([np.sin(v) * np.sin(u), -np.cos(v), np.sin(v) * np.cos(u)], -1)).reshape(
        -1, 3
    )
    corner = (np.arange(rings)[:, None] * (rings + 1) + np.arange(rings)).ravel()
    below = corner + rings + 1
    faces = np.concatenate([np.stack([corner, below, below + 1], -1), np.stack([corner, below + 1, corner + 1], -1)])
    picture = np.random.default_rng(0).integers(0, 256, (512, 512, 4)).astype(np.uint8)
    uv = np.column_stack([u.ravel() / (2 * np.pi), v.ravel() / np.pi])
    look = Material((1.0, 1.0, 1.0, 1.0), picture)
    target = mesh("ball", ("rest",), Model(points, faces, (look,), np.zeros(len(faces), int), uv), points[None])
    frames = []
    for angle in np.linspace(0, 2 * np.pi, 8, endpoint=False):
        turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
        placed = 160 * points @ turn.T + [320, 240, 0]
        things = target.posed(placed, np.ones(1), 160.0)
        frames.append(lambda things=things: draw2d.draw_things(things, SIZE, "white"))
    print(f"meshes: {len(faces)} triangles")
    return frames
