"""Loops as machine code, compiled when they are first needed and kept on disk where that is possible."""

from collections.abc import Callable
from functools import lru_cache
from types import FunctionType


@lru_cache
def compiled(loops: Callable, *helpers: Callable) -> Callable:
    """A function of loops as machine code, with the functions that it calls: those first that call none."""
    from numba import njit

    made: dict[str, Callable] = {}
    for function in (*helpers, loops):
        known = {**function.__globals__, **made}
        plain = FunctionType(function.__code__, known, function.__name__, function.__defaults__)
        plain.__module__, plain.__qualname__ = function.__module__, function.__qualname__
        try:
            made[function.__name__] = njit(plain, cache=True, error_model="numpy", nogil=True)
        except RuntimeError:  # there is no folder where the machine code could be kept
            made[function.__name__] = njit(plain, error_model="numpy", nogil=True)
    return made[loops.__name__]
