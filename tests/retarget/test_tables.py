"""The table holds the motion: read back, it is the same numbers."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from capture.errors import InputError
from capture.motion import keys
from retarget.export.tables import write_csv, write_curves


def test_a_table_read_back_places_a_point_as_the_motion_does(tmp_path, by_hand):
    frames = 4
    weights = np.random.default_rng(2).dirichlet(np.ones(7), frames)
    motion = by_hand.motion(by_hand.tumble(frames), weights, residual=np.arange(4) / 3, held=np.arange(4) > 2)
    write_csv(motion, tmp_path / "egg.csv")
    rows = list(csv.DictReader((tmp_path / "egg.csv").read_text(encoding="utf-8").splitlines()))
    assert [(row["frame"], row["part"]) for row in rows] == [(str(t), "egg") for t in range(frames)]
    assert [float(row["time"]) for row in rows] == list(motion.times)
    source = keys.shapes(motion.keyset("egg"))
    for t, row in enumerate(rows):
        matrix = np.array([[float(row["a1"]), float(row["a2"])], [float(row["a3"]), float(row["a4"])]])
        pivot, travel = ([float(row[name]) for name in pair] for pair in (("pivot_x", "pivot_y"), ("dx", "dy")))
        shape = np.tensordot(motion.tracks[0].weights[t], source, axes=1)
        placed = pivot + (shape - pivot) @ matrix.T + travel
        np.testing.assert_allclose(placed, motion.points("egg")[t], atol=1e-9)
        assert [float(row["w_sit"]), float(row["w_lean"])] == motion.tracks[0].key_weights()[t].tolist()
        assert (float(row["residual"]), row["held"], row["visible"]) == (t / 3, str(int(t > 2)), "1")


def test_json_holds_what_the_table_holds(tmp_path, by_hand):
    weights = np.random.default_rng(2).dirichlet(np.ones(7), 4)
    motion = by_hand.motion(by_hand.tumble(4), weights, residual=np.arange(4) / 3, held=np.arange(4) > 2)
    write_csv(motion, tmp_path / "egg.csv")
    write_curves(motion, tmp_path / "egg.curves.json")
    rows = list(csv.DictReader((tmp_path / "egg.csv").read_text(encoding="utf-8").splitlines()))
    told = json.loads((tmp_path / "egg.curves.json").read_text(encoding="utf-8"))
    egg = told["parts"]["egg"]
    for t, row in enumerate(rows):
        assert [float(row[name]) for name in ("a1", "a2", "dx", "a3", "a4", "dy")] == egg["affine"][t]
        assert [float(row[f"w_{name}"]) for name in egg["keys"]] == egg["weights"][t]
        assert [float(row["time"]), int(row["held"])] == [told["times"][t], egg["held"][t]]
        assert [float(row["pivot_x"]), float(row["pivot_y"])] == egg["pivot"]
    assert len((tmp_path / "egg.curves.json").read_text(encoding="utf-8").splitlines()) < 20


def test_a_part_has_no_weights_for_keys_it_has_not(tmp_path, by_hand):
    egg = by_hand.motion(by_hand.still(), [[1.0]])
    lid = by_hand.motion(by_hand.still(), [[1.0]], names=("open",), part="lid", parent="egg")
    motion = replace(egg, tracks=egg.tracks + lid.tracks, keysets=egg.keysets + lid.keysets)
    write_csv(motion, tmp_path / "two.csv")
    rows = list(csv.DictReader((tmp_path / "two.csv").read_text(encoding="utf-8").splitlines()))
    assert [(row["part"], row["parent"], row["w_sit"], row["w_open"]) for row in rows] == [
        ("egg", "", "1.0", ""),
        ("lid", "egg", "", "1.0"),
    ]


def test_a_table_that_cannot_be_written_is_refused_and_leaves_nothing(tmp_path, by_hand):
    motion = by_hand.motion(by_hand.still(), [[1.0]])
    with pytest.raises(InputError):
        write_csv(motion, tmp_path)
    assert list(tmp_path.iterdir()) == []
