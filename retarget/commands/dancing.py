"""The command that lets a skeleton dance."""

from pathlib import Path
from typing import TYPE_CHECKING

from retarget.commands import flags
from retarget.commands.onward import write_performed
from retarget.console import Out, stem, tell

if TYPE_CHECKING:
    from mocap.posing.beats import Beats
    from mocap.posing.choreography import Dance
    from mocap.posing.postures import Pool
    from retarget.characters.figures.dancer import Dancer


def dance(
    music: Path | None = None,
    out: Out = None,
    *,
    bpm: float | None = None,
    beats: int = 32,
    every: bool = False,
    skeleton: str = "human",
    postures: Path | None = None,
    steps: Path | None = None,
    seed: int = 0,
    extent: float = 1.0,
    quick: float = 2.2,
    damping: float = 0.8,
    clumsy: float = 0.0,
    stiff: float = 0.0,
    wild: float = 0.0,
    rate: flags.FilmRate = 24.0,
    drawing: Path | None = None,
    size: flags.FilmHeight = 480,
    silent: bool = False,
) -> str:
    """Let a skeleton dance to music: its elastic joints are in a posture on every beat that has one.

    Parameters
    ----------
    music
        A .mid file or a recording (.wav, .mp3, .ogg, .flac, ...); without it there are as many beats as --beats says,
        at the tempo of --bpm.
    out
        .bvh; .glb; .mp4, .webm or .mov with the music as sound, .gif or a folder of PNG; .dance.toml writes the
        choreography, made up or not, to be edited, and .postures.json the pool.  NAME.dance.mp4 beside you if not
        given.
    bpm
        Beats a minute, where there is no music: 120.
    beats
        How many of them.
    every
        Dance every beat of quick music; without it every second one above 135 a minute.
    skeleton
        Who dances: a .bvh file, a model with a skin (.glb, .gltf), a drawing with marked joints that need not be a
        figure, or "human", "flower" or "lamp".
    postures
        A pool, .postures.json; without it one that is made for the skeleton.
    steps
        A choreography, .dance.toml; without it one is made up.
    seed
        Which one is made up.
    extent
        How far all postures go: 0.5 half as far, 1.5 farther.
    quick
        How many times a second joints would swing by themselves.
    damping
        How soon that dies away: 1 without a swing over, 0.4 wobbly.
    clumsy
        -1 brisk to 1 clumsy.
    stiff
        -1 soft to 1 stiff.
    wild
        -1 calm to 1 wild.
    drawing
        A drawing with marked joints that dances, as in "mocap play".
    silent
        Leave the sound out.
    """
    from capture.errors import InputError
    from mocap.posing.beats import danced as heeded
    from mocap.posing.choreography import unrolled, write_dance
    from mocap.posing.dance import danced
    from mocap.posing.elastic import felt, styled
    from mocap.posing.postures import write_pool
    from retarget.characters.figures.dancer import read_dancer

    if not 16 <= size <= 8192:
        raise InputError(f"a picture must be 16 to 8192 pixels high, got {size}: 480 is usual")
    heard = _beats(music, bpm, beats)
    taken = heard if every else heeded(heard)
    if taken is not heard:
        tell([f"{heard.bpm:.0f} beats a minute are quick: every second one is danced (--every dances all)"])
    dancer = read_dancer(skeleton)
    tell(f"{skeleton}: {note}" for note in dancer.notes)
    pool, choreography = _told(postures, steps, dancer, len(taken.times), seed)
    out = out or Path(f"{stem(music) if music else Path(skeleton).stem}.dance.mp4")
    if out.name.endswith(".dance.toml"):
        write_dance(choreography, out)
        return f"{out}: {len(choreography.phrases)} phrases, {choreography.beats:g} beats"
    if out.name.endswith(".postures.json"):
        write_pool(pool, out)
        return f"{out}: {len(pool.postures)} postures of a {pool.kind or 'figure'}"
    springs = styled(felt(quick, damping), clumsy, stiff, wild)
    motion = danced(dancer.skeleton, pool, choreography, taken, rate, springs, extent, dancer.rest)
    write_performed(motion, dancer, out, drawing or dancer.drawing, size, None if silent else (music, heard))
    count = len({step.beat for step in unrolled(choreography, len(taken.times) - 1)})
    return (
        f"{out}: {len(motion)} frames at {rate:.4g} a second, {count} postures on {len(taken.times)} beats, "
        f"{taken.bpm:.1f} a minute"
    )


def _beats(music: Path | None, bpm: float | None, count: int) -> "Beats":
    from capture.errors import InputError
    from mocap.posing.beats import read_beats, steady

    if music is not None:
        if bpm is not None:
            raise InputError(f"{music} has a tempo of its own: give the music, or --bpm, not both")
        return read_beats(music)
    if not 1 <= count <= 10_000:
        raise InputError(f"there must be 1 to 10000 beats, got {count}: 32 are four phrases")
    bpm = 120.0 if bpm is None else bpm
    return steady(bpm, count * 60 / bpm - 1e-6) if 0 < bpm < 1e9 else steady(bpm, 1.0)


def _told(postures: Path | None, steps: Path | None, dancer: "Dancer", beats: int, seed: int) -> "tuple[Pool, Dance]":
    """The pool and the choreography that are given, or made."""
    from mocap.posing.choreography import read_dance
    from mocap.posing.invent import invented
    from mocap.posing.postures import read_pool
    from mocap.posing.starting import starting_pool

    pool = read_pool(postures) if postures else starting_pool(dancer.skeleton, dancer.rest)
    return pool, read_dance(steps) if steps else invented(pool, dancer.skeleton, beats, seed, dancer.rest)
