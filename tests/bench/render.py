"""How quickly pictures are drawn, as ratios to the rates a person needs to judge a motion while it plays."""

from time import thread_time

import numpy as np

from retarget.characters.mesh import mesh
from retarget.characters.meshfiles import Material, Model
from retarget.stage import draw2d

SIZE = (640, 480)


def rows():
    """Frames a second of a 10,000-triangle model, textured and lit, two thirds of the page's height, against 10."""
    return {"meshes.fps_ratio_to_10": _rate(_frames_of_a_model()) / 10}


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
