"""Which messages a page sends before the last is answered, by a model with only what anywidget promises; Node runs it."""

import json
import shutil
import subprocess

import pytest

from retarget.workbench.serving import server

DRIVE = """
const sent = [], heard = new Set();
const model = {
  get: () => undefined, set() {}, FLIGHTS
  on: (name, hears) => heard.add(hears), off: (name, hears) => heard.delete(hears),
  send: (message) => { sent.push(message); },
};
const bench = makeBench(model), aloft = [], turn = () => new Promise((resolve) => setTimeout(resolve));
const act = (to, more) => bench.act("pose.drag", { to }, { newest: "joint", gesture: "g1", ...more });
for (let to = 1; to <= 6; to++) act(to);
bench.act("undo");
act(7, { gesture: "g2" });
let answered = 0;
while (answered < sent.length) {
  aloft.push(sent.slice(answered).map((message) => message.to ?? message.do));
  const { id } = sent[answered++];
  for (const hears of heard) hears({ kind: "done", id }, []);
  await turn();
}
console.log(JSON.stringify({ aloft, idle: bench.idle() }));
"""


def driven(flights):
    """What was aloft before each answer, of six moves of one drag, an undo and a move of another."""
    node = shutil.which("node")
    if node is None:
        pytest.skip("Node is not installed")
    source = (server.STATIC / "bench.js").read_text(encoding="utf-8") + DRIVE.replace("FLIGHTS", flights)
    done = subprocess.run([node, "--input-type=module"], input=source, capture_output=True, text=True, timeout=30)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["idle"]
    return told["aloft"]


def test_by_a_short_way_one_action_flies_and_only_the_newest_of_a_drag_waits():
    assert driven("") == [[1], [6], ["undo"], [7]]


def test_by_a_long_way_a_drag_keeps_the_way_full_and_nothing_overtakes_it():
    assert driven("flights: 3,") == [[1, 2, 3], [2, 3, 6], [3, 6], [6], ["undo"], [7]]
