"""What an interrupted capture needs to go on: the state of its passes, kept in a file beside the output.

The file is an .npz: arrays, and a tree of plain values that says where they belong.  Nothing in it is ever executed.
It goes with one shot, one clip and one version of the program; for any other it is passed over.
"""

import hashlib
import json
import sys
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass, fields, is_dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import capture
from capture.files import written_beside
from capture.fit import source
from capture.pictures.clip import Clip
from capture.pictures.shot import Shot


@dataclass(frozen=True)
class Keep:
    """A file that keeps the state of one capture."""

    path: Path
    fits: str  # what it must go with: shot, clip and program
    first: int = 0  # the clip's number of frame 0
    shot: Any = None  # what is captured, in plain values

    def write(self, state: Any, known: Sequence[Any]) -> None:
        """Put a state in the file; whatever of `known` it holds is only named, not stored."""
        arrays: list[NDArray] = []
        tree = {"fits": self.fits, "shot": self.shot, "state": _packed(state, known, arrays)}
        text = np.frombuffer(json.dumps(tree).encode(), np.uint8)
        with written_beside(self.path) as temporary, temporary.open("wb") as file:
            np.savez(file, tree=text, **{str(number): array for number, array in enumerate(arrays)})

    def read(self, known: Sequence[Any]) -> Any:
        """The state in the file, or None; says in one sentence whether it is gone on from."""
        if not self.path.exists():
            return None
        try:
            with self.path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
                tree = json.loads(stored["tree"].tobytes())
                fits = tree["fits"] == self.fits
                state = _built(tree["state"], known, stored, {}) if fits else None
        except (OSError, EOFError, ImportError, LookupError, TypeError, ValueError, AttributeError, zipfile.BadZipFile):
            state = None
        if state is None:
            _tell(
                f"{self.path} is left from another shot, clip or version and is not used: starting from the beginning"
            )
        else:
            _tell(f"{self.path} is left from a capture that was interrupted: this one {self._where(state)}")
        return state

    def remove(self) -> None:
        """Take the file away: the capture is done."""
        self.path.unlink(missing_ok=True)

    def goes_on(self, state: Any) -> str:
        """What to tell somebody who interrupts."""
        return f"interrupted; what is done is kept in {self.path}: the same command again {self._where(state)}"

    def _where(self, state: Any) -> str:
        if state.frame < 0:
            return "has all frames and needs only its weights"
        return f"goes {'back' if state.back else 'on'} from frame {state.frame + self.first}"


def keep_of(path: str | Path, shot: Shot, clip: Clip, before: str = "") -> Keep:
    """The file at `path`, for a shot of this clip, and for the motion `before` if that is captured again in part."""
    told = (
        repr(shot.parts),
        shot.start,
        shot.stop,
        shot.fps,
        shot.tile,
        clip.size,
        len(clip),
        _source(clip),
        _program(),
        *filter(None, [before]),
    )
    return Keep(Path(path), hashlib.sha256(repr(told).encode()).hexdigest(), shot.start, source.plain(shot))


def kept_shot(path: Path, clip: Clip) -> Shot | None:
    """The shot whose interrupted capture is kept at `path`, if this clip and program could go on with it."""
    import msgspec

    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            tree = json.loads(stored["tree"].tobytes())
        shot = msgspec.convert(tree["shot"], Shot)
    except (OSError, EOFError, LookupError, ValueError, zipfile.BadZipFile):  # msgspec's errors are ValueErrors
        return None
    return shot if keep_of(path, shot, clip).fits == tree["fits"] else None


def _source(clip: Clip) -> Any:
    """Where a clip comes from, and what would change if it were another: sizes and times of its files."""
    path = Path(clip.path).resolve()
    if not path.exists():  # frames in memory
        return [hashlib.sha256(np.ascontiguousarray(clip[t])).hexdigest() for t in (0, len(clip) // 2, len(clip) - 1)]
    files = sorted(path.iterdir()) if path.is_dir() else [path]
    return str(path), [(file.name, file.stat().st_size, file.stat().st_mtime_ns) for file in files]


def _program() -> str:
    """The program's version, exactly: a digest of the sources that a capture runs."""
    digest = hashlib.sha256(np.__version__.encode())
    for file in sorted(Path(capture.__file__).parent.rglob("*.py")):
        digest.update(file.read_bytes())
    return digest.hexdigest()


def _packed(value: Any, known: Sequence[Any], arrays: list[NDArray]) -> Any:
    """A value as what JSON can hold; arrays go to the list, each only once."""
    for number, thing in enumerate(known):
        if value is thing:
            return {"known": number}
    if value is None or isinstance(value, bool | int | str) or type(value) is float:
        return value
    if isinstance(value, np.ndarray):
        number = next((n for n, array in enumerate(arrays) if array is value), len(arrays))
        arrays += [value] * (number == len(arrays))
        return {"array": number}
    if isinstance(value, np.generic):
        arrays.append(np.asarray(value))
        return {"scalar": len(arrays) - 1}
    if is_dataclass(value):
        inside = {field.name: _packed(getattr(value, field.name), known, arrays) for field in fields(value)}
        return {"of": [type(value).__module__, type(value).__qualname__], "fields": inside}
    if isinstance(value, tuple | list):
        return {type(value).__name__: [_packed(item, known, arrays) for item in value]}
    if isinstance(value, dict) and all(isinstance(name, str) for name in value):
        return {"dict": {name: _packed(item, known, arrays) for name, item in value.items()}}
    raise TypeError(f"a {type(value).__name__} cannot be kept")


def _built(packed: Any, known: Sequence[Any], arrays: Any, read: dict[str, NDArray]) -> Any:
    """The value of a packed one; an array that was stored once is one array again."""
    if not isinstance(packed, dict):
        return packed
    kind = next(iter(packed))
    inside = packed[kind]
    if kind == "known":
        return known[inside]
    if kind in ("array", "scalar"):
        name = str(inside)
        read[name] = read[name] if name in read else arrays[name]
        return read[name] if kind == "array" else read[name][()]
    if kind == "of":
        module, name = inside
        made = getattr(import_module(module), name) if module.startswith("capture.") else None
        if not (isinstance(made, type) and is_dataclass(made)):
            raise ValueError(f"{module}.{name} is no kind of thing that a capture keeps")
        return made(**{key: _built(item, known, arrays, read) for key, item in packed["fields"].items()})
    if kind == "dict":
        return {name: _built(item, known, arrays, read) for name, item in inside.items()}
    items = [_built(item, known, arrays, read) for item in inside]
    return tuple(items) if kind == "tuple" else items


def _tell(sentence: str) -> None:
    print(f"tooncap: {sentence}", file=sys.stderr)
