# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Plants small faults in the core, one at a time, and counts how many of them the tests find.

A seeded sample of all faults is tried: reversed comparisons, exchanged operators, numbers and
signs that are wrong, calls that are left out. Constants of a module (tuning) and messages are left
alone.

Each test of the core is run once to see which lines it executes, and for how long. A fault is then
tried with the tests that execute its line, those of its room first and the cheapest first, up to
the first that fails. Each run is a fork of one process that has collected all tests; the fault
replaces the code of the functions there. What is found is kept in out/mutants, so a stopped run
continues.
"""

from __future__ import annotations

import argparse
import ast
from collections.abc import Callable, Iterator
import copy
from dataclasses import dataclass
from functools import partial
import gc
import hashlib
import importlib
import json
import os
from pathlib import Path
import random
import resource
import signal
import sys
import time
from types import CodeType, FrameType, FunctionType
from typing import Any

from _pytest.runner import runtestprotocol
import pytest

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / 'out' / 'mutants'
CORE = Path('phase_traj_ros/core')
#: What is mutated: rooms, and the state machine.
TARGETS = ('path', 'road', 'rotation', 'heading', 'reliability', 'codes/from_shift.py',
           'codes/from_turns.py', 'codes/from_heading.py', 'codes/chain.py', 'judge.py',
           'fixed/guard.py', 'distance_meter.py')
# Memory of a test in bytes: a fault may make a loop endless.
_MEMORY = 4 << 30

_COMPARED = {
    ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt, ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn,
    ast.NotIn: ast.In}
_OPERATORS = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult,
    ast.FloorDiv: ast.Mult, ast.Mod: ast.Mult}


@dataclass(frozen=True)
class Fault:
    """A fault: a module, a node of its tree, and what is other in this node."""

    path: str
    tree: ast.Module
    node: ast.AST
    other: dict[str, object]

    @property
    def key(self) -> str:
        """Return what distinguishes this fault from others."""
        after = copy.copy(self.node)
        vars(after).update(self.other)
        return (f'{self.path}:{self.node.lineno}:{self.node.col_offset}:'
                f' {ast.unparse(self.node)}  ->  {ast.unparse(after)}')

    def planted(self) -> CodeType:
        """Return the code of the module with the fault; the tree keeps it."""
        vars(self.node).update(self.other)
        return compile(ast.fix_missing_locations(self.tree), str(ROOT / self.path), 'exec')


def faults_in(path: str, source: str) -> list[Fault]:
    """Return all faults that can be planted in a module."""
    tree = ast.parse(source)
    inside = _inside(tree)
    changes = ((node, _change(node)) for node in ast.walk(tree) if id(node) in inside)
    return [Fault(path, tree, node, other) for node, other in changes if other]


def _inside(tree: ast.Module) -> set[int]:
    """Return the nodes of function bodies, without messages, annotations and checks of types."""
    found: set[int] = set()

    def visit(node: ast.AST) -> None:
        if isinstance(node, (ast.Raise, ast.Assert, ast.JoinedStr)):
            return
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            return
        found.add(id(node))
        for name, value in ast.iter_fields(node):
            if name in ('annotation', 'returns', 'decorator_list', 'ctx'):
                continue
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST):
                    visit(child)

    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            for statement in node.body:
                visit(statement)
    return found


def _change(node: ast.AST) -> dict[str, object]:
    """Return what a fault changes in a node, if it can have one."""
    if isinstance(node, ast.Compare) and type(node.ops[0]) in _COMPARED:
        return {'ops': [_COMPARED[type(node.ops[0])](), *node.ops[1:]]}
    if isinstance(node, (ast.BinOp, ast.AugAssign)) and type(node.op) in _OPERATORS:
        return {'op': _OPERATORS[type(node.op)]()}
    if isinstance(node, ast.BoolOp):
        return {'op': ast.Or() if isinstance(node.op, ast.And) else ast.And()}
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return {'op': ast.UAdd()}
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        return {'operand': ast.UnaryOp(ast.Not(), node.operand)}
    if isinstance(node, ast.Constant) and isinstance(node.value, bool):
        return {'value': not node.value}
    if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
        return {'value': node.value + 1}
    if isinstance(node, ast.Name) and node.id in ('min', 'max'):
        return {'id': 'max' if node.id == 'min' else 'min'}
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
        # Not called, but named, so that the function has the same closure.
        return {'value': ast.Lambda(ast.arguments([], [], None, [], [], None, []), node.value)}
    if isinstance(node, ast.IfExp):
        return {'body': node.orelse, 'orelse': node.body}
    return {}


def modules() -> list[Path]:
    """Return the modules that are mutated, relative to the root."""
    found = []
    for target in TARGETS:
        path = ROOT / CORE / target
        found += [path] if path.is_file() else sorted(path.glob('[!_]*.py'))
    return [path.relative_to(ROOT) for path in found]


def plant(fault: Fault, functions: list[FunctionType]) -> None:
    """Give those of these functions that are in the module of a fault their code with it."""
    file, codes, inside = str(ROOT / fault.path), {}, [fault.planted()]
    while inside:
        code = inside.pop()
        codes[code.co_name, code.co_firstlineno] = code
        inside += [each for each in code.co_consts if isinstance(each, CodeType)]
    held = [each for each in functions if each.__code__.co_filename == file]
    if not held:
        raise LookupError(f'no function of {file} is loaded')
    for each in held:
        each.__code__ = codes[each.__code__.co_name, each.__code__.co_firstlineno]


def known(file: Path) -> dict[str, Any]:
    """Return what a file of results has kept."""
    return dict(map(json.loads, file.read_text('utf-8').splitlines())) if file.exists() else {}


def keep(file: Path, name: str, value: object) -> None:
    """Add to a file of results."""
    with file.open('a', encoding='utf-8') as opened:
        opened.write(json.dumps([name, value]) + '\n')


def fails(test: pytest.Item) -> bool:
    """Run a test; return whether it fails."""
    return any(report.failed for report in runtestprotocol(test, log=False))


def finds(fault: Fault, functions: list[FunctionType], tests: list[pytest.Item]) -> bool:
    """Return whether a test fails after the fault has been planted."""
    plant(fault, functions)
    return any(fails(test) for test in tests)


def looks(test: pytest.Item, name: str, file: Path) -> bool:
    """Add to a file how long a test takes and the lines that it executes; return if it fails."""
    files = {str(ROOT / path): str(path) for path in modules()}
    lines: dict[str, set[int]] = {path: set() for path in files.values()}

    def trace(frame: FrameType, *_: object) -> object:
        path = files.get(frame.f_code.co_filename)
        if path is None:
            return None
        lines[path].add(frame.f_lineno)
        return trace

    begun = time.process_time()
    sys.settrace(trace)
    failed = fails(test)
    sys.settrace(None)
    executed = {path: sorted(those) for path, those in lines.items() if those}
    keep(file, name, [time.process_time() - begun, executed])
    return failed


def forked(task: Callable[[], bool], longest: int) -> int:
    """
    Start a task in a process of its own, of so many seconds of computing at most.

    It exits with 1 if the task returns True, with 0 if False.
    """
    child = os.fork()
    if child:
        return child
    code = 2
    try:
        resource.setrlimit(resource.RLIMIT_CPU, (longest, resource.RLIM_INFINITY))
        resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
        for stream in (1, 2):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
        code = int(task())
    finally:
        os._exit(code)


def looked_at(tests: list[pytest.Item]) -> list[tuple[pytest.Item, float, dict[str, list[int]]]]:
    """Return the tests, each with how long it takes, and its lines by module."""
    shared = hashlib.sha256()
    for folder in ('phase_traj_ros', 'test/support'):
        for path in sorted((ROOT / folder).rglob('*.py')):
            shared.update(path.read_bytes())
    names = {}
    for test in tests:
        digest = shared.copy()
        digest.update(test.path.read_bytes())
        names[f'{digest.hexdigest()} {test.nodeid}'] = test
    file = OUT / 'lines'
    for name in names.keys() - known(file).keys():
        if os.waitpid(forked(partial(looks, names[name], name, file), 600), 0)[1]:
            raise SystemExit(f'a test fails without a fault: {names[name].nodeid}')
    found = known(file)
    return [(test, *found[name]) for name, test in names.items()]


def tried(
    faults: list[Fault], tests: list[pytest.Item], *, seconds: float, jobs: int,
) -> Iterator[tuple[Fault, bool]]:
    """Try faults, some at a time, each with tests of so many seconds; yield who survives."""
    running: dict[int, Fault] = {}
    looked = looked_at(tests)
    # What the tests have frozen is not listed.
    gc.unfreeze()
    functions = [each for each in gc.get_objects() if isinstance(each, FunctionType)]
    # A collection would copy all memory to each process.
    gc.freeze()
    for fault in [*faults, *[None] * jobs]:
        if running and (fault is None or len(running) == jobs):
            child, status = os.wait()
            code = os.waitstatus_to_exitcode(status)
            # A fault that has made a loop endless is found, too.
            if code not in (0, 1, -signal.SIGXCPU):
                raise SystemExit(f'cannot be tried: {running[child].key}')
            yield running.pop(child), code == 0
        if fault is not None:
            place = range(fault.node.lineno, fault.node.end_lineno + 1)
            room = Path(fault.path).parent.name
            chosen, total = [], 0.0
            looked.sort(key=lambda each, room=room: (room not in each[0].nodeid, each[1]))
            for test, takes, lines in looked:
                executed = lines.get(fault.path, [])
                if total < seconds and any(line in place for line in executed):
                    chosen.append(test)
                    total += takes
            running[forked(partial(finds, fault, functions, chosen), 60 + 5 * int(total))] = fault


def main() -> None:
    """Try the faults of the sample that have not been tried, and print the survivors."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--sample', type=int, default=300, help='number of faults')
    parser.add_argument('--seed', type=int, default=18)
    parser.add_argument('--only', default='', metavar='TEXT', help='part of the path of a module')
    parser.add_argument(
        '--seconds', type=float, default=30.0, help='what the tests of a fault may take')
    parser.add_argument('--jobs', type=int, default=1, help='faults that are tried at a time')
    parser.add_argument(
        '--again', action='store_true', help='try those that survived again, with new tests')
    chosen = parser.parse_args()
    every = [fault for path in modules()
             for fault in faults_in(str(path), (ROOT / path).read_text(encoding='utf-8'))]
    sample = random.Random(chosen.seed).sample(every, min(chosen.sample, len(every)))
    sample = [fault for fault in sample if chosen.only in fault.path]
    OUT.mkdir(parents=True, exist_ok=True)
    file = OUT / f'{chosen.seed}'
    survives = known(file)
    rest = [fault for fault in sample
            if fault.key not in survives or (chosen.again and survives[fault.key])]

    class Plugin:
        """Has faults tried instead of the tests run once."""

        def pytest_runtestloop(self, session: pytest.Session) -> bool:
            for fault, survived in tried(
                    rest, session.items, seconds=chosen.seconds, jobs=chosen.jobs):
                survives[fault.key] = survived
                keep(file, fault.key, survived)
            return True

    sys.path.insert(0, str(ROOT))
    package = importlib.import_module('phase_traj_ros')
    if not str(package.__file__).startswith(f'{ROOT}{os.sep}'):
        raise SystemExit(
            f'the tests would import {package.__file__}: install {ROOT} in this environment')
    # The output of a test is dropped where it runs.
    options = ['-q', '-s', '-p', 'no:randomly', '-p', 'no:cacheprovider', '--rootdir', str(ROOT)]
    ended = pytest.main([*options, str(ROOT / 'test' / 'core')], [Plugin()])
    if ended != pytest.ExitCode.OK:
        raise SystemExit(ended)
    for fault in sample:
        if survives[fault.key]:
            print(f'survives: {fault.key}')
    killed = sum(not survives[fault.key] for fault in sample)
    print(f'{killed} of {len(sample)} found, of {len(every)} possible faults'
          f' ({100 * killed / max(len(sample), 1):.0f} %)')


if __name__ == '__main__':
    main()
