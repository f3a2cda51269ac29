# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The metadata of the package is the same in all places."""

import importlib
from pathlib import Path
import re
import runpy
import sys
from xml.etree import ElementTree

import phase_traj_ros
import pytest

ROOT = Path(__file__).resolve().parent.parent
HEADER = (
    '# Copyright 2026 phase_traj_ros contributors\n'
    '# SPDX-License-Identifier: Apache-2.0\n'
)
CODE = sorted(
    path for folder in ('phase_traj_ros', 'launch', 'tools', 'benchmarks', 'test')
    for path in (ROOT / folder).rglob('*.py'))


def run_setup(monkeypatch, *, for_pip):
    """Return the arguments of setup.py to setuptools, for pip or when run directly."""
    setuptools = pytest.importorskip('setuptools')
    calls = []
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr(setuptools, 'setup', lambda **arguments: calls.append(arguments))
    if for_pip:
        importlib.import_module('setuptools.build_meta')
    else:
        monkeypatch.delitem(sys.modules, 'setuptools.build_meta', raising=False)
    runpy.run_path(str(ROOT / 'setup.py'))
    [arguments] = calls
    return arguments


@pytest.fixture
def setup_arguments(monkeypatch):
    """Return the arguments of setup.py to setuptools when pip builds the package."""
    return run_setup(monkeypatch, for_pip=True)


@pytest.fixture
def manifest():
    """Return the root element of package.xml."""
    return ElementTree.parse(ROOT / 'package.xml').getroot()


@pytest.fixture
def citation():
    """Return the content of CITATION.cff."""
    return pytest.importorskip('yaml').safe_load((ROOT / 'CITATION.cff').read_text())


def test_version_is_that_of_the_manifest_everywhere(setup_arguments, manifest, citation):
    # ROS's release tool writes it into package.xml and setup.py, so both have to hold it.
    version = manifest.findtext('version')
    changelog = (ROOT / 'CHANGELOG.rst').read_text()

    assert {
        'setup.py': setup_arguments['version'],
        'CITATION.cff': citation['version'],
        'phase_traj_ros/__init__.py': phase_traj_ros.__version__,
    } == dict.fromkeys(('setup.py', 'CITATION.cff', 'phase_traj_ros/__init__.py'), version)
    assert re.search(rf'^{re.escape(version)}\b', changelog, re.MULTILINE)


def test_name_is_the_same_everywhere(setup_arguments, manifest, citation):
    assert setup_arguments['name'] == 'phase_traj_ros'
    assert manifest.findtext('name') == 'phase_traj_ros'
    assert citation['title'] == 'phase_traj_ros'
    assert (ROOT / 'resource' / 'phase_traj_ros').is_file()


def test_licence_is_the_same_everywhere(setup_arguments, manifest, citation):
    licence = manifest.find('license')

    assert licence.text == 'Apache-2.0'
    assert setup_arguments['license'] == 'Apache-2.0'
    assert citation['license'] == 'Apache-2.0'
    text = (ROOT / licence.get('file')).read_text()
    assert 'Apache License' in text
    assert 'Version 2.0, January 2004' in text


def test_maintainer_is_the_same_everywhere(setup_arguments, manifest, citation):
    maintainer = manifest.find('maintainer')

    assert setup_arguments['maintainer'] == maintainer.text
    assert setup_arguments['maintainer_email'] == maintainer.get('email')
    assert [author['name'] for author in citation['authors']] == [maintainer.text]


def test_every_package_is_installed(setup_arguments):
    packages = {
        '.'.join(path.parent.relative_to(ROOT).parts)
        for path in (ROOT / 'phase_traj_ros').rglob('*.py')}

    assert set(setup_arguments['packages']) == packages


def test_every_data_file_is_installed(setup_arguments):
    installed = {
        (folder, Path(file).name)
        for folder, files in setup_arguments['data_files'] for file in files}
    expected = {
        ('share/ament_index/resource_index/packages', 'phase_traj_ros'),
        ('share/phase_traj_ros', 'package.xml'),
    }
    for folder in ('config', 'launch'):
        expected |= {
            (f'share/phase_traj_ros/{folder}', path.name)
            for path in (ROOT / folder).iterdir() if path.is_file()}

    assert installed == expected
    assert 'phase_traj.launch.py' in {name for _, name in installed}
    assert 'paper.yaml' in {name for _, name in installed}


