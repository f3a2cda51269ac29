# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Write docs/reference/command-line.md from the parser of the program.

The page is generated from the arguments of the parser, not from its help, whose layout differs
between versions of Python.
"""

from argparse import Action, ArgumentParser, SUPPRESS
from collections.abc import Mapping
from pathlib import Path

from phase_traj_ros.cli.program import program_parser, TASKS

PAGE = Path(__file__).resolve().parent.parent / 'docs' / 'reference' / 'command-line.md'
INTRODUCTION = """\
# Command line

This page lists the commands of `phase_traj`, their arguments and their options. It is generated
from the parser; `phase_traj COMMAND --help` prints the same. An error prints one line
and exits with status 2. A signal exits with 128 and its number: 130 for Ctrl-C, 143 for SIGTERM.
While `play` waits for a subscriber or publishes, a signal ends it in order, with status 0.
If the reader of the output closes it, the work is finished, and the status is 141."""


def page() -> str:
    """Return the page."""
    parser = program_parser()
    # argparse has no public list of its arguments.
    [parsers] = [each.choices for each in parser._actions if isinstance(each.choices, Mapping)]
    blocks = [INTRODUCTION, table(parser)]
    for task, modules in TASKS:
        blocks.append(f'## {task[0].upper()}{task[1:]}')
        for command in (module.COMMAND for module in modules):
            blocks += [
                f'### {command.name}',
                f'{command.summary[0].upper()}{command.summary[1:]}.',
                f'```\n{command.example}\n```',
                table(parsers[command.name])]
            if command.epilog.strip():
                blocks.append(f'```text\n{command.epilog.strip()}\n```')
    return '\n\n'.join(blocks) + '\n'


def table(parser: ArgumentParser) -> str:
    """Return the arguments of a parser as a table."""
    rows = [
        f'| {names(action)} | {(action.help or "").replace("|", chr(92) + "|")} |'
        for action in parser._actions
        if action.help != SUPPRESS and action.dest != 'help' and action.metavar != 'COMMAND']
    return '\n'.join(['| argument | what |', '|---|---|', *rows])


def names(action: Action) -> str:
    """Return the names of an argument, with its value."""
    value = action.metavar
    if value is None and action.choices:
        value = '{' + ','.join(action.choices) + '}'
    if not action.option_strings:
        return f'`{value}`' if action.nargs != '+' else f'`{value} [{value} ...]`'
    # An option without a value has no placeholder.
    shown = {0: '', '?': f' [{value}]'}.get(action.nargs, f' {value}')
    return ', '.join(f'`{each}{shown}`' for each in action.option_strings)


if __name__ == '__main__':
    PAGE.write_text(page(), encoding='utf-8')
    print(f'written to {PAGE}')
