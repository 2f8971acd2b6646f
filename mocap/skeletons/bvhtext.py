"""What a BVH's text says: the joints of its hierarchy, and the numbers of its frames, mended where that is safe.

Real files are written by hundreds of programs.  Whatever has but one sensible reading is read so; each guess and each
repair is a sentence in `notes`.  A number that cannot be read is NaN, and a frame of the wrong length a row of NaN:
`bvh.read_bvh` holds the frame before.
"""

import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

LARGEST = 1e9
"""A larger number is no place and no angle of a body; it is taken for one that cannot be read."""


@dataclass(frozen=True, eq=False)
class Joints:
    """A hierarchy as written: J joints, each after its parent, end sites among them."""

    names: list[str]
    parents: list[int]
    offsets: NDArray  # (J, 3)
    channels: list[list[str]]  # such as "Xposition", "Zrotation", in the file's order


def text_of(path: Path) -> tuple[str, list[str]]:
    """A file's text with plain line ends, and what had to be guessed about its letters."""
    raw = path.read_bytes()
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text, notes = raw.decode("utf-16", errors="replace"), []
    else:
        try:
            text, notes = raw.decode("utf-8-sig"), []
        except UnicodeDecodeError:
            text, notes = raw.decode("latin-1"), ["its text is no UTF-8 and was taken for Latin-1"]
    return text.replace("\r\n", "\n").replace("\r", "\n"), notes


def parts_of(text: str) -> tuple[str, str]:
    """The hierarchy's text and the motion's; a joint may be called MOTION, a line of its own may not."""
    found = re.search(r"(?:^|\n|\})[ \t]*MOTION[ \t]*:?[ \t]*(?=\n|Frame|$)", text, re.IGNORECASE)
    if found is None:
        raise ValueError("it has no line that says MOTION")
    stop = found.start() + 1 if found.group().startswith("}") else found.start()
    return text[:stop], text[found.end() :]


def joints_of(text: str, notes: list[str]) -> Joints:
    """The joints that a hierarchy's text tells of; ValueError where it cannot be told how they hang together."""
    words = re.findall(r"[{}]|[^\s{}]+", text)
    upper = [word.upper() for word in words]
    at = _start(upper, notes)
    names: list[str] = []
    parents: list[int] = []
    offsets: list[list[float] | None] = []
    channels: list[list[str]] = []
    inside: list[int] = []  # joints whose brace is open
    ends: Counter[int] = Counter()
    strange: list[str] = []
    while at < len(words):
        word = upper[at]
        if word in ("ROOT", "JOINT", "END"):
            name, at = _name(words, upper, at + 1, notes)
            parent = inside[-1] if inside and word != "ROOT" else -1
            if word == "END":
                ends[parent] += 1
                name = f"{names[parent]} end" if parent >= 0 else "end"
                name += f" {ends[parent]}" if ends[parent] > 1 else ""
            elif word == "ROOT" and inside:
                notes.append(f"the ROOT {name} stands inside the joint {names[inside[-1]]}; it hangs on nothing")
            inside.append(len(names))
            for known, new in ((names, name), (parents, parent), (offsets, None), (channels, [])):
                known.append(new)
        elif word == "{":
            raise ValueError(f"a brace is opened after {' '.join(words[max(at - 2, 0) : at])!r}, without a joint")
        elif word == "}":
            if not inside:
                notes.append("it has a } more than {")
            else:
                inside.pop()
            at += 1
        elif word in ("OFFSET", "CHANNELS"):
            if not inside:
                raise ValueError(f"{word} stands outside of all joints")
            joint = inside[-1]
            read = _offset if word == "OFFSET" else _channels
            found, at = read(words, at + 1, names[joint], notes)
            (offsets if word == "OFFSET" else channels)[joint] = found
        else:
            strange.append(words[at])
            at += 1
    if not names:
        raise ValueError("it has no ROOT")
    if inside:
        notes.append(f"it has {len(inside)} {{ more than }}")
    if strange:
        notes.append(f"its hierarchy has words that say nothing, such as {strange[0]!r}; they were passed over")
    for name, offset in zip(names, offsets):
        if offset is None:
            notes.append(f"the joint {name} has no OFFSET; it is where its parent is")
    commonest, times = Counter(names).most_common(1)[0]
    if times > 1:
        notes.append(f"{times} joints have the name {commonest!r}")
    return Joints(names, parents, np.array([offset or [0.0] * 3 for offset in offsets]), channels)


