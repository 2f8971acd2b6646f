"""What is in the gallery: every picture's name, a line on it, the commands that make it, and how it is drawn of them.

Commands run in a folder in which `tooncap fixtures f` has been; what they leave there is drawn small.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from numpy.typing import NDArray

from capture.files import written_beside
from notebooks.gallery import cartoons, skeletons

HERE = Path(__file__).parent
WALK, CAT = "f/walk.bvh f/characters/tomcat.svg --view side", "f/characters/tomcat.svg"
BALL = "demo/ball/ball.motion.json"


@dataclass(frozen=True)
class Moving:
    """A GIF of the gallery."""

    name: str  # of the file, without .gif
    says: str  # what is seen, in one line
    commands: tuple[str, ...]
    draw: Callable[[], list[NDArray]]  # its frames at their size, in the folder in which the commands have run
    fps: float = 24.0
    colours: int = 96
    hold: float = 0.6  # seconds that the last frame stays longer

    @property
    def file(self) -> Path:
        """Where it is kept."""
        return HERE / f"{self.name}.gif"


@dataclass(frozen=True)
class Still:
    """A PNG of the gallery."""

    name: str
    says: str
    commands: tuple[str, ...]

    @property
    def file(self) -> Path:
        """Where it is kept."""
        return HERE / f"{self.name}.png"


def _demo(
    name: str, file: str, says: str, width: int = 320, stacked: bool = True, fps: float = 24.0, **more: int
) -> Moving:
    draw = partial(cartoons.demo, name, width, stacked, round(24 / fps))
    return Moving(file, says, (f"tooncap demo {name}",), draw, fps, **more)


MOVING = (
    Moving(
        "frog_jumps_bunny_jumps",
        "A drawn frog, what was captured of it, and a bunny that jumps like it",
        ("tooncap demo",),
        cartoons.frog_to_bunny,
        colours=36,
    ),
    Moving(
        "keys_and_weights",
        "Four key drawings, and how much of each is in every frame",
        ("tooncap demo",),
        cartoons.keys_and_weights,
        colours=48,
    ),
    _demo("ball", "ball_to_pumpkin", "A ball's affine maps alone: a pumpkin bounces like it"),
    _demo("hat", "hat_to_witch_hat", "Back into its own clip: the hat is taken out, another put in its place", 300),
    _demo(
        "dance",
        "dance_to_flower",
        "A flour sack dances in four key drawings; a flower dances like it",
        420,
        False,
        colours=64,
    ),
    _demo(
        "broom",
        "broom_to_photograph",
        "A broom bends; a photographed cup bends like it, in a train",
        300,
        fps=12,
        colours=56,
    ),
    _demo("line", "line_to_bottle", "A pencil test has one line a drawing; a bottle bends along it", 420, False),
    _demo("walk", "walk_to_model", "A walk in six parts, lent to six 3-D bodies", 280),
    _demo("jump", "jump_to_lamp", "The frog again; a jointed desk lamp takes its key poses", 300),
    Moving(
        "broom_to_flower",
        "A line of action, known in every frame, bends a flower",
        (
            "tooncap contour f/broom.line.json -o line.motion.json",
            "tooncap retarget line.motion.json --drawing f/characters/flower.svg --bend -o flower/",
        ),
        cartoons.broom_to_flower,
        colours=48,
    ),
    Moving(
        "more_of_a_cartoon",
        "As captured, with anticipation and follow-through, and that on twos",
        (
            "tooncap demo ball",
            f"tooncap exaggerate {BALL} --amount 1.5 -o more.motion.json",
            f"tooncap exaggerate {BALL} --amount 1.5 --drawings 12 -o twos.motion.json",
        ),
        cartoons.more_of_a_cartoon,
        colours=64,
    ),
    Moving(
        "kick_of_rubber",
        "Motion capture, and the same made of rubber; the foot still stands",
        ("tooncap mocap exaggerate f/kick.bvh --omega 5 -o kick.rubber.bvh",),
        skeletons.kick_of_rubber,
        fps=20.0,
        hold=0.0,
        colours=48,
    ),
    Moving(
        "rubber_on_a_drawing",
        "A drawing with marked joints walks it, stiff and of rubber",
        (
            f"tooncap mocap play {WALK} --rate 20 --seconds 2 --stiff -o stiff/",
            f"tooncap mocap play {WALK} --rate 20 --seconds 2 -o rubber/",
        ),
        skeletons.rubber_on_a_drawing,
        fps=20.0,
        colours=20,
    ),
    Moving(
        "analogy",
        "A walk is to sneaking as a kick is to what?",
        ("tooncap mocap analogy f/walk.bvh f/sneak.bvh f/kick.bvh -o made.bvh",),
        skeletons.analogy,
        fps=15.0,
        hold=0.0,
        colours=32,
    ),
    Moving(
        "spring_posing",
        "Joints are dragged, the rest hangs on springs, both feet are pinned",
        (
            'tooncap mocap pose f/kick.bvh --pin LeftFoot --pin RightFoot --by "RightHand -0.35 0.8 0.2" '
            '--by "Hips 0.12 -0.28 0.05" -o pose.bvh',
        ),
        skeletons.spring_posing,
        hold=0.8,
        colours=48,
    ),
    Moving(
        "dance_on_the_beat",
        "A dance made up from a pool of postures, in one on every beat that has one",
        (f"tooncap mocap dance --bpm 110 --beats 9 --seed 2 --rate 12 --drawing {CAT} -o dance/",),
        skeletons.dance_on_the_beat,
        hold=0.0,
        colours=32,
        fps=12.0,
    ),
    Moving(
        "flower_in_the_wind",
        "Gusts of wind, and a plant that sways in its slowest modes",
        ("tooncap mocap wind f/characters/flower.marks.toml --speed 16 --gusts 0.9 --seconds 4 -o wind/",),
        skeletons.flower_in_the_wind,
        hold=0.0,
        colours=28,
    ),
)
DESKS = (
    Still(
        "desk_capture",
        "The capture desk: a part, its keys, and how well it was followed",
        ("tooncap workbench frog.mp4",),
    ),
    Still("desk_stage", "The stage desk: who plays, and what comes of it", ("tooncap workbench frog.motion.json",)),
    Still("desk_posing", "The posing desk: joints, postures and beats", ("tooncap workbench kick.bvh",)),
)
FIRST = Still("frog_to_bunny", "source, proof and new drawing", ("tooncap demo",))
"""The one picture above everything."""


def everything() -> list[Moving | Still]:
    """All pictures, in their order."""
    return [FIRST, *MOVING, *DESKS]


def section() -> str:
    """What the README says of them."""
    lines = [
        "Made by `make gallery`, and by nothing else; the commands run where `tooncap fixtures f` has been.",
        "",
        "| | |",
        "|:---:|:---:|",
    ]
    for left, right in zip(MOVING[::2], [*MOVING[1::2], None] if len(MOVING) % 2 else MOVING[1::2], strict=True):
        lines += [_row(left, right, _picture), _row(left, right, _words)]
    lines += ["", "| | | |", "|:---:|:---:|:---:|"]
    lines += ["| " + " | ".join(told(desk) for desk in DESKS) + " |" for told in (_picture, _words)]
    return "\n".join(lines)


def write_section(readme: Path) -> None:
    """Put the section in the place of the README's."""
    before, heading, rest = readme.read_text(encoding="utf-8").partition("\n## Gallery\n")
    after = rest[rest.index("\n## ") :]
    text = f"{before}{heading}\n{section()}\n{after}"
    if text != readme.read_text(encoding="utf-8"):
        with written_beside(readme) as temporary:
            Path(temporary).write_text(text, encoding="utf-8")


def _row(left: Moving, right: Moving | None, told: Callable[[Moving], str]) -> str:
    return f"| {told(left)} | {told(right) if right else ''} |"


def _picture(one: Moving | Still) -> str:
    return f"![{one.says}](notebooks/gallery/{one.file.name})"


def _words(one: Moving | Still) -> str:
    return "<br>".join([one.says, *(f"`{command}`" for command in one.commands)])
