"""What a desk is, and how a plain message reaches its functions.

A desk is tables of functions under their names.  A message names one as "desk.name", and its other fields are the
function's arguments; they are held against its annotations, so that a function meets only what it asks for.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from inspect import Parameter, signature
from typing import Any, NamedTuple, get_type_hints

from capture.errors import InputError
from retarget.workbench.state import State


class Seen(NamedTuple):
    """What a look gives: bytes of a kind (image/jpeg, application/json, ...), and a few words beside them."""

    kind: str
    data: bytes
    said: Mapping[str, Any] = {}


class Done(NamedTuple):
    """What comes of work: what is applied, what is told of it, and the documents that are in their files already."""

    fields: Mapping[str, Any]  # plain arguments of `apply`
    said: str = ""
    written: tuple[str, ...] = ()  # kinds of documents


class Work(NamedTuple):
    """Something that takes long: it runs in a process of its own, and what comes of it is applied as an action."""

    prepare: Callable[..., dict[str, Any]]  # (state, **fields) -> plain arguments of `run`; refuses what cannot be
    run: Callable[..., Done]  # (**arguments) -> what came of it; a function of a module
    apply: Callable[..., State]  # (state, **fields of what was done) -> state


@dataclass(frozen=True, eq=False)
class Desk:
    """One desk: what can be done, looked at and set to work at it, and what the page shows of the state.

    An action takes a state and makes another, however often it is asked.  One that writes is asked once, and the file
    that it puts into the folder stays there when what it did is undone.
    """

    name: str
    shown: Callable[[State], dict[str, Any]]  # plain values by section; only sections that change are sent
    actions: Mapping[str, Callable[..., State]] = field(default_factory=dict)  # (state, **fields) -> state
    writes: Mapping[str, Callable[..., State]] = field(default_factory=dict)  # actions that put a file into the folder
    looks: Mapping[str, Callable[..., Seen]] = field(default_factory=dict)  # (state, **fields) -> Seen; change nothing
    work: Mapping[str, Work] = field(default_factory=dict)


def has(desks: tuple[Desk, ...], table: str, name: str) -> bool:
    """Whether a table has a function "desk.name"."""
    return _found(desks, table, name) is not None


def find(desks: tuple[Desk, ...], table: str, name: str) -> Any:
    """The function "desk.name" of a table: actions, writes, looks or work."""
    found = _found(desks, table, name)
    if found is None:
        raise InputError(f"the workbench has nothing called {name[:60]!r} among its {table}: reload the page")
    return found


def arguments(function: Callable[..., Any], fields: Mapping[str, Any]) -> dict[str, Any]:
    """The fields of a message as the arguments that a function takes after the state."""
    import msgspec

    expected = _expected(function)
    try:
        msgspec.json.encode(dict(fields))  # half of a sign, as a notebook's channel lets through, is in no file's name
    except (UnicodeEncodeError, TypeError, RecursionError):
        raise InputError(
            f"{function.__name__}: a message must hold plain text and numbers, this one does not"
        ) from None
    try:
        given = msgspec.convert(dict(fields), expected)
    except msgspec.ValidationError as error:
        raise InputError(f"{function.__name__}: {str(error)[:1].lower()}{str(error)[1:]}") from None
    return {name: getattr(given, name) for name in expected.__struct_fields__}


def label(function: Callable[..., Any]) -> str:
    """What a function does, in the words of its docstring's first line."""
    said = (function.__doc__ or function.__name__).strip().splitlines()[0].rstrip(".")
    return said[:1].lower() + said[1:]


def _found(desks: tuple[Desk, ...], table: str, name: str) -> Any:
    of_desk, _, inner = name.partition(".")
    desk = next((desk for desk in desks if desk.name == of_desk), None)
    return getattr(desk, table).get(inner) if desk else None


@cache
def _expected(function: Callable[..., Any]) -> Any:
    """A struct with the function's arguments as fields; the first argument is the state."""
    import msgspec

    hints = get_type_hints(function, include_extras=True)  # with the bounds of numbers
    taken = list(signature(function).parameters.values())[1:]
    fields = [
        (one.name, hints[one.name]) if one.default is Parameter.empty else (one.name, hints[one.name], one.default)
        for one in taken
    ]
    return msgspec.defstruct(function.__name__, fields, forbid_unknown_fields=True)
