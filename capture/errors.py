"""The one kind of error a user can cause."""


class InputError(ValueError):
    """Something the user gave cannot be used: one sentence that says what must hold, what came, what to do.

    The command line prints it and leaves with exit code 2; anything else is a bug and shows its traceback.
    """
