"""The command that lets wind blow over a plant."""

from pathlib import Path

from retarget.commands import flags
from retarget.console import Out, stem, tell


def wind(
    plant: str,
    out: Out = None,
    *,
    drawing: Path | None = None,
    speed: float = 6.0,
    gusts: float = 0.5,
    between: float = 2.5,
    toward: tuple[float, float, float] = (1.0, 0.0, 0.0),
    quick: float = 1.2,
    damping: float = 0.12,
    weight: float = 0.0,
    ground: bool = False,
    seconds: float = 8.0,
    seed: int = 0,
    rate: flags.FilmRate = 24.0,
    size: flags.FilmHeight = 480,
) -> str:
    """Let wind blow over a plant, or over anything that stands in one place: it sways, and its leaves flutter.

    Parameters
    ----------
    plant
        A drawing with marked joints, as in "mocap play", whose first joint is where it grows; a .bvh file; a model with
        a skin (.glb, .gltf); or "flower" or "lamp".
    out
        .mp4, .webm, .mov, .gif or a folder of PNG; .glb; of a drawing also .svg and .json (Lottie), of anything else
        .bvh.  NAME.wind.mp4 beside you if not given.
    drawing
        Another drawing that plays the plant, with joints of the same names.
    speed
        Of the wind, in metres a second: 2 moves leaves, 6 bends stems, 20 is a storm.
    gusts
        0 even, 1 in squalls.
    between
        Seconds from gust to gust.
    toward
        Where it blows to: x (right), y (up) and z (to the viewer).
    quick
        How many times a second the plant sways by itself.
    damping
        How soon that dies away: 1 without swinging back.
    weight
        How heavy it is: 9.8 lets what is bent down fall further.
    ground
        Let what is blown down lie on the floor.
    seconds
        How long.
    seed
        Which gusts.
    """
    import numpy as np

    from capture.errors import InputError
    from mocap.posing.wind import Wind, sway
    from retarget.characters.figures.dancer import read_dancer
    from retarget.commands.onward import write_performed

    if not 16 <= size <= 8192:
        raise InputError(f"a picture must be 16 to 8192 pixels high, got {size}: 480 is usual")
    if not 1 <= rate <= 240 or not 0 < seconds <= 600:
        raise InputError(f"wind must blow for up to 600 seconds at 1 to 240 frames each, got {seconds:g} at {rate:g}")
    if not abs(weight) <= 1000:
        raise InputError(f"a weight must be 0 to 1000 m/s^2, got {weight:g}: 9.8 is the earth's")
    if seed < 0:
        raise InputError(f"a seed must be 0 or more, got {seed}: each number makes other gusts")
    blown = read_dancer(plant)
    tell(f"{plant}: {note}" for note in blown.notes)
    floor = float(blown.places()[:, 1].min()) if ground else None
    air = Wind(speed, toward, gusts, between, seed=seed)
    motion = sway(blown.skeleton, air, seconds, rate, blown.rest, quick, damping, gravity=weight, ground=floor)
    out = out or Path(f"{stem(Path(plant))}.wind.mp4")
    write_performed(motion, blown, out, drawing or blown.drawing, size, None)
    away = np.linalg.norm(motion.positions() - blown.places(), axis=-1)
    tall = max(float(np.ptp(blown.places(), axis=0).max()), 1e-9)
    frame, joint = np.unravel_index(int(away.argmax()), away.shape)
    return (
        f"{out}: {len(motion)} frames at {rate:.4g} a second, blown furthest at frame {frame}: "
        f"{blown.skeleton.names[joint]} by {100 * away[frame, joint] / tall:.0f} % of its height"
    )
