"""What the parts of the posing desk share: the figure in the state, and what fields of messages may be."""

from dataclasses import replace
from typing import Annotated

import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from capture.errors import InputError
from retarget.workbench.desks import Seen
from retarget.workbench.figure import Figure
from retarget.workbench.state import State

Extent = Annotated[float, Meta(ge=-3, le=3)]


def figure_in(state: State) -> Figure:
    """The figure that is posed."""
    if state.figure is None:
        raise InputError("there must be a figure to pose: open a .bvh file, or take one that is built in")
    return state.figure


def with_figure(state: State, figure: Figure) -> State:
    """The state with the figure changed."""
    return replace(state, figure=figure)


def joint_of(state: State, joint: int) -> int:
    """The number of a joint that there is."""
    count = len(figure_in(state).skeleton)
    if joint >= count:
        raise InputError(f"the figure has {count} joints, counted from 0; there is no joint {joint}")
    return joint


def numbers(places: NDArray, **said: object) -> Seen:
    """Numbers for the page: float32, little end first, with their shape."""
    points = np.ascontiguousarray(places, dtype="<f4")
    return Seen("application/octet-stream", points.tobytes(), {"shape": list(points.shape), **said})
