"""A session served to a browser on this machine, and to nobody else.

It listens on 127.0.0.1 alone, at a port that the system chooses.  Who asks must hold the token in the address, call the
server by its own name (a page elsewhere that had its own name led here does not), and not be a page of another origin.
"""

import asyncio
import hmac
import secrets
import socket
from collections.abc import Awaitable, Callable
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Event, Thread
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs

from capture.errors import InputError
from retarget.workbench.serving import impatient, wire
from retarget.workbench.session import Session

if TYPE_CHECKING:
    from starlette.websockets import WebSocket
    from uvicorn import Server

STATIC = Path(__file__).parents[1] / "static"
LARGEST = 2**20  # bytes of a message: an outline of 5000 points is a fifth of it
LOOKS_AT_ONCE = 3  # of one page
LOOKERS, DOERS = 6, 4  # threads: what only looks, however long, never stands before what is to be done
WAITING = 500  # looks that a page may have asked for and not seen
BEHIND = 2000  # events that a page may lag behind before it is let go; it comes again by itself
HEADERS = {
    "content-security-policy": "default-src 'self'; connect-src 'self' {sockets}; img-src 'self' blob: data:; "
    "media-src 'self' blob:; "
    "style-src 'self' 'unsafe-inline'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'",
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cache-control": "no-store",
    "cross-origin-resource-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
}

Asgi = Callable[..., Awaitable[None]]


@dataclass(eq=False)
class Serving:
    """A server that runs on a thread of its own."""

    session: Session
    port: int
    token: str
    origins: set[str]  # of pages that may open the socket besides our own, such as a notebook's
    _server: "Server"
    _thread: Thread

    @property
    def address(self) -> str:
        """What to open in a browser."""
        return f"http://127.0.0.1:{self.port}/?token={self.token}"

    def wait(self) -> None:
        """Until somebody stops it."""
        never = Event()  # a ^C while joining a thread would leave it for ended, which it is not
        while self._thread.is_alive():
            never.wait(0.5)

    def stop(self) -> None:
        """Save, and stop serving."""
        self.session.close()
        self._server.should_exit = True
        self._thread.join(5)
        if self._thread.is_alive():  # somebody does not hang up
            self._server.force_exit = True
            self._thread.join(5)


def start(session: Session) -> Serving:
    """Serve a session on a free port of 127.0.0.1."""
    import uvicorn

    # asyncio lets small answers go at once (TCP_NODELAY) only where the socket says that it is TCP: else 40 ms
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    listener.bind(("127.0.0.1", 0))
    listener.listen(64)
    port, token, origins = listener.getsockname()[1], secrets.token_urlsafe(24), set()
    config = uvicorn.Config(
        guarded(pages(session), port, token, origins),
        http=impatient.protocol(),
        ws="websockets-sansio",
        ws_max_size=LARGEST,
        ws_per_message_deflate=False,  # it would cost more time than it saves on this machine
        lifespan="off",
        log_level="error",  # the address holds the token, and is for nobody's log
        timeout_graceful_shutdown=1,
    )
    server = uvicorn.Server(config)

    def run() -> None:
        asyncio.run(server.serve(sockets=[listener]))

    thread = Thread(target=run, daemon=True)
    thread.start()
    while not server.started:
        thread.join(0.01)
        if not thread.is_alive():
            raise InputError("the workbench needs a port on 127.0.0.1 to listen on, it got none: allow it one")
    return Serving(session, port, token, origins, server, thread)


def guarded(app: Asgi, port: int, token: str, origins: set[str]) -> Asgi:
    """The application for those who may; anybody else is refused before anything of it runs."""
    names = {f"127.0.0.1:{port}", f"localhost:{port}"}
    ours = {f"http://{name}" for name in names}

    async def guard(scope: dict[str, Any], receive: Asgi, send: Asgi) -> None:
        if scope["type"] not in ("http", "websocket"):
            return
        headers = {name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]}
        origin, for_socket = headers.get("origin"), scope["type"] == "websocket"
        asked = parse_qs(scope.get("query_string", b"").decode("latin-1"), keep_blank_values=True).get("token", [])
        given = asked[0] if asked else ""
        open_to_all = scope["path"].startswith("/static/") or (scope["path"] == "/" and not asked)
        free = (
            not for_socket and open_to_all
        )  # our own source is nobody's secret; without a token the page only says so
        if headers.get("host") not in names:
            code, why = 421, "this is no server of that name"
        elif origin not in ours | (origins if for_socket else set()) and (for_socket or origin is not None):
            code, why = 403, "pages from elsewhere may not come in here"
        elif not free and not hmac.compare_digest(given.encode(), token.encode()):
            code, why = 403, "open the address that tooncap printed, with its token"
        else:
            await app(scope, receive, send)
            return
        await _refuse(scope, receive, send, code, why)

    return guard


