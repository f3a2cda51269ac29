# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The order of the package's rooms, which decides who may import whom; it is defined here only.

Every import counts, also those inside functions and those under TYPE_CHECKING.
"""

import ast
from pathlib import Path
import re

import pytest

PACKAGE = Path(__file__).resolve().parent.parent / 'phase_traj_ros'
BENCHMARKS = PACKAGE.parent / 'benchmarks'

# For each folder its floors, the lowest first: a floor may import those below it, and what shares
# a floor does not know each other. '*' stands for the folder's other modules, which may.
FLOORS = {
    '': (
        'errors topics', 'core', 'parameter_spec', 'parameters', 'io synthetic', 'tasks', 'ros',
        'cli'),
    'core': (
        'codes', 'correlation', 'frames', 'camera', 'calibration', 'rotation', 'heading', 'road',
        'fixed', 'path', 'localization', 'reliability', '*'),
    'core.localization': (
        'settings given roads', 'estimate filter', 'fixes places', 'claim', 'locator'),
    'io': (
        'user_path', 'outputs params_file images', 'messages', 'sources maps', 'replay',
        'results'),
    'tasks': ('evaluation', 'location', 'batch'),
    'synthetic': (
        'arrays', 'camera', 'textures degradations', 'scene', 'town view', 'drive'),
    'cli': (
        'ending escaping', 'options report', 'commands',
        'program', 'main'),
    'ros': (
        'spin health entities graph', 'startup', 'outputs',
        'inputs saving playback location', 'diagnostics', 'nodes', 'main'),
}
BENCHMARK_FLOORS = {'': ('shared', 'heading quality speed', 'distance turns', 'location')}
# Rooms whose __init__ is a public face: it names what others import from the room.
FACES = ('core', 'io', 'synthetic')
MOST_MODULES = 12

ROS = re.compile(r'(rclpy|rpyutils|launch|tf2|ament)(_\w+)?|\w+_(msgs|srvs|interfaces)')
FILES = re.compile(r'io|os|glob|pathlib|shutil|tempfile')


class Modules:
    """The modules of a package by their names below it, and what each imports."""

    def __init__(self, package):
        self._package = package
        self.files = {}
        for file in sorted(package.rglob('*.py')):
            parts = file.relative_to(package).with_suffix('').parts
            self.files['.'.join(parts[:-1] if parts[-1] == '__init__' else parts)] = file
        self.trees = {name: ast.parse(file.read_text()) for name, file in self.files.items()}
        self.imports = {name: set() for name in self.files}
        self.others = {name: set() for name in self.files}
        for name in self.files:
            for target in self._targets(name):
                self._add(name, target)

    def is_room(self, name):
        return self.files[name].name == '__init__.py'

    def _targets(self, name):
        """Yield the full dotted names that a module imports."""
        for node in ast.walk(self.trees[name]):
            if isinstance(node, ast.Import):
                yield from (alias.name for alias in node.names)
            elif isinstance(node, ast.ImportFrom):
                origin = node.module or ''
                if node.level:
                    here = f'{self._package.name}.{name}'.rstrip('.').split('.')
                    up = node.level - self.is_room(name)
                    origin = '.'.join([*here[:len(here) - up], *filter(None, [node.module])])
                yield from (f'{origin}.{alias.name}' for alias in node.names)

    def _add(self, name, target):
        package, _, inside = target.partition('.')
        if package != self._package.name:
            self.others[name].add(package)
            return
        # What is imported may be a name inside the module.
        while inside not in self.files:
            inside = inside.rpartition('.')[0]
        if inside:
            self.imports[name].add(inside)


def upward(modules, floors):
    """Return the imports that point up, or sideways where a floor's rooms are apart."""
    found = []
    for name, targets in modules.imports.items():
        for target in targets:
            if f'{name}.'.startswith(f'{target}.'):
                found.append(f'{name} imports the face of its own room, {target}')
                continue
            folder, above, below = _parting(name, target)
            if above is None or folder not in floors:
                continue
            ours, theirs = (_floor(floors[folder], part) for part in (above, below))
            if ours < theirs or (ours == theirs and '*' not in floors[folder][ours]):
                found.append(f'{name} -> {target}')
    return sorted(found)


def homeless(modules, floors):
    """Return the modules in an ordered folder that have no place in its order."""
    found = []
    for name in filter(None, modules.files):
        folder, _, part = name.rpartition('.')
        if folder not in floors or part in ' '.join(floors[folder]).split():
            continue
        if '*' not in floors[folder] or modules.is_room(name):
            found.append(name)
    return found


def circular(modules):
    """Return the modules that import themselves through others."""
    return [name for name in modules.files if name in _reached(modules.imports, name)]


def crowded(modules):
    """Return the folders with too many modules, and these."""
    folders = {}
    for name in modules.files:
        if not modules.is_room(name):
            folders.setdefault(name.rpartition('.')[0], []).append(name)
    return {folder: names for folder, names in folders.items() if len(names) > MOST_MODULES}


def _parting(name, target):
    """Return the folder that both are in, and their parts in it; None for the folder itself."""
    ours, theirs = name.split('.') if name else [], target.split('.')
    common = 0
    while common < min(len(ours), len(theirs)) and ours[common] == theirs[common]:
        common += 1
    return (
        '.'.join(ours[:common]), ours[common] if common < len(ours) else None, theirs[common])


def _floor(floors, part):
    for number, names in enumerate(floors):
        if part in names.split():
            return number
    return floors.index('*')


def _reached(imports, start):
    seen, todo = set(), [start]
    while todo:
        new = imports[todo.pop()] - seen
        seen |= new
        todo.extend(new)
    return seen


