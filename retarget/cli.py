"""The `tooncap` command: a subcommand is a function of `retarget.commands`, its flags are that function's arguments.

Everything heavy is imported inside the functions, so that `tooncap --help` answers at once.
"""

import sys
from collections.abc import Callable

from cyclopts import App, CycloptsError, Parameter

from retarget.commands import (
    analogies,
    blowing,
    capturing,
    dancing,
    exaggerating,
    filtering,
    lending,
    many,
    moving,
    playing,
    posing,
    proposing,
    rubbering,
    start,
    working,
)
from retarget.console import Failed, not_shadowed, one_line

COMMANDS: tuple[Callable[..., str], ...] = (
    *(start.demo, start.fixtures),
    *(capturing.suggest, capturing.capture, capturing.contour, capturing.overlay),
    many.batch,
    exaggerating.exaggerate,
    lending.retarget,
    proposing.propose,
    working.workbench,
)
MOCAP: tuple[Callable[..., str], ...] = (
    moving.report,
    rubbering.exaggerate,
    analogies.analogy,
    filtering.anticipate,
    playing.play,
    dancing.dance,
    posing.pose,
    blowing.wind,
)
"""The subcommands of `tooncap mocap`."""


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; 0 when it worked, 1 where a part of it did not, 2 when something given cannot be used."""
    app = App(
        name="tooncap",
        help="Capture the motion of a cartoon and lend it to another drawing.",
        version_flags=["--version"],
        default_parameter=Parameter(negative=()),
        suppress_keyboard_interrupt=False,  # below it is told in our words
    )
    for command in COMMANDS:
        app.command(command)
    moved = App(name="mocap", help="Work on motion capture: skeletons, not drawings.")
    for command in MOCAP:
        moved.command(command)
    app.command(moved)
    from capture.errors import InputError

    try:
        not_shadowed()
        said = app(arguments, exit_on_error=False, print_error=False, result_action="return_value")
    except (InputError, CycloptsError) as error:
        print(f"tooncap: {one_line(error)}", file=sys.stderr)
        return 2
    except Failed as error:
        print(f"tooncap: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt as interrupt:
        print(f"tooncap: {one_line(interrupt) or 'interrupted; nothing half-written is left'}", file=sys.stderr)
        return 130
    if said:
        print(said)
    return 0


if __name__ == "__main__":
    sys.exit(main())
