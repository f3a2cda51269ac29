# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Faults are planted in what decides, not in tuning or messages."""

import importlib.util
from pathlib import Path
import sys

SPEC = importlib.util.spec_from_file_location(
    'mutants', Path(__file__).resolve().parents[2] / 'tools' / 'mutants.py')
mutants = sys.modules['mutants'] = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(mutants)

SOURCE = '''
"""A module."""
TUNING = 3.0


def judge(value: float) -> float:
    """Return a number."""
    if value < 2.0:
        raise ValueError(f'{value} is less than {1 + 1}')
    value.forget()
    return -value + TUNING * min(value, 5.0)
'''


def test_each_fault_is_a_module_that_differs_in_one_place():
    found = list(mutants.faults_in('judge.py', SOURCE))
    assert {fault.change for fault in found} == {
        'value < 2.0  ->  value >= 2.0', '2.0  ->  3.0', 'value.forget()  ->  None',
        '-value + TUNING * min(value, 5.0)  ->  -value - TUNING * min(value, 5.0)',
        'TUNING * min(value, 5.0)  ->  TUNING / min(value, 5.0)', '-value  ->  +value',
        'min  ->  max', '5.0  ->  6.0'}
    for fault in found:
        compile(fault.source, 'judge.py', 'exec')
        assert 'TUNING = 3.0' in fault.source
        assert '{1 + 1}' in fault.source
    assert len({fault.source for fault in found}) == len(found)


def test_the_rooms_that_measure_and_judge_are_mutated():
    found = {str(path) for path in mutants.modules()}
    for name in ('path/odometry.py', 'road/tilt.py', 'heading/turns.py', 'codes/from_shift.py'):
        assert f'phase_traj_ros/core/{name}' in found
