# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The help grouped by task, its examples, and shell completion."""

import re
import shlex
import shutil
import subprocess
import sys

from phase_traj_ros.cli.main import main
from phase_traj_ros.cli.program import program_parser, TASKS
from phase_traj_ros.cli.walk import commands_of
import pytest

COMMANDS = [command for _, commands in TASKS for command in commands]


def test_help_has_every_command_once_by_task_with_an_example():
    shown = program_parser().format_help()

    assert sorted(each.name for each in COMMANDS) == sorted(commands_of(program_parser()))
    for task, commands in TASKS:
        block = shown.split(f'\n{task}:\n')[1].split('\n\n')[0]
        names = re.findall(r'^  (\S+)', block, re.MULTILINE)
        assert names == [command.name for command in commands]
        for command in commands:
            assert shown.count(command.summary) == shown.count(command.example) == 1
            assert block.index(command.summary) < block.index(command.example)


@pytest.mark.parametrize('command', COMMANDS, ids=lambda command: command.name)
def test_example_is_a_call_that_the_parser_takes(command):
    program, *arguments = shlex.split(command.example.split('>')[0])
    options = program_parser().parse_args(arguments)

    assert (program, arguments[0]) == ('phase_traj', command.name)
    assert callable(options.run)
    assert command.example in commands_of(program_parser())[command.name].format_help()


@pytest.mark.parametrize(('typed', 'offered'), [
    ('ins', {'inspect'}),
    ('replay --bag-', {'--bag-out', '--bag-debug-images'}),
    ('demo --drive paper', {'paper_case_1', 'paper_case_2'}),
    ('evaluate --ground', {'--ground-truth'}),
    ('inspect fir', {'first.png'}),
])
def test_bash_completes(typed, offered, tmp_path, capsys):
    pytest.importorskip('shtab')
    if shutil.which('bash') is None:
        pytest.skip('no bash')
    assert main(['completion', 'bash']) == 0
    script = tmp_path / 'completion.sh'
    script.write_text(capsys.readouterr().out)
    (tmp_path / 'first.png').touch()
    words = ['phase_traj', *typed.split(' ')]
    done = subprocess.run(
        ['bash', '--norc', '-c', f"""
source {shlex.quote(str(script))}
[[ $(complete -p phase_traj) =~ -F\\ ([^ ]+) ]]
COMP_WORDS=({shlex.join(words)})
COMP_CWORD={len(words) - 1}
"${{BASH_REMATCH[1]}}" phase_traj {shlex.quote(words[-1])} {shlex.quote(words[-2])}
printf '%s\\n' "${{COMPREPLY[@]}}"
"""],
        cwd=tmp_path, capture_output=True, check=True, text=True)

    assert set(done.stdout.split()) == offered


@pytest.mark.parametrize('shell', ['bash', 'zsh', 'tcsh'])
def test_completion_names_every_command(shell, capsys):
    pytest.importorskip('shtab')
    assert main(['completion', shell]) == 0
    script = capsys.readouterr().out

    assert all(command.name in script for command in COMMANDS)


def test_without_shtab_one_line_says_what_to_install(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, 'shtab', None)

    assert main(['completion', 'bash']) == 2
    shown = capsys.readouterr()
    assert (shown.out, shown.err.count('\n')) == ('', 1)
    assert 'pip install shtab' in shown.err
