# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Faults are planted in what decides, not in tuning or messages."""

import ast
import importlib.util
from pathlib import Path
import runpy
import sys

import pytest

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
    found = mutants.faults_in('judge.py', SOURCE)
    assert {fault.key.partition(': ')[2] for fault in found} == {
        'value < 2.0  ->  value >= 2.0', '2.0  ->  3.0',
        'value.forget()  ->  lambda: value.forget()',
        '-value + TUNING * min(value, 5.0)  ->  -value - TUNING * min(value, 5.0)',
        'TUNING * min(value, 5.0)  ->  TUNING / min(value, 5.0)', '-value  ->  +value',
        'min  ->  max', '5.0  ->  6.0'}
    planted = set()
    for number in range(len(found)):
        fault = mutants.faults_in('judge.py', SOURCE)[number]
        fault.planted()
        planted.add(ast.unparse(fault.tree))
    assert len(planted) == len(found)
    assert all('TUNING = 3.0' in source and '{1 + 1}' in source for source in planted)


def test_a_fault_is_planted_in_functions_that_others_hold_already(monkeypatch, tmp_path):
    (tmp_path / 'judge.py').write_text(SOURCE)
    monkeypatch.setattr(mutants, 'ROOT', tmp_path)
    held = runpy.run_path(str(tmp_path / 'judge.py'))['judge']
    sign = next(fault for fault in mutants.faults_in('judge.py', SOURCE) if '+value' in fault.key)
    value = type('Value', (float,), {'forget': lambda _: None})(4.0)
    assert held(value) == -4.0 + 3.0 * 4.0
    mutants.plant(sign, [held])
    assert held(value) == 4.0 + 3.0 * 4.0


def test_a_fault_in_a_module_that_is_not_loaded_is_not_tried(monkeypatch, tmp_path):
    monkeypatch.setattr(mutants, 'ROOT', tmp_path)
    fault = mutants.faults_in('judge.py', SOURCE)[0]
    with pytest.raises(LookupError, match='is loaded'):
        mutants.plant(fault, [mutants.modules])


def test_the_rooms_that_measure_and_judge_are_mutated():
    found = {str(path) for path in mutants.modules()}
    for name in ('path/odometry.py', 'road/meter.py', 'heading/turns.py', 'codes/from_shift.py'):
        assert f'phase_traj_ros/core/{name}' in found
