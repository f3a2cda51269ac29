# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Lists the contents of a parser, for the shell completion and the reference page."""

from argparse import Action, ArgumentParser
from collections.abc import Mapping
from typing import cast


def actions_of(parser: ArgumentParser) -> list[Action]:
    """Return the arguments of a parser, including subparsers; argparse has no public function."""
    return list(parser._actions)


def commands_of(parser: ArgumentParser) -> Mapping[str, ArgumentParser]:
    """Return the parsers of the commands by name; empty if the parser has none."""
    for action in actions_of(parser):
        # The choices of other arguments are a list or None.
        if isinstance(action.choices, Mapping):
            return cast(Mapping[str, ArgumentParser], action.choices)
    return {}
