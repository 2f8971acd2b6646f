"""The workbench in a notebook: the same page in a cell, on a session that the notebook's own cells can use too.

    from retarget.workbench.widget import workbench
    bench = workbench("walk.mp4")          # shows the page
    bench.session.state.motion             # what was captured there

The page opens a socket of its own to this process.  A notebook's channel takes 60 to 90 ms for a round trip, a socket
7 ms: but where the browser is on another machine there is only the channel, and the page falls back to it.
"""

import json
import re
from functools import cache
from pathlib import Path
from typing import Any

from capture.errors import InputError
from retarget.workbench.serving import server, wire
from retarget.workbench.session import Session

LOCAL = re.compile(r"https?://(localhost|127\.0\.0\.1|\[::1\])(:\d+)?")
"""Pages that may open the socket; any other talks through the notebook's channel, which has its own guard."""


def workbench(file: str | Path = ".") -> Any:
    """The workbench on a file or a folder, as a widget of the notebook."""
    at = Path(file)
    if not at.exists():
        raise InputError(f"the workbench opens a file or folder that is there, {at} is not: give another")
    return widget(Session(at) if at.is_dir() else Session(at.parent, at.name))


def widget(session: Session) -> Any:
    """A session as a widget: an `anywidget.AnyWidget` with `session` and `close`."""
    try:
        made = _kind()()
    except ImportError:
        raise InputError(
            'the workbench in a notebook needs anywidget, which is not installed: pip install "tooncap[notebook]"'
        ) from None
    made.session = session
    made.talk = Talk(session, made.send)
    made.on_msg(lambda _, content, buffers: made.talk.hear(content))
    return made


class Talk:
    """What a page's messages come to, whatever carries them: `send(content, buffers)` goes back to the page."""

    def __init__(self, session: Session, send: Any) -> None:
        """Listen to the session for the page, once that wants it so."""
        self.session = session
        self.serving: server.Serving | None = None
        self._send = send
        self._ends: Any = None

    def hear(self, content: Any) -> None:
        """A message of the page: {"socket": origin} asks for a socket, {"shown": true} for all events by this way."""
        given = content if isinstance(content, dict) else {}
        if "socket" in given:
            self._send({"kind": "socket", "address": self._address(given["socket"])})
        elif "shown" in given:
            if self._ends is None:
                self._ends = self.session.listen(self._tell)
            self._tell(self.session.shown())
        else:
            for event in self.session.act(content):
                if event["kind"] in wire.FOR_THE_ASKER:  # the others have come by way of the listener
                    self._tell(event)

    def close(self) -> None:
        """Save, and stop listening and serving."""
        if self._ends is not None:
            self._ends()
            self._ends = None
        if self.serving is not None:
            self.serving.stop()
        else:
            self.session.close()

    def _tell(self, event: dict[str, Any]) -> None:
        plain = {name: value for name, value in event.items() if name != "data"}
        self._send(plain, [event["data"]] if "data" in event else None)

    def _address(self, origin: Any) -> str:
        """Where the socket is; nowhere for a page that did not come from this machine."""
        if not (isinstance(origin, str) and LOCAL.fullmatch(origin)):
            return ""
        if self.serving is None:
            self.serving = server.start(self.session)
        self.serving.origins.add(origin)
        return f"ws://127.0.0.1:{self.serving.port}/socket?token={self.serving.token}"


@cache
def module() -> str:
    """All of the page's modules as one: they find each other by addresses that the browser makes for them."""
    found = {file.relative_to(server.STATIC).as_posix(): file for file in sorted(server.STATIC.rglob("*.js"))}
    sources = {name: file.read_text(encoding="utf-8") for name, file in found.items()}
    return f"""const SOURCES = {json.dumps(sources)};
const made = {{}};
function address(name) {{
  const text = () =>
    SOURCES[name].replace(/(\\bfrom\\s*)"(\\.[^"]+)"/g, (_, from, other) => {{
      const found = new URL(other, `x:/${{name}}`).pathname.slice(1);
      return `${{from}}"${{address(found)}}"`;
    }});
  return (made[name] ??= URL.createObjectURL(new Blob([text()], {{ type: "text/javascript" }})));
}}
const {{ default: notebook }} = await import(address("notebook.js"));
export default notebook;
"""


@cache
def style() -> str:
    """The page's style, and how tall it is in a cell."""
    text = (server.STATIC / "style.css").read_text(encoding="utf-8")
    return text + ".tooncap-cell { height: clamp(480px, 80vh, 760px); }\n"


@cache
def _kind() -> type:
    import anywidget
    import traitlets

    class Workbench(anywidget.AnyWidget):
        _esm = traitlets.Unicode(module()).tag(sync=True)
        _css = traitlets.Unicode(style()).tag(sync=True)

        def close(self) -> None:
            self.talk.close()
            super().close()

    return Workbench
