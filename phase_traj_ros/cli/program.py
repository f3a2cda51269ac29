# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The parser of the program, with its commands grouped by task."""

from argparse import Action, ArgumentParser, Namespace, RawDescriptionHelpFormatter
from collections.abc import Generator
from types import ModuleType
from typing import Any, NoReturn

import phase_traj_ros
from phase_traj_ros.cli.commands import (
    calibrate,
    demo,
    evaluate,
    inspect_frames,
    locate,
    play,
    replay,
)
from phase_traj_ros.cli.ending import EXIT_BAD_INPUT
from phase_traj_ros.cli.escaping import escaped
from phase_traj_ros.core.correlation.transforms import find_transform, transform_hint

TASKS: tuple[tuple[str, tuple[ModuleType, ...]], ...] = (
    ('code a recording', (replay, inspect_frames)),
    ('judge the result', (evaluate,)),
    ('find the place on a map', (locate,)),
    ('learn the camera', (calibrate,)),
    ('run the ROS node', (play, demo)),
)
"""The modules of the commands, grouped by task; each has COMMAND, add_options and run."""


class _Parser(ArgumentParser):
    """Reports a wrong call in one line, like all other errors."""

    def error(self, message: str) -> NoReturn:
        self.exit(
            EXIT_BAD_INPUT, f'{self.prog}: error: {escaped(message)}: see {self.prog} --help\n')


class _Overview(RawDescriptionHelpFormatter):
    """Leaves out the list of commands, which the epilog has by task."""

    def _iter_indented_subactions(self, action: Action) -> Generator[Action, None, None]:
        yield from ()


class _CommandParser(_Parser):
    """Refuses unknown options itself, to name the help of the command."""

    def parse_known_args(self, *arguments: Any, **options: Any) -> Any:
        """Parse the arguments of the command; exit if some are unknown."""
        known, unknown = super().parse_known_args(*arguments, **options)
        if unknown:
            self.error(f'unrecognized arguments: {" ".join(unknown)}')
        return known, unknown


class _Version(Action):
    """Prints the version and the library of the transforms."""

    def __call__(
        self, parser: ArgumentParser, namespace: Namespace, values: object,
        option_string: str | None = None,
    ) -> NoReturn:
        print(f'phase_traj_ros {phase_traj_ros.__version__}')
        print(f'transforms: {find_transform().name}')
        hint = transform_hint()
        if hint:
            print(hint)
        parser.exit()


def program_parser() -> ArgumentParser:
    """Return the parser of the whole command line."""
    parser = _Parser(
        prog='phase_traj', description='Chain codes of a trajectory from a forward camera.',
        epilog=_overview(), formatter_class=_Overview)
    parser.add_argument(
        '--version', action=_Version, nargs=0,
        help='show the version and the library of the transforms, and exit')
    commands = parser.add_subparsers(
        title='commands', required=True, metavar='COMMAND', parser_class=_CommandParser,
        help='one of the commands below; COMMAND --help shows its options')
    for _, modules in TASKS:
        for module in modules:
            command = module.COMMAND.add_to(commands)
            module.add_options(command)
            command.set_defaults(run=module.run)
    return parser


def _overview() -> str:
    """Return the commands grouped by task, each with an example."""
    blocks = []
    for task, modules in TASKS:
        lines = [f'{task}:']
        for command in (module.COMMAND for module in modules):
            lines += [f'  {command.name:<12}{command.summary}', f'{"":14}{command.example}']
        blocks.append('\n'.join(lines))
    return '\n\n'.join(blocks)