def _start(upper: list[str], notes: list[str]) -> int:
    """Where the first joint may stand."""
    if upper[:1] == ["HIERARCHY"]:
        return 1
    if "HIERARCHY" in upper and upper.index("HIERARCHY") < (upper + ["ROOT"]).index("ROOT"):
        notes.append("something stands before HIERARCHY; it was passed over")
        return upper.index("HIERARCHY") + 1
    if "ROOT" in upper:
        notes.append("it does not begin with HIERARCHY")
        return upper.index("ROOT")
    raise ValueError("it has no HIERARCHY")


def _name(words: list[str], upper: list[str], at: int, notes: list[str]) -> tuple[str, int]:
    """A joint's name, blanks and all, up to its brace; and where to read on."""
    first = at
    while at < len(words) and words[at] not in "{}" and (at == first or upper[at] not in ("OFFSET", "CHANNELS")):
        at += 1
    name = " ".join(words[first:at])
    if at < len(words) and words[at] == "{":
        return name, at + 1
    notes.append(f"the joint {name} has no {{")
    return name, at


def _offset(words: list[str], at: int, name: str, notes: list[str]) -> tuple[list[float], int]:
    stop = at
    while stop < len(words) and re.match(r"[-+.,;\d]|nan|inf", words[stop], re.IGNORECASE):
        stop += 1
    found, said = _numbers(" ".join(words[at:stop]))
    notes += [note for note in said if note not in notes]
    if len(found) != 3:
        notes.append(f"the OFFSET of {name} has {len(found)} numbers, not 3; what lacks is 0")
        found = [*found, 0.0, 0.0, 0.0][:3]
    if not all(abs(number) <= LARGEST for number in found):  # NaN compares false
        notes.append(f"the OFFSET of {name} is not all numbers; what cannot be read is 0")
    return [number if abs(number) <= LARGEST else 0.0 for number in found], stop


_AXES = re.compile(r"([XYZ])(pos|rot|scal)[a-z]*", re.IGNORECASE)


def _channels(words: list[str], at: int, name: str, notes: list[str]) -> tuple[list[str], int]:
    said = words[at] if at < len(words) else ""
    found = []
    at += bool(re.fullmatch(r"\d+", said))
    while at < len(words) and (match := _AXES.fullmatch(words[at])):
        kind = {"pos": "position", "rot": "rotation", "scal": "scale"}[match[2].lower()]
        found.append(match[1].upper() + kind)
        at += 1
    if said != str(len(found)):
        notes.append(f"CHANNELS of {name} says {said or 'nothing'}, {len(found)} channels are named; these were taken")
    if any(channel.endswith("scale") for channel in found):
        notes.append(f"the joint {name} has scale channels; they were passed over")
    return found, at


def heading_of(text: str) -> tuple[str | None, str | None, str]:
    """What stands after Frames: and Frame Time:, None where they lack, and the text of the frames."""
    count = step = None
    while found := re.match(r"\s*(Frames|Frame[ \t]*Time)(?:[ \t]*:|(?=\s))[ \t]*(\S*)", text, re.IGNORECASE):
        if found[1].lower() == "frames":
            count = found[2]
        else:
            step = found[2]
        text = text[found.end() :]
    return count, step, text


