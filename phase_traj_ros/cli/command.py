# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A command of the program: its name, its purpose, and an example."""

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
        Name that the user types.
    summary
        Purpose, as a sentence without capital and full stop.
    example
        A call that shows the most common use.
    epilog
        Text at the end of ``--help``; line breaks are kept.

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
