# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The help grouped by task, its examples."""

import re
import shlex

from phase_traj_ros.cli.program import program_parser, TASKS
import pytest

COMMANDS = [module.COMMAND for _, modules in TASKS for module in modules]


def subparsers():
    [found] = [
        each.choices for each in program_parser()._actions if isinstance(each.choices, dict)]
    return found


def test_help_has_every_command_once_by_task_with_an_example():
    shown = program_parser().format_help()

    assert sorted(each.name for each in COMMANDS) == sorted(subparsers())
    for task, modules in TASKS:
        commands = [module.COMMAND for module in modules]
        block = shown.split(f'\n{task}:\n')[1].split('\n\n')[0]
        names = re.findall(r'^  (\S+)', block, re.MULTILINE)
        assert names == [command.name for command in commands]
        for command in commands:
            assert shown.count(command.summary) == shown.count(command.example) == 1
            assert block.index(command.summary) < block.index(command.example)


def test_completion_in_the_shell_finds_every_command():
    # The program shtab takes the commands from this list.
    [commands] = program_parser()._subparsers._group_actions
    assert {each.dest: each.help for each in commands._choices_actions} == {
        each.name: each.summary for each in COMMANDS}


@pytest.mark.parametrize('command', COMMANDS, ids=lambda command: command.name)
def test_example_is_a_call_that_the_parser_takes(command):
    program, *arguments = shlex.split(command.example.split('>')[0])
    options = program_parser().parse_args(arguments)

    assert (program, arguments[0]) == ('phase_traj', command.name)
    assert callable(options.run)
    assert command.example in subparsers()[command.name].format_help()


@pytest.mark.parametrize(('arguments', 'program'), [
    (['replay', 'drive.mp4', '-o', 'out'], 'phase_traj replay'),
    (['replay', 'drive.mp4', '--fa\nst'], 'phase_traj replay'),
    (['--fast', 'replay', 'drive.mp4'], 'phase_traj')])
def test_an_unknown_option_names_the_help_with_the_known_ones(capsys, arguments, program):
    with pytest.raises(SystemExit):
        program_parser().parse_args(arguments)
    said = capsys.readouterr().err
    assert said.startswith(f'{program}: error: unrecognized arguments: -')
    assert said.endswith(f': see {program} --help\n') and said.count('\n') == 1
