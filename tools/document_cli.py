# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Write docs/reference/command-line.md, and the tables of docs/reference/parameters.md.

The first is generated from the arguments of the parser, not from its help, whose layout differs
between versions of Python. The tables are generated from the declarations of the parameters.
"""

from argparse import Action, ArgumentParser, SUPPRESS
from collections.abc import Mapping
from pathlib import Path

from phase_traj_ros.cli.program import program_parser, TASKS
from phase_traj_ros.parameter_spec import Group, Spec
from phase_traj_ros.parameters import specs

REFERENCE = Path(__file__).resolve().parent.parent / 'docs' / 'reference'
PARAMETERS = REFERENCE / 'parameters.md'
HEAD = (
    '| parameter | type | default | allowed | unit | read-only | what |\n'
    '|---|---|---|---|---|---|---|')
INTRODUCTION = """\
# Command line

This page lists the commands of `phase_traj`, their arguments and their options. It is generated
from the parser; `phase_traj COMMAND --help` prints the same. An error prints one line
and exits with status 2. A signal exits with 128 and its number: 130 for Ctrl-C, 143 for SIGTERM.
While `play` waits for a subscriber or publishes, a signal ends it in order, with status 0.
If the reader of the output closes it, the work is finished, and the status is 141."""


def pages() -> dict[Path, str]:
    """Return the pages by their paths."""
    return {REFERENCE / 'command-line.md': command_line(), PARAMETERS: parameters()}


def parameters() -> str:
    """Return the page of the parameters, with its tables made anew."""
    page = PARAMETERS.read_text(encoding='utf-8')
    blocks = [page[:page.index(f'\n\n## {Group.USER.value}\n')]]
    for group in Group:
        rows = [row(spec) for spec in specs() if spec.group is group]
        blocks += [f'## {group.value}', '\n'.join([HEAD, *rows])]
    return '\n\n'.join([*blocks, page[page.index('## In files and on the command line\n'):]])


def row(spec: Spec) -> str:
    """Return the row of a parameter."""
    read_only = 'yes' if spec.read_only else 'no'
    return (
        f'| `{spec.name}` | {spec.type} | {spec.default} | {spec.allowed} | {spec.unit} |'
        f' {read_only} | {spec.description} |')


def command_line() -> str:
    """Return the page of the commands."""
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
    for path, text in pages().items():
        path.write_text(text, encoding='utf-8')
        print(f'written to {path}')
