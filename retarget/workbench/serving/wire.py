"""Messages and events as they go through a socket: text is JSON; bytes are a header in JSON, and what it is about."""

import struct
from typing import Any

FOR_THE_ASKER = ("done", "refused", "seen")
KINDS = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
}


def packed(event: dict[str, Any]) -> str | bytes:
    """An event as text, or, where it has "data", as bytes: the header's length (uint32, "<I"), header, data."""
    import msgspec

    if "data" not in event:
        return msgspec.json.encode(event).decode()
    header = msgspec.json.encode({name: value for name, value in event.items() if name != "data"})
    header += b" " * (-len(header) % 4)  # so that numbers in the data are where the page can take them from
    return struct.pack("<I", len(header)) + header + event["data"]


def message(text: str | None) -> Any:
    """What a text says, or None: a session refuses that with a sentence."""
    import msgspec

    try:
        return msgspec.json.decode(text.encode()) if text else None
    except (msgspec.DecodeError, UnicodeEncodeError, RecursionError):
        return None