def test_every_file_in_the_package_that_is_not_code_is_installed(setup_arguments):
    folder = ROOT / 'phase_traj_ros'
    files = {
        path for path in folder.rglob('*')
        if path.is_file() and path.suffix != '.py' and '__pycache__' not in path.parts}
    installed = {
        path for pattern in setup_arguments['package_data']['phase_traj_ros']
        for path in folder.glob(pattern)}

    assert folder / 'py.typed' in files
    assert files <= installed


def test_all_programs_are_installed(setup_arguments):
    assert setup_arguments['entry_points']['console_scripts'] == [
        'phase_traj = phase_traj_ros.cli.main:main',
        'phase_traj_node = phase_traj_ros.ros.main:main',
    ]


def test_colcon_finds_that_the_tests_are_for_pytest(setup_arguments, manifest):
    # It looks for this name among the requirements of this extra.
    names = [re.split('[ <>=!]', each)[0] for each in setup_arguments['extras_require']['test']]

    assert 'pytest' in names
    assert manifest.findtext('export/build_type') == 'ament_python'


def test_every_imported_ros_package_is_declared(manifest):
    declared = {element.text for element in manifest.iter('exec_depend')}
    imports = re.compile(r'^\s*(?:from|import) ([a-z0-9_]+)', re.MULTILINE)
    imported = {
        name for path in CODE if path.is_relative_to(ROOT / 'phase_traj_ros')
        for name in imports.findall(path.read_text())}
    ros = {
        name for name in imported
        if name.endswith(('_msgs', '_srvs', '_interfaces')) or name.startswith('ament_')
        or name in {'rclpy', 'launch', 'launch_ros', 'tf2_ros', 'cv_bridge'}}

    assert ros <= declared


def names_of(requirements):
    """Return the names of distributions, as package indexes compare them."""
    found = (re.match(r'[A-Za-z0-9._-]+', each) for each in requirements)
    return {re.sub('[-_.]+', '-', each.group()).lower() for each in found if each}


def test_pip_installs_what_the_program_imports(setup_arguments):
    required = names_of(setup_arguments['install_requires'])

    assert required >= {
        'numpy', 'opencv-python-headless', 'rosbags', 'matplotlib', 'tqdm', 'pyyaml',
        'pillow'}


def test_colcon_and_bloom_require_nothing_that_rosdep_names_otherwise(monkeypatch):
    # pkg_resources would refuse to start the programs if a requirement had another name.
    arguments = run_setup(monkeypatch, for_pip=False)

    assert arguments['install_requires'] == ['setuptools']


def test_what_tests_ask_for_is_installed_and_pinned(setup_arguments):
    extras = setup_arguments['extras_require']
    asked = {
        name for path in (ROOT / 'test').rglob('*.py')
        for name in re.findall(r"importorskip\('(\w+)", path.read_text())}
    # Every environment that setup_env.py makes has setuptools, whatever the extras.
    known = names_of(
        each for requirements in [setup_arguments['install_requires'], *extras.values()]
        for each in requirements) - {'setuptools'}
    makefile = (ROOT / 'Makefile').read_text()
    pins = (ROOT / 'tools' / 'constraints.txt').read_text().splitlines()
    for target in ('test', 'noble-environment', 'colcon'):
        [chosen] = re.findall(rf'^{target}:.*\n.* --extras (\S+)', makefile, re.MULTILINE)
        installed = names_of([
            *setup_arguments['install_requires'],
            *(each for name in chosen.split(',') for each in extras[name])])
        assert names_of(asked) & known <= installed, target
        assert installed - {'setuptools'} <= names_of(pins), target


@pytest.mark.parametrize('path', CODE, ids=lambda path: str(path.relative_to(ROOT)))
def test_file_starts_with_the_licence(path):
    # A linter's note may follow the first line.
    text = re.sub(r'\A(.*?)  # noqa: .*', r'\1', path.read_text())
    assert text.startswith(HEADER)
