# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Which Python the tools accept, and the reasons for rejecting others."""

import importlib.util
from pathlib import Path
import sys

import pytest

SUITABLE = {
    'executable': '/usr/bin/python3', 'version': [3, 12, 3], 'implementation': 'CPython',
    'free_threaded': False, 'bits': 64, 'system': 'Linux', 'machine': 'x86_64',
    'libc': ['glibc', '2.39'], 'lacks_venv': [], 'lacks': [],
}


@pytest.fixture(scope='module')
def tool():
    """Return the module tools/find_python.py, which is not installed."""
    path = Path(__file__).resolve().parents[2] / 'tools' / 'find_python.py'
    spec = importlib.util.spec_from_file_location('find_python', path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look there
    spec.loader.exec_module(module)
    return module


def test_a_usual_python_is_taken(tool):
    assert tool.wheels_refuse(tool.Interpreter('python3', SUITABLE), None) is None


@pytest.mark.parametrize(('changed', 'said'), [
    ({'system': 'Darwin', 'libc': ['', '']}, 'Darwin'),
    ({'machine': 'aarch64'}, 'aarch64'),
    ({'libc': ['glibc', '2.27']}, 'glibc 2.27'),
    ({'libc': ['', '']}, 'this C library'),
    ({'version': [3, 9, 18]}, 'this version'),
    ({'version': [3, 14, 0]}, 'this version'),
    ({'implementation': 'PyPy'}, 'CPython'),
    ({'free_threaded': True}, 'CPython'),
    ({'bits': 32}, '64-bit'),
    ({'lacks_venv': ['venv']}, 'apt install python3.12-venv'),
])
def test_one_that_has_no_wheels_is_refused_with_the_reason(tool, changed, said):
    interpreter = tool.Interpreter('python3', {**SUITABLE, **changed})
    assert said in tool.wheels_refuse(interpreter, None)


def test_advice_if_no_python_is_suitable(tool, monkeypatch):
    old = tool.Interpreter('python3', {**SUITABLE, 'version': [3, 9, 18]})
    monkeypatch.delenv('ROS_DISTRO', raising=False)
    monkeypatch.setattr(tool, 'probe', lambda name: old)
    with pytest.raises(tool.SetupError) as caught:
        tool.find_for_wheels('', None)
    assert 'CPython 3.10 to 3.13' in str(caught.value)
    assert 'python3 (Python 3.9.18)' in str(caught.value)
    assert 'make PYTHON=' in str(caught.value)