def pages(session: Session) -> Asgi:
    """The page, its modules, and the socket that messages and events go through."""
    from starlette.applications import Starlette
    from starlette.responses import FileResponse, PlainTextResponse, Response
    from starlette.routing import Route, WebSocketRoute

    lookers, doers = ThreadPoolExecutor(LOOKERS, "looks"), ThreadPoolExecutor(DOERS, "acts")

    def headers(request: Any) -> dict[str, str]:
        policy = HEADERS["content-security-policy"].format(sockets=f"ws://{request.headers['host']}")
        return {**HEADERS, "content-security-policy": policy}

    async def index(request: Any) -> Response:
        return FileResponse(STATIC / "index.html", headers=headers(request))

    async def static(request: Any) -> Response:
        file = (STATIC / request.path_params["name"]).resolve()
        if not (file.is_relative_to(STATIC.resolve()) and file.is_file()):
            return PlainTextResponse("there is no such file", 404, headers(request))
        return FileResponse(file, media_type=wire.KINDS.get(file.suffix), headers=headers(request))

    async def connected(websocket: "WebSocket") -> None:
        await _converse(websocket, session, lookers, doers)

    routes = [Route("/", index), Route("/static/{name:path}", static), WebSocketRoute("/socket", connected)]
    return Starlette(routes=routes)


async def _converse(websocket: "WebSocket", session: Session, lookers: Executor, doers: Executor) -> None:
    """One page: its messages in, events out, until it closes."""
    from starlette.websockets import WebSocketDisconnect

    loop, waiting, asked = asyncio.get_running_loop(), asyncio.Queue(), asyncio.Queue(WAITING)
    ended = object()
    looking, tasks = asyncio.Semaphore(LOOKS_AT_ONCE), set()
    await websocket.accept()

    def later(event: dict[str, Any]) -> None:
        if not loop.is_closed():
            loop.call_soon_threadsafe(waiting.put_nowait, event)

    async def send() -> None:
        with suppress(WebSocketDisconnect, RuntimeError):  # it has gone meanwhile
            while waiting.qsize() < BEHIND:
                packed = wire.packed(await waiting.get())
                await (websocket.send_text(packed) if isinstance(packed, str) else websocket.send_bytes(packed))
            await websocket.close(1013)

    async def look(message: dict[str, Any]) -> None:
        async with looking:
            for event in await loop.run_in_executor(lookers, session.act, message):
                waiting.put_nowait(event)

    async def act() -> None:
        while (message := await asked.get()) is not ended:  # one after the other; what is looked at waits for none
            for event in await loop.run_in_executor(doers, session.act, message):
                if event["kind"] in wire.FOR_THE_ASKER:  # the others have come by way of the listener
                    waiting.put_nowait(event)

    ends = session.listen(later)
    waiting.put_nowait(await loop.run_in_executor(doers, session.shown))
    sender, actor = asyncio.create_task(send()), asyncio.create_task(act())
    try:
        while not sender.done():
            received = await websocket.receive()
            if received["type"] == "websocket.disconnect":
                break
            message = wire.message(received.get("text"))
            if isinstance(message, dict) and "look" in message:
                if len(tasks) >= WAITING:
                    await websocket.close(1013)  # no page of ours asks for so much; it may come again
                    break
                tasks.add(task := asyncio.create_task(look(message)))
                task.add_done_callback(tasks.discard)
                continue
            await asked.put(message)
    finally:
        ends()
        sender.cancel()
        for task in tasks:
            task.cancel()
        await asked.put(ended)
        await actor  # what was asked is done, though the page has gone


async def _refuse(scope: dict[str, Any], receive: Asgi, send: Asgi, code: int, why: str) -> None:
    from starlette.responses import PlainTextResponse

    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008, "reason": why})  # before it is accepted: HTTP 403
        return
    await PlainTextResponse(f"{why}\n", code)(scope, receive, send)
