"""The script for After Effects, run against a stand-in for its objects that writes down what it is told."""

import json
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest

from capture.errors import InputError
from retarget.characters.drawings import paths
from retarget.characters.drawings.drawing import read_drawing
from retarget.export.aftereffects import write_jsx
from retarget.stage.perform import perform

STAND_IN = """
function Shape() {}
var KeyframeInterpolationType = { HOLD: "hold", LINEAR: "linear" };
function thing(kind) {
  var inside = [];
  return {
    kind: kind, inside: inside, ways: [],
    get numProperties() { return inside.length; },
    get numKeys() { return this.values ? this.values.length : 0; },
    addProperty: function (name) { var made = thing(name); inside.push(made); return made; },
    property: function (name) {
      if (typeof name === "number") return inside[name - 1];
      var found = inside.filter(function (one) { return one.kind === name; })[0];
      return found || this.addProperty(name);
    },
    setValue: function (value) { this.value = value; },
    setValuesAtTimes: function (times, values) { this.times = times; this.values = values; },
    setInterpolationTypeAtKey: function (k, one, two) { this.ways[k - 1] = one; }
  };
}
var made = { layers: [] };
var app = {
  beginUndoGroup: function () {}, endUndoGroup: function () {},
  project: { items: { addComp: function (name, width, height, aspect, duration, fps) {
    made.comp = [name, width, height, aspect, duration, fps];
    return { openInViewer: function () {}, layers: { addShape: function () {
      var layer = thing("layer"); made.layers.push(layer); return layer;
    } } };
  } } }
};
eval(require("fs").readFileSync(process.argv[1], "utf8"));
console.log(JSON.stringify(made));
"""


@pytest.fixture
def built():
    if shutil.which("node") is None:
        pytest.skip("there is no node on this machine to run the script")

    def run(path):
        said = subprocess.run(["node", "-e", STAND_IN, str(path)], capture_output=True, text=True, check=True)
        return json.loads(said.stdout)

    return run


def within(thing, *kinds):
    """All things of the last kind inside a thing, by way of the others."""
    found = [thing]
    for kind in kinds:
        found = [one for outer in found for one in outer["inside"] if one["kind"] == kind]
    return found


def acting(by_hand, worm, at):
    lean = np.linspace(0, 1.2, 9)
    motion = by_hand.motion(by_hand.tumble(9)[at], np.column_stack([1 - lean, lean])[at])
    return perform(motion, [read_drawing("egg", by_hand.names, worm)])


@pytest.mark.parametrize("step", [1, 2])
def test_the_script_keys_our_outlines_at_our_times(tmp_path, by_hand, worm, built, step):
    performance = acting(by_hand, worm, np.arange(9) // step * step)
    write_jsx(performance, tmp_path / "worm.jsx")
    made = built(tmp_path / "worm.jsx")
    assert made["comp"] == ["worm", 320, 240, 1, 9 / 24, 24]
    (layer,) = made["layers"]
    (contents,) = within(layer, "ADBE Root Vectors Group")
    groups = contents["inside"][::-1]  # the first is in front
    assert len(groups) == len(performance.posed(0))
    for number, group in enumerate(groups):
        shapes = within(group, "ADBE Vectors Group", "ADBE Vector Shape - Group", "ADBE Vector Shape")
        assert len(shapes) == len(performance.posed(0)[number].closed)
        for shape in shapes:
            assert set(shape["ways"]) == {"linear" if step == 1 else "hold"}
            assert len(shape["times"]) == (9 if step == 1 else 5)
        for k, time in enumerate(shapes[0]["times"]):
            path = performance.posed(round(24 * time))[number]
            ring = shapes[0]["values"][k]
            at, out, into = (np.array(ring[name]) for name in ("vertices", "outTangents", "inTangents"))
            after = np.roll(np.arange(len(at)), -1) if ring["closed"] else np.arange(1, len(at))
            before = np.arange(len(after))
            curves = np.stack([at[before], (at + out)[before], (at + into)[after], at[after]], axis=1)
            ours = paths.pieces(path)[: len(curves)] + 0.5
            assert np.abs(curves - ours).max() < 0.006


def test_a_part_that_hides_and_a_picture_behind(tmp_path, by_hand, worm, built):
    performance = acting(by_hand, worm, np.arange(9))
    (role,) = performance.roles
    hidden = replace(performance, roles=(replace(role, visible=np.arange(9) != 4),))
    write_jsx(hidden, tmp_path / "worm.jsx")
    (seen,) = within(built(tmp_path / "worm.jsx")["layers"][0], "ADBE Transform Group", "ADBE Opacity")
    assert (seen["values"], set(seen["ways"])) == ([100, 0, 100], {"hold"})
    np.testing.assert_allclose(seen["times"], np.array([0, 4, 5]) / 24, atol=1e-6)
    with pytest.raises(InputError, match="a colour"):
        write_jsx(hidden, tmp_path / "none.jsx", background=np.zeros((4, 4, 3), np.uint8))
    assert not (tmp_path / "none.jsx").exists()
