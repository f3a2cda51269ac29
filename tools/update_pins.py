# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Renew tools/constraints.txt: the newest versions that setup.py allows, for every Python.

Needs all the Pythons that have ROS wheels. Run the tests before committing what it wrote.
"""

from __future__ import annotations

import os
from pathlib import Path
import re
import subprocess
import sys
import tempfile

from setup_env import child_environment, find_for_wheels, PACKAGE, ROOT, SetupError, WHEEL_PYTHONS

EXTRAS = 'ros,offline,test,bench,lint,colcon'
# Part of the environment rather than of what is tested; the extras limit it where it matters.
NOT_PINNED = ('pip', 'setuptools', 'wheel', PACKAGE.replace('_', '-'))
HEADER = """\
# What `make` installs where no ROS is sourced: every version, for each Python.
# Written by `make pins`; what is wanted at all is in setup.py.
"""


def normalised(name: str) -> str:
    """Return the name of a distribution as package indexes compare it."""
    return re.sub('[-_.]+', '-', name).lower()


def newest(version: str, folder: Path) -> dict[str, str]:
    """Return the distributions that a new environment of that Python gets, by name."""
    python = folder / 'bin' / 'python'
    environment = child_environment()
    for command in (
        [find_for_wheels('', version).path, '-m', 'venv', str(folder)],
        [str(python), '-m', 'pip', '--quiet', 'install', '--use-pep517', '--editable',
         f'.[{EXTRAS}]'],
    ):
        subprocess.run(command, cwd=ROOT, env=environment, check=True)
    listed = subprocess.run(
        [str(python), '-m', 'pip', 'list', '--format', 'freeze'],
        env=environment, stdout=subprocess.PIPE, check=True, text=True)
    pins = {}
    for line in listed.stdout.splitlines():
        name, _, pin = line.partition('==')
        pins[normalised(name)] = pin
    # The wheel ros-rclpy brings the metadata of rclpy along, which nobody can install.
    return {
        name: pin for name, pin in pins.items()
        if name not in NOT_PINNED and f'ros-{name}' not in pins}


def merged(by_python: dict[str, dict[str, str]]) -> list[str]:
    """Return the lines of a constraints file: one a distribution, or one a version of it."""
    pythons = sorted(by_python)
    lines = []
    for name in sorted(set().union(*by_python.values())):
        users: dict[str, list[str]] = {}
        for python in pythons:
            if name in by_python[python]:
                users.setdefault(by_python[python][name], []).append(python)
        for pin, using in users.items():
            line = f'{name}=={pin}'
            if len(users) > 1:
                line += f' ; python_version >= "{using[0]}" and python_version <= "{using[-1]}"'
            lines.append(line)
    return lines


def main() -> int:
    """Run the program; return its exit status."""
    by_python = {}
    try:
        for version in WHEEL_PYTHONS:
            print(f'Python {version} ...', flush=True)
            with tempfile.TemporaryDirectory() as folder:
                by_python[version] = newest(version, Path(folder, 'venv'))
    except (SetupError, subprocess.CalledProcessError) as error:
        print(f'error: {error}', file=sys.stderr)
        return 1
    path = ROOT / 'tools' / 'constraints.txt'
    temporary = path.with_suffix('.new')
    temporary.write_text('\n'.join([HEADER, *merged(by_python), '']))
    os.replace(temporary, path)
    return 0


if __name__ == '__main__':
    sys.exit(main())