@pytest.fixture(scope='module')
def modules():
    return Modules(PACKAGE)


def test_the_benchmarks_have_rooms_in_an_order():
    benchmarks = Modules(BENCHMARKS)
    assert homeless(benchmarks, BENCHMARK_FLOORS) == []
    assert upward(benchmarks, BENCHMARK_FLOORS) == []
    assert crowded(benchmarks) == {}


def test_everything_has_its_place(modules):
    assert homeless(modules, FLOORS) == []


def test_no_import_points_up(modules):
    assert upward(modules, FLOORS) == []


def test_no_circle(modules):
    assert circular(modules) == []


def test_only_the_room_for_ros_knows_ros(modules):
    assert [
        f'{name} imports {other}' for name, others in modules.others.items()
        for other in others if ROS.fullmatch(other) and not f'{name}.'.startswith('ros.')] == []
    assert any(ROS.fullmatch(other) for other in modules.others['ros.nodes.node'])


def test_core_knows_no_files(modules):
    assert [
        f'{name} imports {other}' for name, others in modules.others.items()
        for other in others if FILES.fullmatch(other) and f'{name}.'.startswith('core.')] == []


def test_no_folder_is_crowded(modules):
    assert crowded(modules) == {}


def test_every_module_says_what_it_is_for(modules):
    for name, tree in modules.trees.items():
        assert (ast.get_docstring(tree) or '').strip(), name


def test_rooms_hold_nothing_but_their_docstring(modules):
    for name, tree in modules.trees.items():
        if name and name not in FACES and modules.is_room(name):
            assert len(tree.body) == 1, name


def test_the_tests_mirror_the_rooms():
    tests = PACKAGE.parent / 'test'
    folders = {file.parent.relative_to(tests) for file in tests.rglob('test_*.py')}
    assert [
        str(folder) for folder in sorted(folders - {Path('.'), Path('integration')})
        if not any((place / folder).is_dir() for place in (PACKAGE, PACKAGE.parent))] == []


def test_the_readme_shows_the_rooms(modules):
    text = (PACKAGE.parent / 'README.md').read_text()
    [shown] = re.findall(r'^    phase_traj_ros/\n((?:      .*\n)+)', text, re.MULTILINE)
    pictured, room = [], ''
    for line in shown.splitlines():
        # A line is of one room and what it is for, or of several rooms inside the one above.
        names = re.match(r'(?:\w+/ ?)+', line.strip())[0].replace('/', '').split()
        if line.startswith(' ' * 8):
            pictured += [f'{room}.{name}' for name in names]
        else:
            pictured += names
            [room] = names

    rooms = [
        name for name in modules.files
        if name and modules.is_room(name) and name.count('.') < 2]
    assert sorted(pictured) == rooms
    # In the order of the floors, so that what is said below the picture is true.
    for folder in ('core', 'io', 'synthetic', 'tasks'):
        inside = [name for name in pictured if name.startswith(f'{folder}.')]
        floors = [_floor(FLOORS[folder], name.rpartition('.')[2]) for name in inside]
        assert floors == sorted(floors), folder


def test_errors_below_the_command_line_do_not_name_its_options(modules):
    # A caller from Python has no option --topic.
    options = {
        node.value for name, tree in modules.trees.items() if name.startswith('cli.')
        for node in _texts(tree) if re.fullmatch(r'--[a-z-]+', node.value)}
    assert '--topic' in options
    named = re.compile(rf'(?<!\S)({"|".join(options)})(?![\w-])')
    assert [
        f'{name}: {node.value}' for name, tree in modules.trees.items()
        if not name.startswith(('cli.', 'ros.'))
        for call in ast.walk(tree) if isinstance(call, ast.Call)
        and isinstance(call.func, ast.Name) and call.func.id.endswith('Error')
        for node in _texts(call) if named.search(node.value)] == []


def _texts(tree):
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node


@pytest.fixture
def made(tmp_path):
    """Return a function that makes a package: core with the rooms low and high, and io."""
    def make(files):
        for room in ('', 'core', 'core/low', 'core/high', 'io'):
            folder = tmp_path / 'made' / room
            folder.mkdir()
            (folder / '__init__.py').touch()
        for name, text in files.items():
            (tmp_path / 'made' / name).write_text(text)
        return Modules(tmp_path / 'made')
    return make


MADE_FLOORS = {'': ('core', 'io'), 'core': ('low other', 'high', '*')}


@pytest.mark.parametrize('text', [
    'from made.core.high.b import B',
    'from made.core.high import b',
    'import made.core.high.b',
    'from ..high import b',
    'from ...core.high.b import B',
    'def late():\n    from made.core.high import b',
    'if TYPE_CHECKING:\n    import made.core.high.b as b',
])
def test_upward_imports_are_found_however_they_are_written(made, text):
    modules = made({'core/low/a.py': text, 'core/high/b.py': 'B = 1'})

    assert upward(modules, MADE_FLOORS) == ['core.low.a -> core.high.b']
    assert circular(modules) == []


def test_what_else_is_found(made):
    modules = made({
        'core/low/a.py': 'from made.io.c import C',
        'core/other.py': 'from made.core.low.a import A',
        'core/high/b.py': 'from made.core import A',
        'core/chain.py': 'from . import more',
        'core/more.py': 'from made.core.chain import X',
        'io/c.py': 'from made.core.low.a import A',
        'new.py': ''})

    assert upward(modules, MADE_FLOORS) == [
        'core.high.b imports the face of its own room, core', 'core.low.a -> io.c',
        'core.other -> core.low.a']
    assert circular(modules) == ['core.chain', 'core.low.a', 'core.more', 'io.c']
    assert homeless(modules, MADE_FLOORS) == ['new']
