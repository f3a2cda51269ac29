# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""``phase_traj completion``: prints a script that completes commands and options in a shell."""

from argparse import ArgumentParser, Namespace
from functools import partial
from pathlib import Path
import sys
from typing import Any

from phase_traj_ros.cli.command import Command
from phase_traj_ros.cli.walk import actions_of, commands_of
from phase_traj_ros.errors import MissingDependencyError

_SHELLS = ('bash', 'zsh', 'tcsh')

COMMAND = Command(
    'completion', summary='print the script that completes commands and options in a shell',
    example='phase_traj completion bash > ~/.local/share/bash-completion/completions/phase_traj',
    epilog="""
A new bash reads the file of the example automatically. For zsh, write the script to a file named
_phase_traj in a folder of $fpath; for tcsh, add it to ~/.cshrc. Print it again after an update.
""")


def add_parser(commands: Any, program: ArgumentParser) -> None:
    """Add the command to the parser of the program."""
    parser = COMMAND.add_to(commands)
    parser.add_argument('shell', choices=_SHELLS, help='the shell that reads the script')
    parser.set_defaults(run=partial(run, program))


def run(program: ArgumentParser, options: Namespace) -> None:
    """Run the command."""
    try:
        import shtab
    except ImportError as error:
        raise MissingDependencyError(
            f'the completion needs the Python package shtab ({error}): install it for the'
            f' interpreter that runs this, {sys.executable} -m pip install shtab') from None
    for each in (program, *commands_of(program).values()):
        _complete_paths(each, file=shtab.FILE, directory=shtab.DIRECTORY)
    print(shtab.complete(program, options.shell))


def _complete_paths(parser: ArgumentParser, *, file: Any, directory: Any) -> None:
    for action in actions_of(parser):
        if action.type is Path:
            # The attribute that shtab reads.
            action.complete = (  # type: ignore[attr-defined]
                directory if action.metavar == 'DIR' else file)