def frames_of(text: str, width: int, count: int | None, notes: list[str]) -> NDArray:
    """The frames (T, width) of a motion's text, NaN where a number cannot be read; `count` is how many it promises."""
    quick = _table(text)
    if quick is not None and quick.shape[1] == width:
        values = quick
    else:
        values = _mended(text, width, count, notes)
    if count is not None and count != len(values):
        notes.append(f"it says Frames: {count}, there are {len(values)}; these were taken")
    return np.where(np.abs(values) <= LARGEST, values, np.nan)  # NaN compares false


def _table(text: str) -> NDArray | None:
    """The numbers where every line has as many, by the quickest reader there is."""
    lines = text.split("\n")
    if not any(line and not line.isspace() for line in lines[:2]):  # it warns of a table without lines
        return None
    try:
        return np.loadtxt(lines, ndmin=2, comments=None)
    except ValueError:
        return None


def _mended(text: str, width: int, count: int | None, notes: list[str]) -> NDArray:
    found, said = [], []
    if "," in text:
        lines, said = _without_commas(text)
        text = lines
    lines = [line for line in text.split("\n") if line.strip() and not line.lstrip().startswith(("#", "//"))]
    for line in lines:
        numbers, more = _numbers(line)
        found.append(numbers)
        said += more
    notes += list(dict.fromkeys(said))
    lengths = np.array([len(row) for row in found], int)
    if not lengths.sum():
        raise ValueError("it has no frames")
    fits = lengths == width
    whole = lengths.sum() % width == 0
    if fits.all() or (whole and lengths.sum() == width * (count or -1)):
        rows = found
    elif fits.mean() > 0.5:
        rows = _by_lines(found, fits, width, notes)
    elif len(set(lengths)) == 1 and (1 < len(found) == count or (lengths[0] > width and not whole)):
        raise ValueError(f"every frame must have {width} numbers, as many as it has channels; it has {lengths[0]}")
    else:
        rows = found
    values = np.concatenate([np.array(row, float) for row in rows])
    spare = len(values) % width
    if spare:
        notes.append(f"its last frame has {spare} numbers of {width}; it was left out")
    values = values[: len(values) - spare].reshape(-1, width)
    if not len(values):
        raise ValueError(f"it has no whole frame: {spare} numbers of {width}")
    if np.isnan(values).mean() > 0.5:
        raise ValueError("most of its frames are no numbers")
    return values


def _by_lines(found: list[list[float]], fits: NDArray, width: int, notes: list[str]) -> list[list[float]]:
    """Frames of a line each, of which some are too short or too long."""
    if not fits[-1]:
        notes.append(f"its last frame has {len(found[-1])} numbers of {width}; it was left out")
        found, fits = found[:-1], fits[:-1]
    wrong = np.flatnonzero(~fits)
    if len(wrong):
        frames = "frame" if len(wrong) == 1 else "frames"
        notes.append(
            f"{len(wrong)} {frames}, the first is {wrong[0]}, have not {width} numbers; the one before is held"
        )
    return [row if fit else [np.nan] * width for row, fit in zip(found, fits)]


def _without_commas(text: str) -> tuple[str, list[str]]:
    """Commas are decimal where nothing else is and no word has two; else they stand between numbers."""
    if "." in text or re.search(r",[^\s,]*,|,\s|,$", text):
        return text.replace(",", " "), ["its numbers are divided by commas"]
    return text.replace(",", "."), ["its numbers have decimal commas"]


def _numbers(text: str) -> tuple[list[float], list[str]]:
    """The numbers in some words, NaN for a word that is none, and what was mended."""
    notes = []
    if "," in text:
        text, notes = _without_commas(text)
    parted = re.sub(r"(?<=[\d.])(?=[-+])", " ", text)
    if parted != text:
        notes.append("blanks lack before minus signs")
    words = parted.replace(";", " ").split()
    return [float(word) if _NUMBER.fullmatch(word) else np.nan for word in words], notes


_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
