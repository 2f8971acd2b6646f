"""Records read from their files: TOML or JSON into frozen dataclasses, with every fault told by its name."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from capture.errors import InputError

Record = TypeVar("Record")


def read_record(
    path: str | Path, kind: type[Record], checked: Callable[[Record, Any], Record], what: str, must: str
) -> Record:
    """What `checked(record, stored)` makes of the record of this kind in a *.toml or *.json file.

    `what` the record is, such as "a pose", and what the file `must` be, such as "a *.posing.json", are for the
    sentences of what is refused; what `checked` refuses is told with the file.
    """
    import msgspec

    path = Path(path)
    decode = msgspec.toml.decode if path.suffix.lower() == ".toml" else msgspec.json.decode
    try:
        stored = decode(path.read_bytes())
        record = msgspec.convert(stored, kind)
    except FileNotFoundError:
        raise InputError(f"{what} must be a file that exists: there is no {path}") from None
    except (OSError, UnicodeDecodeError, msgspec.MsgspecError) as error:
        raise InputError(f"{path} must be {must}: {error}") from None
    try:
        return checked(record, stored)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
