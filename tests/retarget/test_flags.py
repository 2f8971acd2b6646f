"""What flags say of themselves: each something, and a flag of several commands in one place."""

import inspect
from collections import Counter
from typing import get_args

import docstring_parser
import pytest

from retarget.cli import COMMANDS, MOCAP

ALL = (*COMMANDS, *MOCAP)


@pytest.mark.parametrize("command", ALL, ids=lambda command: f"{command.__module__.split('.')[-1]}.{command.__name__}")
def test_every_flag_says_what_it_takes_and_only_once(command):
    told, typed = _told(command), _typed(command)
    assert {*told, *typed} == set(inspect.signature(command).parameters)
    assert not {*told} & {*typed}
    assert all([*told.values(), *typed.values()])


def test_no_two_commands_tell_a_flag_in_the_same_words():
    """The third copy of a help is where the first wrong one comes from: it belongs in retarget/commands/flags.py."""
    flags = [
        (name, text)
        for command in ALL
        for name, text in _told(command).items()
        if inspect.signature(command).parameters[name].kind is inspect.Parameter.KEYWORD_ONLY
    ]
    assert [flag for flag, times in Counter(flags).items() if times > 1] == []


def _told(command):
    """The flags that a command's own docstring tells."""
    return {one.arg_name: one.description for one in docstring_parser.parse(inspect.getdoc(command)).params}


def _typed(command):
    """The flags whose type brings its help."""
    helps = {}
    for name, parameter in inspect.signature(command).parameters.items():
        for said in get_args(parameter.annotation)[1:]:
            if getattr(said, "help", None):
                helps[name] = said.help
    return helps
