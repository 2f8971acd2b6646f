"""`tooncap mocap wind`: a drawing, a model or a skeleton stands in the wind; and sheets of all that dances on drawings."""

from pathlib import Path

import numpy as np
import pytest

from capture.pictures.decode import read_clip
from capture.pictures.encode import write_picture
from fixtures.write import CHARACTERS
from mocap import sticks
from mocap.bodies.body import find_body
from mocap.posing.postures import posed, turns_of
from mocap.posing.standing import stood
from mocap.posing.starting import starting_pool
from mocap.skeletons.bvh import read_bvh
from retarget import cli
from retarget.characters.figures.dancer import read_dancer

FLOWER = CHARACTERS / "flower.marks.toml"
SHEETS = Path(__file__).resolve().parents[2] / "out" / "posing"


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def wind(*given):
    return cli.main(["mocap", "wind", *map(str, given)])


def ink(picture):
    """Where a picture is drawn on, by columns in its upper and its lower third."""
    drawn = np.abs(picture.astype(int) - picture[0, 0]).max(axis=-1) > 60
    third = len(drawn) // 3
    return [float(np.nonzero(half)[1].mean()) for half in (drawn[:third], drawn[-third:])]


def test_a_drawing_leans_with_an_even_wind_whichever_way_it_blows_and_stays_rooted():
    for way, sign in ((1, 1), (-1, -1)):
        blown = ("--gusts", 0, "--speed", 9, "--damping", 0.8, "--toward", way, 0, 0)
        assert wind(FLOWER, "-o", f"to{way}.gif", "--seconds", 0.2, "--size", 200, *blown) == 0
        assert wind(FLOWER, "-o", "still.gif", "--seconds", 0.2, "--size", 200, "--speed", 0) == 0
        pictures = [read_clip(name)[2] for name in (f"to{way}.gif", "still.gif")]
        width = min(picture.shape[1] for picture in pictures)
        blown_at, still_at = (ink(picture[:, :width]) for picture in pictures)
        head, foot = (blown_at[k] - still_at[k] for k in (0, 1))
        assert sign * (head - foot) > 3


def test_the_same_wind_blows_over_skeletons_and_models(capsys):
    assert wind("flower", "-o", "a.bvh", "--seconds", 1, "--speed", 12) == 0
    assert "24 frames at 24 a second, blown furthest at frame" in capsys.readouterr().out
    places = read_bvh("a.bvh").positions()
    assert np.ptp(places[:, 0], axis=0).max() < 1e-6 and np.ptp(places, axis=0).max() > 0.02
    assert wind("a.bvh", "-o", "b.glb", "--seconds", 0.5) == 0
    assert wind("lamp", "-o", "c.gif", "--seconds", 0.5, "--size", 64, "--ground", "--weight", 9.8) == 0
    assert len(read_clip("c.gif")) == 12


def test_a_drawing_is_a_skeleton_of_its_own_a_metre_tall():
    blown = read_dancer(str(CHARACTERS / "desk_lamp.svg"))
    assert np.ptp(blown.places(), axis=0).max() == pytest.approx(1) and blown.places()[0] == pytest.approx([0, 0, 0])
    assert blown.skeleton.names == ("base", "hinge", "elbow", "neck", "shade", "bulb")


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["none.svg"], "none.svg"),
        (["dog"], "human, flower, lamp"),
        ([FLOWER, "--speed", "-1"], "speed"),
        ([FLOWER, "--speed", "nan"], "speed"),
        ([FLOWER, "--toward", "0", "0", "0"], "blow to somewhere"),
        ([FLOWER, "--between", "0"], "between gusts above 0"),
        ([FLOWER, "--quick", "0"], "above 0"),
        ([FLOWER, "--damping", "-0.1"], "0 or more"),
        ([FLOWER, "--seconds", "0"], "seconds"),
        ([FLOWER, "--seconds", "nan"], "seconds"),
        ([FLOWER, "--rate", "0"], "1 to 240"),
        ([FLOWER, "--weight", "nan"], "weight"),
        ([FLOWER, "--seed", "-1"], "0 or more"),
        ([FLOWER, "-o", "a.bvh"], "holds a skeleton"),
        ([FLOWER, "-o", "a.xyz"], "must end in"),
        ([CHARACTERS / "bottle.svg"], "joints marked"),
    ],
)
def test_what_cannot_blow_is_said_in_one_line_and_nothing_is_written(here, capsys, given, said):
    out = [] if "-o" in given else ["-o", "a.gif"]
    assert wind(*given, *out, "--size", 64) == 2
    told = capsys.readouterr().err.strip().splitlines()
    assert said in told[-1] and told[-1].startswith("tooncap: ")
    assert not list(here.iterdir())


@pytest.mark.parametrize("who", ["tomcat", "desk_lamp", "flower"])
def test_sheets_of_a_human_and_a_lamp_that_dance_and_a_plant_in_wind(who):
    """For a person to see, in out/posing: sixteen moments each, on drawings."""
    if who == "tomcat":
        drawn = ("dance", "--drawing", CHARACTERS / "tomcat.svg", "--beats", 8, "--seed", 3)
    elif who == "desk_lamp":
        drawn = ("dance", "--skeleton", CHARACTERS / "desk_lamp.svg", "--beats", 8)
    else:
        drawn = ("wind", FLOWER, "--seconds", 4, "--speed", 9)
    command, *given = map(str, drawn)
    assert cli.main(["mocap", command, *given, "-o", "film.mp4", "--rate", "12", "--size", "200"]) == 0
    clip = read_clip("film.mp4")
    assert len(clip) == 48
    frames = [clip[t] for t in range(0, 48, 3)]
    assert min(np.abs(a.astype(int) - b).max() for a, b in zip(frames[:-2], frames[2:])) > 60  # it goes on moving
    SHEETS.mkdir(parents=True, exist_ok=True)
    write_picture(SHEETS / f"{who}.png", np.vstack([np.hstack(frames[:8]), np.hstack(frames[8:])]))


def test_a_sheet_of_postures_at_half_and_whole_extent():
    human = read_dancer("human")
    pool, feet = starting_pool(human.skeleton, human.rest), find_body(human.skeleton).feet
    names = ("arms up", "bow", "crouch", "left kick", "right knee up", "point right", "hips left")
    turns = [turns_of(pool[name], human.skeleton, extent) for extent in (0.5, 1.0) for name in names]
    motion = stood(posed(human.skeleton, np.array(turns), 1.0, human.rest), feet, human.places())
    view = sticks.view_of(motion.positions(), (180, 240), 0.6, follow=False)
    colors, parents = sticks.sides(human.skeleton.names), human.skeleton.parents
    frames = list(sticks.draw(motion.positions(), parents, view, 0.028, colors))
    SHEETS.mkdir(parents=True, exist_ok=True)
    write_picture(SHEETS / "postures.png", np.vstack([np.hstack(frames[:7]), np.hstack(frames[7:])]))
    moved = np.linalg.norm(motion.positions() - human.places(), axis=-1).max(axis=1)
    assert (moved[:7] > 0.3 * moved[7:]).all() and (moved[:7] < 0.95 * moved[7:]).all()
