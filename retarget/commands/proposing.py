"""The command that proposes key drawings."""

from pathlib import Path
from typing import TYPE_CHECKING

from retarget.console import Out, folder_at, stem, tell

if TYPE_CHECKING:
    from capture.motion.tracks import CartoonMotion
    from retarget.characters.proposals import Asked


def propose(
    motion: Path,
    out: Out = None,
    *,
    drawing: tuple[Path, ...] = (),
    pin: tuple[str, ...] = (),
    mirror: bool = False,
    box: tuple[float, float, float, float] | None = None,
    again: bool = False,
) -> str:
    """Propose all key drawings of a new character from one, for you to correct.

    Beside the SVGs it writes a *.cast.toml for `tooncap retarget --cast`, and next to the folder a picture of the
    source's keys above the proposed ones.  Drawings that are there already, corrected ones, are left as they are.

    Parameters
    ----------
    motion
        The *.motion.json that was captured.
    out
        The folder for the drawings; NAME_keys, after the first drawing's name, if not given.
    drawing
        One SVG that stands like the source's first key.  For a motion of several parts either one whose outermost
        groups have the parts' names as ids, or one for each part, its name ending in the part's.  Of a picture the
        outline is proposed for each key; it comes into the cast file.
    pin
        PLACE=X,Y: a place of the source, a number in the picture or X,Y in its first key, and the place that belongs to
        it on the drawing's outline.  PLACE=#ID: the shape of that id, or number, is a limb of its own and turns as that
        place does.  With several parts PART:PLACE=X,Y.
    mirror
        Turn the drawing to look the other way first.
    box
        X Y WIDTH HEIGHT round what to cut out of a photograph.
    again
        Write all keys anew, also those that are there.
    """
    from capture.errors import InputError
    from capture.motion import tracks
    from capture.pictures.encode import write_picture
    from capture.progress import working
    from retarget.characters import proposals
    from retarget.stage.keysheet import key_sheet

    captured = tracks.load(motion)
    if captured.space != "pixels, y down":
        raise InputError(
            f"keys are proposed for a motion of drawings, {motion} is in {captured.space}: project it first"
        )
    if not drawing:
        raise InputError("a proposal needs --drawing FILE.svg, the character as it stands in the source's first key")
    pins = _pins(pin, captured)
    castings = proposals.castings(drawing, captured, mirror, box)
    out = out or Path(f"{stem(drawing[0])}_keys")
    with working("carrying the keys over"):
        made = [proposals.proposal(one, captured, pins.get(one.part, [])) for one in castings]
    tell(note for one in castings for note in one.notes)
    if len(castings) == 1 and castings[0].picture is None and not mirror and not pins:
        less = proposals.looking_away(castings[0], captured, made[0])
        if less is not None:
            apart = f"with --mirror outlines would lie {less:.0%} of the height apart, not {made[0].misfit:.0%}"
            tell([f"{drawing[0].name} may look the other way than the source: {apart}"])
    written, kept = proposals.write(folder_at(out), castings, made, captured, again)
    names = [out.name if len(castings) == 1 else f"{out.name}_{casting.part}" for casting in castings]
    for name, one, casting in zip(names, made, castings, strict=True):
        write_picture(out.with_name(f"{name}.png"), key_sheet(one, captured.keyset(casting.part)))
    there = f", {len(kept)} that were there are kept" if kept else ""
    count = sum(file.suffix == ".svg" for file in written)
    drawings = f"{count} key drawing{'s' * (count != 1)}"
    if any(casting.picture for casting in castings) and not count:
        drawings = f"{len(made[0].names)} outlines of {castings[0].picture.name}"
    misfit, strain = max(one.misfit for one in made), max(one.strain.max() for one in made)
    folded = sum(int(one.folded.sum()) for one in made)
    return (
        f"{out}: {drawings}{there}; outlines lie {misfit:.0%} of the height apart, shapes keep the "
        f"source's stretch within {strain:.1f}x, {folded} folded triangles; look at {out.with_name(names[0])}.png"
    )


def _pins(told: tuple[str, ...], motion: "CartoonMotion") -> "dict[str, list[Asked]]":
    """Pins by part, from [PART:]PLACE=X,Y or [PART:]PLACE=#ID, PLACE a number or X,Y."""
    from capture.errors import InputError

    pins: dict[str, list[Asked]] = {}
    parts = [track.part for track in motion.tracks]
    for text in told:
        part, _, rest = text.rpartition(":") if ":" in text else (parts[0], "", text)
        place, _, goal = rest.partition("=")
        source, target = _numbers(place), goal[1:] if goal.startswith("#") else _numbers(goal)
        if part not in parts or len(source) not in (1, 2) or not (isinstance(target, str) or len(target) == 2):
            raise InputError(
                f"--pin needs PLACE=X,Y or PLACE=#ID, such as 12=340,80, and PART: of {', '.join(parts)} before it if "
                f"there are several; got {text!r}"
            )
        pins.setdefault(part, []).append((source if len(source) == 2 else int(source[0]), target))
    return pins


def _numbers(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(number) for number in text.split(","))
    except ValueError:
        return ()
