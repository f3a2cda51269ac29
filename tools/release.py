# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Set the version, or check that a tree can be released.

The version is that of package.xml. ROS tools need a copy in setup.py, Python in the package, and
citations in CITATION.cff: --set-version writes all of them and dates the changelog. Without
options, all requirements of a release are checked: no changes, the tag, one version, the
changelog, and the manifest and changelog as bloom reads them. The check needs catkin_pkg.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
import datetime
from pathlib import Path
import re
import subprocess
import sys

ROOT = Path(__file__).resolve().parent.parent
FORTHCOMING = 'Forthcoming'
# The version with its context.
COPIES = {
    'package.xml': r'(<version>)([^<]*)(</version>)',
    'setup.py': r"(^    version=')([^']*)(',$)",
    'phase_traj_ros/__init__.py': r"(^__version__ = ')([^']*)('$)",
    'CITATION.cff': r'(^version: )(\S+)($)',
}


class ReleaseError(Exception):
    """The tree cannot be released; the message says why, and what to do."""


@dataclass(frozen=True)
class Tree:
    """A checkout of the repository."""

    root: Path

    def read(self, name: str) -> str:
        """Return the text of a file."""
        return (self.root / name).read_text(encoding='utf-8')

    def substitute(self, name: str, pattern: str, replacement: str) -> None:
        """Replace the only match of the pattern."""
        text, count = re.subn(pattern, replacement, self.read(name), flags=re.MULTILINE)
        if count != 1:
            raise ReleaseError(f'{name} has {count} places that look like {pattern}, not one')
        (self.root / name).write_text(text, encoding='utf-8')

    def git(self, *arguments: str) -> list[str]:
        """Return the lines printed by a git command."""
        done = subprocess.run(
            ['git', *arguments], cwd=self.root, check=True, stdout=subprocess.PIPE)
        return done.stdout.decode().splitlines()

    def versions(self) -> dict[str, str]:
        """Return the version in each file."""
        found = {
            name: re.search(pattern, self.read(name), re.MULTILINE)
            for name, pattern in COPIES.items()}
        return {name: match[2] if match else '(none)' for name, match in found.items()}

    def sections(self) -> dict[str, str]:
        """Return the text of the changelog's sections by title."""
        parts = re.split(r'^(\S.*)\n-+\n', self.read('CHANGELOG.rst'), flags=re.MULTILINE)[1:]
        return dict(zip(parts[::2], parts[1::2]))


def set_version(tree: Tree, version: str, today: datetime.date) -> None:
    """
    Write the version everywhere, and make it the title of the forthcoming changes.

    Raises
    ------
    ReleaseError
        The version is not three numbers, or the changelog has no forthcoming changes.

    """
    if not re.fullmatch(r'\d+\.\d+\.\d+', version):
        raise ReleaseError(
            f'{version!r} is not a version: give three numbers, make version VERSION=1.2.3')
    if FORTHCOMING not in tree.sections():
        raise ReleaseError(f'CHANGELOG.rst has no section {FORTHCOMING}: nothing to release')
    title = f'{version} ({today.isoformat()})'
    for name, pattern in COPIES.items():
        tree.substitute(name, pattern, rf'\g<1>{version}\g<3>')
    tree.substitute('CITATION.cff', r'^(date-released: ).*$', rf"\g<1>'{today.isoformat()}'")
    tree.substitute('CHANGELOG.rst', rf'^{FORTHCOMING}\n-+$', f'{title}\n{"-" * len(title)}')


def check(tree: Tree) -> str:
    """
    Return the version that can be released from this tree.

    Raises
    ------
    ReleaseError
        The tree is not ready; the message lists all reasons.

    """
    wrong = []
    versions = tree.versions()
    version = versions['package.xml']
    wrong += [
        f'{name} has version {each}, package.xml {version}: make version VERSION={version}'
        for name, each in versions.items() if each != version]
    if tree.git('status', '--porcelain'):
        wrong.append('there are changes that are not committed: commit or remove them')
    tags = tree.git('tag', '--points-at', 'HEAD')
    if version not in tags:
        wrong.append(f'this commit has no tag {version}, but {tags}: git tag {version}')
    titles = list(tree.sections())
    if not titles or not re.fullmatch(rf'{re.escape(version)} \(\d{{4}}-\d\d-\d\d\)', titles[0]):
        wrong.append(
            f'CHANGELOG.rst does not begin with {version} and its date, but with {titles[:1]}')
    wrong += needs_of_bloom(tree.root, version)
    if wrong:
        raise ReleaseError('\n       '.join(wrong))
    return version


def needs_of_bloom(root: Path, version: str) -> list[str]:
    """Return what bloom would refuse or omit, according to the library that it uses."""
    from catkin_pkg.changelog import get_changelog_from_path
    from catkin_pkg.package import InvalidPackage, parse_package

    wrong, warnings = [], []
    try:
        package = parse_package(str(root), warnings=warnings)
    except InvalidPackage as error:
        return [f'package.xml: {error}']
    wrong += [f'package.xml: {each}' for each in warnings]
    for license_ in package.licenses:
        if license_.file and not (root / license_.file).is_file():
            wrong.append(f'package.xml names the licence {license_.file}, which does not exist')
    try:
        changelog = get_changelog_from_path(str(root), package.name)
        changelog.get_content_of_version(version)
    except (AttributeError, KeyError) as error:
        wrong.append(f'bloom does not find {version} in CHANGELOG.rst: {error}')
    return wrong


def main() -> int:
    """Run the program; return its exit status."""
    parser = argparse.ArgumentParser(description='Set the version, or check a release.')
    parser.add_argument('--set-version', metavar='X.Y.Z', help='write this version everywhere')
    parser.add_argument(
        '--changes', metavar='FILE', type=Path, help='write the changes of the version here')
    options = parser.parse_args()
    tree = Tree(ROOT)
    try:
        if options.set_version is not None:
            set_version(tree, options.set_version, datetime.date.today())
            print(f'version {options.set_version}: now commit, git tag {options.set_version}, '
                  'make release')
            return 0
        version = check(tree)
        if options.changes:
            title, text = next(iter(tree.sections().items()))
            options.changes.write_text(
                f'{title}\n{"-" * len(title)}\n{text.rstrip()}\n', encoding='utf-8')
        print(f'version {version} can be released')
    except ReleaseError as error:
        print(f'error: {error}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
