"""The flags that several commands have: what each takes, and what its help says.

A command's own flags are told in its docstring; one that stands here is given this type, and is told nowhere else.
"""

from typing import Annotated

from cyclopts import Parameter

from retarget import console

# What is captured of a clip.
Box = Annotated[
    tuple[float, float, float, float] | None,
    Parameter(help="X Y WIDTH HEIGHT of a box drawn round the layer, in pixels."),
]
Color = Annotated[str | None, Parameter(help='The layer\'s main colour, such as "#3a7f2c".')]
Seen = Annotated[int | None, Parameter(help="The frame that box or colour are seen in; the first if not given.")]
Name = Annotated[str, Parameter(help="What to call the part.")]
Stop = Annotated[int | None, Parameter(help="The frame to stop before.")]
PictureRate = Annotated[float | None, Parameter(help="Frames a second, for pictures that carry no time.")]
Keys = Annotated[int, Parameter(help="How many keys there may be at most.")]
Tile = Annotated[tuple[int, int] | None, Parameter(help="WIDTH HEIGHT of a sprite sheet's tiles.")]
Refine = Annotated[
    bool,
    Parameter(help="Refine all frames at once after capture: less jitter, and short gaps are bridged (extra torch)."),
]
Device = Annotated[console.Device, Parameter(help="Where to refine; auto takes a graphics card if there is one.")]

# How a motion file is read.
Rate = Annotated[float | None, Parameter(help="Frames a second, where the file does not say so or is wrong.")]
Strict = Annotated[
    bool, Parameter(help="Refuse a file that breaks the format's rules, rather than mend what can be mended.")
]
Loop = Annotated[bool, Parameter(help="The clip is one round of a loop, and stays one.")]

# How the cartoon animation filter exaggerates.
Amount = Annotated[float, Parameter(help="How much: 1 doubles the movement that is seen most, 0 leaves it.")]
Move = Annotated[
    float | None,
    Parameter(help="What counts as one move; shorter for a nervous character.  Found from the motion if not given."),
]
Before = Annotated[float, Parameter(help="How much of what comes before a move.")]
After = Annotated[float, Parameter(help="How much of what comes after it.")]
Slide = Annotated[bool, Parameter(help="Let feet go where the exaggeration takes them.")]

# How rubber gives.
Stretch = Annotated[float, Parameter(help="How many times as long as it is a link may become.")]
Squash = Annotated[float, Parameter(help="0 to 1: how far stretch takes turns with squash.")]
Swing = Annotated[float, Parameter(help="0 to 1: how far limbs swing after on springs.")]

# Which moments are shown.
Ease = Annotated[
    float,
    Parameter(help="Slow-in and slow-out: poses are held longer and left more quickly, 0 not at all, 0.5 well seen."),
]
Drawings = Annotated[float | None, Parameter(help="Show so many drawings a second: 12 is on twos.")]

# How a film is drawn.
FilmRate = Annotated[float, Parameter(help="Frames a second.")]
FilmHeight = Annotated[int, Parameter(help="Height of the picture in pixels; of a drawing its width.")]
