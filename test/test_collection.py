# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""All tests are collected, also on a ROS installation."""

import ast
import os
from pathlib import Path
import signal
import subprocess
import sys

from needs import NEEDS
import pytest

HERE = Path(__file__).resolve().parent
FILES = sorted(HERE.rglob('test_*.py'))
SKIPS = {'importorskip', 'skip', 'xfail', 'exit', 'fail'}


def run_on_import(node):
    """Yield the parts of a module that run on import."""
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)):
            yield child
            yield from run_on_import(child)
        else:
            for decorator in getattr(child, 'decorator_list', []):
                yield from ast.walk(decorator)


def skips(source):
    """Return the calls by which a module would skip itself on import."""
    return [
        ast.unparse(node.func) for node in run_on_import(ast.parse(source))
        if isinstance(node, ast.Call) and ast.unparse(node.func).split('.')[-1] in SKIPS
        and '.mark.' not in ast.unparse(node.func)]


@pytest.mark.parametrize('path', FILES, ids=lambda path: path.name)
def test_no_file_skips_itself_while_it_is_imported(path):
    # launch_testing imports it during collection, which would end there with '1 skipped'.
    assert skips(path.read_text(encoding='utf-8')) == []


def test_what_that_looks_for():
    assert skips("import pytest\nevo = pytest.importorskip('evo')\n") == ['pytest.importorskip']
    assert skips("if True:\n    pytest.skip('', allow_module_level=True)") == ['pytest.skip']
    assert skips("@pytest.mark.skip('why')\ndef test():\n    pytest.importorskip('evo')\n") == []


@pytest.mark.parametrize('file', NEEDS)
def test_what_files_need_is_said_of_files_that_are_there(file):
    assert HERE / file in FILES


def test_files_that_write_bags_do_without_rosbags():
    # rosdep has no key for rosbags, so that colcon test runs without it.
    writing = [path for path in FILES if 'write_drive_bag(' in path.read_text(encoding='utf-8')]
    careless = [
        path.name for path in writing
        if 'rosbags' not in NEEDS.get(path.relative_to(HERE).as_posix(), ())
        and "importorskip('rosbags')" not in path.read_text(encoding='utf-8')]
    assert writing and careless == []


def test_a_job_in_the_background_can_interrupt_what_it_tests(tmp_path):
    test = tmp_path / 'test_it.py'
    test.write_text(
        'import signal\n'
        'def test():\n'
        '    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler\n')
    run = subprocess.run(
        [sys.executable, '-m', 'pytest', '-q', '-p', 'no:cacheprovider', '--rootdir',
         str(tmp_path), '--confcutdir', str(HERE), '-p', 'conftest', str(test)],
        capture_output=True, text=True, cwd=tmp_path, check=False,
        # colcon gives its arguments in PYTEST_ADDOPTS.
        env={**os.environ, 'PYTEST_ADDOPTS': '',
             'PYTHONPATH': os.pathsep.join([str(HERE), *sys.path])},
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN))
    assert run.returncode == 0, run.stdout + run.stderr
