# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What a command is: a name, what it does, and an example."""

from argparse import ArgumentParser, RawDescriptionHelpFormatter
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Command:
    """
    A command of the program.

    Parameters
    ----------
    name
        What the user types.
    summary
        What it does, as a sentence without capital and full stop.
    example
        A call that shows its most usual use.
    epilog
        What else ``--help`` says, line breaks as they are.

    """

    name: str
    summary: str
    example: str
    epilog: str = ''

    def add_to(self, commands: Any) -> ArgumentParser:
        """Add the parser of this command to the subparsers; return it."""
        parser: ArgumentParser = commands.add_parser(
            self.name, help=self.summary,
            description=self.summary[0].upper() + self.summary[1:] + '.',
            epilog=f'example:\n  {self.example}\n{self.epilog.rstrip()}',
            formatter_class=RawDescriptionHelpFormatter)
        return parser
