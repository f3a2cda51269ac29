# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Plants small faults in the core, one at a time, and counts how many of them the tests find.

A seeded sample of all faults is tried in a copy of the package: reversed comparisons, exchanged
operators, numbers and signs that are wrong, calls and assignments that are left out. Constants of
a module (tuning) and messages are left alone. The tests of the room are run up to the first that
fails. Results are kept in out/mutants, so a stopped run continues.
"""

from __future__ import annotations

import argparse
import ast
from collections.abc import Callable, Iterator
import copy
from dataclasses import dataclass
import json
import os
from pathlib import Path
import random
import shutil
import subprocess
import sys
import tempfile

ROOT = Path(__file__).resolve().parent.parent
CORE = Path('phase_traj_ros/core')
#: What is mutated: rooms, and the state machine.
TARGETS = ('path', 'road', 'heading', 'reliability', 'codes/from_shift.py',
           'codes/from_turns.py', 'codes/from_heading.py', 'codes/chain.py', 'judge.py')
# Seconds after which the tests of a fault have failed: it has made a loop endless.
_LONGEST = 600

_COMPARED = {
    ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt, ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn,
    ast.NotIn: ast.In}
_OPERATORS = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult,
    ast.FloorDiv: ast.Mult, ast.Mod: ast.Mult}


@dataclass(frozen=True)
class Fault:
    """A fault: where it is, what it changes, and the whole module with it."""

    path: str
    line: int
    column: int
    change: str
    source: str

    @property
    def key(self) -> str:
        """Return what distinguishes this fault from others."""
        return f'{self.path}:{self.line}:{self.column}: {self.change}'


def faults_in(path: str, source: str) -> Iterator[Fault]:
    """Yield all faults that can be planted in a module."""
    tree = ast.parse(source)
    places = [
        (number, node) for number, node in enumerate(ast.walk(tree)) if id(node) in _inside(tree)]
    for number, node in places:
        for change in _changes(node):
            planted = copy.deepcopy(tree)
            spot = next(each for at, each in enumerate(ast.walk(planted)) if at == number)
            before = ast.unparse(spot)
            change(spot)
            ast.fix_missing_locations(planted)
            after = ast.unparse(spot)
            yield Fault(
                path, node.lineno, node.col_offset, f'{before}  ->  {after}',
                ast.unparse(planted))


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


def _changes(node: ast.AST) -> list[Callable[[ast.AST], None]]:
    """Return the functions that plant faults at a node."""
    def put(**values: object) -> Callable[[ast.AST], None]:
        def change(spot: ast.AST) -> None:
            for name, value in values.items():
                setattr(spot, name, value)
        return change

    if isinstance(node, ast.Compare) and type(node.ops[0]) in _COMPARED:
        return [put(ops=[_COMPARED[type(node.ops[0])](), *node.ops[1:]])]
    if isinstance(node, (ast.BinOp, ast.AugAssign)) and type(node.op) in _OPERATORS:
        return [put(op=_OPERATORS[type(node.op)]())]
    if isinstance(node, ast.BoolOp):
        return [put(op=ast.Or() if isinstance(node.op, ast.And) else ast.And())]
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return [put(op=ast.UAdd())]
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        return [put(operand=ast.UnaryOp(ast.Not(), node.operand))]
    if isinstance(node, ast.Constant) and isinstance(node.value, bool):
        return [put(value=not node.value)]
    if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
        return [put(value=node.value + 1)]
    if isinstance(node, ast.Name) and node.id in ('min', 'max'):
        return [put(id='max' if node.id == 'min' else 'min')]
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
        return [put(value=ast.Constant(None))]
    if isinstance(node, ast.IfExp):
        return [put(body=node.orelse, orelse=node.body)]
    return []


def modules() -> list[Path]:
    """Return the modules that are mutated, relative to the root."""
    found = []
    for target in TARGETS:
        path = ROOT / CORE / target
        found += [path] if path.is_file() else sorted(path.glob('[!_]*.py'))
    return [path.relative_to(ROOT) for path in found]


def tests_of(path: str, *, whole: bool) -> list[list[str]]:
    """Return the tests to run for a module: its own, its room's, if wanted the whole core's."""
    room, module = Path(path).parent, Path(path).stem
    tests = Path('test/core') / ('' if room == CORE else room.name)
    own = tests / f'test_{module}.py'
    found = [[str(own)]] if (ROOT / own).exists() else []
    if room != CORE:
        # A small room has a file of tests instead of a folder.
        alone = tests.with_name(f'test_{room.name}.py')
        found.append([str(alone if (ROOT / alone).exists() else tests)])
    core = [str(each.relative_to(ROOT)) for each in sorted((ROOT / 'test/core').glob('test_*.py'))]
    return [*found, core] if whole else found


def survives(fault: Fault, place: Path, *, whole: bool) -> bool:
    """Return whether no test in a copy of the repository finds a fault."""
    sound = (place / fault.path).read_text(encoding='utf-8')
    (place / fault.path).write_text(fault.source, encoding='utf-8')
    try:
        return all(_passes(tests, place) for tests in tests_of(fault.path, whole=whole))
    finally:
        (place / fault.path).write_text(sound, encoding='utf-8')


def _passes(tests: list[str], place: Path) -> bool:
    command = [sys.executable, '-m', 'pytest', '-x', '-q', '-p', 'no:cacheprovider',
               '-p', 'no:randomly', *tests]
    environment = {**os.environ, 'PYTHONPATH': str(place), 'PYTHONDONTWRITEBYTECODE': '1'}
    try:
        return subprocess.run(
            command, cwd=place, env=environment, timeout=_LONGEST, check=False,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0
    except subprocess.TimeoutExpired:
        return False


def main() -> None:
    """Try the faults of the sample that have not been tried, and print the survivors."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--sample', type=int, default=300, help='number of faults')
    parser.add_argument('--seed', type=int, default=18)
    parser.add_argument('--only', default='', metavar='TEXT', help='part of the path of a module')
    parser.add_argument('--most', type=int, metavar='N', help='try the first N of the sample only')
    parser.add_argument(
        '--whole', action='store_true', help="after the tests of the room, run the whole core's")
    parser.add_argument(
        '--again', action='store_true', help='try those that survived again, with new tests')
    chosen = parser.parse_args()
    every = [fault for path in modules()
             for fault in faults_in(str(path), (ROOT / path).read_text(encoding='utf-8'))]
    sample = random.Random(chosen.seed).sample(every, min(chosen.sample, len(every)))
    sample = [fault for fault in sample if chosen.only in fault.path][:chosen.most]
    file = ROOT / 'out' / 'mutants' / f'{chosen.seed}.json'
    tried: dict[str, bool] = json.loads(file.read_text('utf-8')) if file.exists() else {}
    if chosen.again:
        tried = {key: survived for key, survived in tried.items() if not survived}
    with tempfile.TemporaryDirectory() as made:
        place = Path(made)
        for name in ('phase_traj_ros', 'test', 'benchmarks', 'config', 'docs'):
            shutil.copytree(ROOT / name, place / name)
        for name in ('pyproject.toml', 'setup.cfg', 'package.xml'):
            shutil.copy(ROOT / name, place / name)
        # Tests that fail without a fault find nothing.
        for tests in {tuple(tests) for fault in sample if fault.key not in tried
                      for tests in tests_of(fault.path, whole=chosen.whole)}:
            if not _passes(list(tests), place):
                raise SystemExit(f'the tests fail without a fault: {" ".join(tests)}')
        for number, fault in enumerate(sample, 1):
            if fault.key not in tried:
                tried[fault.key] = survives(fault, place, whole=chosen.whole)
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_text(json.dumps(tried, indent=1), encoding='utf-8')
            if tried[fault.key]:
                print(f'{number}: survives: {fault.key}', flush=True)
    killed = sum(not tried[fault.key] for fault in sample)
    print(f'{killed} of {len(sample)} found, of {len(every)} possible faults'
          f' ({100 * killed / max(len(sample), 1):.0f} %)')


if __name__ == '__main__':
    main()
