# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A release has one version everywhere, and requires a tree that is ready."""

import datetime
import importlib.util
from pathlib import Path
import shutil
import subprocess
import sys

import pytest

ROOT = Path(__file__).resolve().parents[2]
TODAY = datetime.date(2030, 1, 2)
NAMES = (
    'package.xml', 'setup.py', 'CITATION.cff', 'CHANGELOG.rst', 'LICENSE',
    'phase_traj_ros/__init__.py')


@pytest.fixture(scope='module')
def tool():
    """Return the module tools/release.py, which is not installed."""
    spec = importlib.util.spec_from_file_location('release', ROOT / 'tools' / 'release.py')
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look there
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def tree(tool, tmp_path):
    """Return a repository with the files of a release, and forthcoming changes."""
    if shutil.which('git') is None:
        pytest.skip('no git')
    for name in NAMES:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    changelog = (tmp_path / 'CHANGELOG.rst').read_text()
    if 'Forthcoming\n---' not in changelog:
        head, _, rest = changelog.partition('\n\n')
        (tmp_path / 'CHANGELOG.rst').write_text(
            f'{head}\n\nForthcoming\n-----------\n* A change.\n\n{rest}')
    git(tmp_path, 'init', '--quiet')
    return tool.Tree(tmp_path)


def git(folder, *arguments):
    subprocess.run(
        ['git', '-c', 'user.name=Test', '-c', 'user.email=test@example.org', *arguments],
        cwd=folder, check=True, capture_output=True)


def commit(tree, tag=None):
    git(tree.root, 'add', '--all')
    git(tree.root, 'commit', '--quiet', '--message', 'Release')
    if tag:
        git(tree.root, 'tag', tag)


def test_a_version_is_set_everywhere(tool, tree):
    tool.set_version(tree, '1.2.3', TODAY)

    assert set(tree.versions().values()) == {'1.2.3'}
    assert next(iter(tree.sections())) == '1.2.3 (2030-01-02)'
    assert "date-released: '2030-01-02'" in tree.read('CITATION.cff')


@pytest.mark.parametrize('version', ['1.2', 'v1.2.3', '', '1.2.3rc1'])
def test_what_is_not_a_version_is_refused(tool, tree, version):
    with pytest.raises(tool.ReleaseError, match='three numbers'):
        tool.set_version(tree, version, TODAY)


def test_a_tagged_tree_is_released(tool, tree):
    pytest.importorskip('catkin_pkg')
    tool.set_version(tree, '1.2.3', TODAY)
    commit(tree, '1.2.3')

    assert tool.check(tree) == '1.2.3'


def spoil_tag(tree):
    git(tree.root, 'tag', '--delete', '1.2.3')


def spoil_cleanness(tree):
    (tree.root / 'LICENSE').write_text('changed')


def spoil_version(tree):
    tree.substitute('setup.py', r"version='1.2.3'", "version='1.2.4'")


def spoil_changelog(tree):
    tree.substitute('CHANGELOG.rst', r'^1\.2\.3 \(.*\)\n-+$', 'Forthcoming\n-----------')


def spoil_licence(tree):
    (tree.root / 'LICENSE').unlink()


def spoil_manifest(tree):
    tree.substitute('package.xml', r'<maintainer .*</maintainer>', '')


@pytest.mark.parametrize(('spoil', 'said'), [
    (spoil_tag, 'no tag 1.2.3'),
    (spoil_cleanness, 'not committed'),
    (spoil_version, 'setup.py has version 1.2.4'),
    (spoil_changelog, 'does not begin with 1.2.3'),
    (spoil_licence, 'LICENSE, which does not exist'),
    (spoil_manifest, 'maintainer'),
])
def test_everything_missing_is_reported(tool, tree, spoil, said):
    pytest.importorskip('catkin_pkg')
    tool.set_version(tree, '1.2.3', TODAY)
    commit(tree, '1.2.3')
    spoil(tree)

    with pytest.raises(tool.ReleaseError, match=said):
        tool.check(tree)
