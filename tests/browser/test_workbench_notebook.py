"""The notebook's module in a headless Chromium, on a page that is not the workbench's own: by socket and by channel."""

import json
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread

import numpy as np
import pytest

from capture.pictures.encode import write_clip
from retarget.workbench import widget
from retarget.workbench.serving import server
from retarget.workbench.session import Session

# A notebook's model: messages for the workbench go through a tunnel, as the notebook's channel would carry them.
PAGE = """<!doctype html><body><div id="cell"></div><script type="module">
const heard = new Set(), tunnel = new WebSocket(TUNNEL);
tunnel.binaryType = "arraybuffer";
let shown = null;
const tell = (event, buffers) => [...heard].forEach((hears) => hears(event, buffers));
tunnel.onmessage = ({ data }) => {
  if (typeof data === "string") {
    const event = JSON.parse(data);
    if (!shown) shown = event;
    else tell(event, []);
    return;
  }
  const length = new DataView(data).getUint32(0, true);
  tell(JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length))), [new DataView(data, 4 + length)]);
};
const model = {
  get: () => undefined, set() {}, save_changes() {},
  on: (name, hears) => heard.add(hears),
  off: (name, hears) => heard.delete(hears),
  send: (message) => {
    if ("socket" in message) setTimeout(() => tell({ kind: "socket", address: message.socket === ORIGIN ? ADDRESS : "" }, []));
    else if ("shown" in message) setTimeout(() => tell(shown, []));
    else tunnel.send(JSON.stringify(message));
  },
};
await new Promise((resolve) => (tunnel.onopen = resolve));
while (!shown) await new Promise((resolve) => setTimeout(resolve, 10));
const { default: notebook } = await import(URL.createObjectURL(new Blob([MODULE], { type: "text/javascript" })));
const el = document.getElementById("cell");
window.ends = await notebook.render({ model, el });
</script></body>"""


@pytest.fixture
def cell(flat_browser, tmp_path):
    """A notebook's page with the workbench in it; cell(reachable=False) has no way to the socket."""
    frames = [np.full((60, 80, 3), 20 * t, np.uint8) for t in range(8)]
    write_clip(tmp_path / "grey.mp4", frames, 24)
    serving = server.start(Session(tmp_path, "grey.mp4"))
    content = {}

    class Notebook(BaseHTTPRequestHandler):
        """What is asked for is the page; a page that the test itself put there would count as one of the open web."""

        def do_GET(self):
            self.send_response(200)
            self.send_header("content-type", "text/html; charset=utf-8")
            self.end_headers()
            self.wfile.write(content["page"])

        def log_message(self, *_):
            pass

    notebook = ThreadingHTTPServer(("127.0.0.1", 0), Notebook)
    Thread(target=notebook.serve_forever, daemon=True).start()
    origin = f"http://localhost:{notebook.server_port}"
    serving.origins.add(origin)
    context = flat_browser.new_context(viewport={"width": 1100, "height": 700})
    told = []

    def opened(reachable=True):
        page = context.new_page()
        page.on("pageerror", lambda error: told.append(str(error)))
        tunnel = f"ws://127.0.0.1:{serving.port}/socket?token={serving.token}"
        texts = {"TUNNEL": tunnel, "ADDRESS": tunnel if reachable else "ws://127.0.0.1:9/none", "ORIGIN": origin}
        html = PAGE.replace("MODULE", json.dumps(widget.module()).replace("</", "<\\/"))
        for name, text in texts.items():
            html = html.replace(name, json.dumps(text))
        html = html.replace("<body>", f"<style>{widget.style()}</style><body>")
        content["page"] = html.encode()
        page.goto(origin)
        page.wait_for_selector("#cell[data-way]", timeout=20_000)
        return page

    opened.session = serving.session
    yield opened
    context.close()
    serving.stop()
    notebook.shutdown()
    notebook.server_close()
    assert [line for line in told if "ERR_" not in line] == []


def wait(page, expression, seconds=20):
    end = time.monotonic() + seconds
    while not page.evaluate(expression):
        assert time.monotonic() < end, expression
        page.wait_for_timeout(20)


@pytest.mark.parametrize(("reachable", "way"), [(True, "socket"), (False, "channel")])
def test_the_workbench_opens_in_a_cell_as_one_module_and_works(cell, reachable, way):
    page = cell(reachable)
    assert page.get_attribute("#cell", "data-way") == way
    wait(page, "document.querySelector('canvas.view').view.frame === 0")
    page.evaluate("document.querySelector('canvas.strip').time.go(5)")
    wait(page, "document.querySelector('canvas.view').view.frame === 5")
    page.evaluate("tooncap.act('capture.box', {part: 'character', frame: 0, box: [10, 10, 30, 30]})")
    wait(page, "tooncap.state.capture.parts[0].box !== null")
    assert cell.session.state.shot.parts[0].box == (10, 10, 30, 30)
    assert page.evaluate("document.getElementById('cell').getBoundingClientRect().height") == 560  # 80 % of the window
