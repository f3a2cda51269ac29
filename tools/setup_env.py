# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Make a virtual environment with this package, editable, and its dependencies, if necessary.

There are two cases. If a ROS 2 is sourced whose Python has rclpy, that ROS is used with its own
numpy and OpenCV, and only what is missing is added. Otherwise ROS comes as wheels, which exist for
CPython 3.10 to 3.13 on Linux, x86_64, glibc 2.28 or newer.

Any Python from 3.8 on can run this script: it searches for a suitable one, and says what to do if
there is none. A failed or interrupted run leaves no new environment.
"""

from __future__ import annotations

import argparse
import contextlib
import fcntl
import hashlib
import json
import os
from pathlib import Path
import shutil
import signal
import subprocess
import sys

from find_python import (
    child_environment, find_for_wheels, find_of_ros, Interpreter, probe, SetupError)

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = 'phase_traj_ros'
STAMP = 'phase_traj_env.json'


def pins_digest(constraints: str) -> str:
    """Return a digest of everything that defines the content of an extra."""
    digest = hashlib.sha256()
    for name in ('setup.py', 'setup.cfg', constraints):
        digest.update((ROOT / name).read_bytes())
    return digest.hexdigest()


@contextlib.contextmanager
def locked():
    """Let only one of several runs of this script work at a time, for `make -j`."""
    with open(__file__, 'rb') as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


class Environment:
    """A virtual environment, and its stamp, which records what was installed."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.python = path / 'bin' / 'python'

    def stamp(self) -> dict:
        """Return what is installed; empty if the environment is absent or broken."""
        try:
            stamp = json.loads((self.path / STAMP).read_text())
            if stamp['path'] == str(self.path) and probe(str(self.python)) is not None:
                return stamp
        except (OSError, ValueError, KeyError):
            pass
        return {}

    def write_stamp(self, stamp: dict) -> None:
        """Record what is installed."""
        (self.path / STAMP).write_text(json.dumps({**stamp, 'path': str(self.path)}, indent=2))

    def create(self, interpreter: Interpreter, *, system_site_packages: bool) -> None:
        """Make the environment with pip only, and replace any other one."""
        self.remove()
        options = ['--system-site-packages'] if system_site_packages else []
        self._run('venv', [interpreter.path, '-m', 'venv', *options, str(self.path)])

    def remove(self) -> None:
        """Remove the environment, if it exists."""
        shutil.rmtree(self.path, ignore_errors=True)

    def pip(self, *arguments: str) -> None:
        """Run the environment's pip, which prints errors only."""
        self._run(
            f'pip {arguments[0]}',
            [str(self.python), '-m', 'pip', '-qq', '--no-input', *arguments])

    def install(self, *arguments: str) -> None:
        """
        Install with uv, which takes a fifth of pip's time.

        uv does not read pip's configuration, such as that of a mirror: where it fails, pip
        installs, and says what is wrong.
        """
        self.pip('install', '--constraint', str(ROOT / 'tools' / 'constraints.txt'), 'uv')
        done = subprocess.run(
            [str(self.python), '-m', 'uv', '--system-certs', '--quiet', 'pip', 'install',
             '--python', str(self.python), *arguments],
            cwd=ROOT, env=child_environment(), stdin=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL, check=False)
        if done.returncode:
            self.pip('install', '--use-pep517', *arguments)

    def output(self, program: str, *arguments: str) -> str:
        """Return the output of a Python program run in the environment."""
        done = subprocess.run(
            [str(self.python), '-c', program, *arguments], env=child_environment(),
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, check=True)
        return done.stdout.decode().strip()

    @staticmethod
    def _run(name: str, command: list[str]) -> None:
        done = subprocess.run(
            command, cwd=ROOT, env=child_environment(), stdin=subprocess.DEVNULL, check=False)
        if done.returncode:
            raise SetupError(
                f'{name} failed; its message is above.\n'
                'What to do: fix that (mostly it is the network or the disk), and run this '
                'again.')


# Runs in an environment that holds the package without its dependencies, and prints these.
REQUIRED = """
import importlib.metadata, importlib.util, json, sys
from pip._vendor.packaging.requirements import Requirement

package, *extras = sys.argv[1:]
wanted = []
for each in map(Requirement, importlib.metadata.requires(package) or []):
    if each.marker and not any(each.marker.evaluate({'extra': one}) for one in ['', *extras]):
        continue
    # OpenCV's module, from any distribution.
    if each.name.startswith('opencv-') and importlib.util.find_spec('cv2'):
        continue
    parts = f'[{",".join(sorted(each.extras))}]' if each.extras else ''
    wanted.append(f'{each.name}{parts}{each.specifier}')
print(json.dumps(wanted))
"""


def install_beside_ros(environment: Environment, extras: set[str]) -> None:
    """
    Install the package, editable, and its dependencies that the ROS does not have.

    No second numpy or OpenCV may replace those ROS was built with. So the package is installed
    without dependencies. Missing ones follow, but no OpenCV if there is one.
    """
    environment.pip('install', '--use-pep517', '--no-deps', '--editable', '.')
    numpy = environment.output('import numpy; print(numpy.__version__)')
    constraints = environment.path / 'constraints.txt'
    constraints.write_text(f'numpy=={numpy}\n')
    wanted = json.loads(environment.output(REQUIRED, PACKAGE, *sorted(extras - {'ros'})))
    environment.pip('install', '--constraint', str(constraints), *wanted)


def install(
        environment: Environment, extras: set[str], constraints: Path | None,
        *, without_package: bool) -> None:
    """Install the package, editable, with those extras."""
    if constraints is None:
        install_beside_ros(environment, extras)
    else:
        wanted = f'[{",".join(sorted(extras))}]' if extras else ''
        environment.install('--constraint', str(constraints), '--editable', f'.{wanted}')
    if without_package:
        environment.pip('uninstall', '--yes', PACKAGE)


def set_up(options: argparse.Namespace) -> None:
    """Bring the environment into the requested state, if it is not in it."""
    environment = Environment(ROOT / options.venv)
    old = environment.stamp()
    of_ros = bool(os.environ.get('ROS_DISTRO')) and not options.wheels
    kind = f'sourced ROS {os.environ["ROS_DISTRO"]}' if of_ros else 'ROS wheels'

    if old.get('kind') == kind and not options.interpreter:
        interpreter = None  # the one it was made with
    else:
        interpreter = (
            find_of_ros(options.interpreter) if of_ros
            else find_for_wheels(options.interpreter, options.python_version))
        if old.get('kind') == kind and old.get('interpreter') == interpreter.path:
            interpreter = None

    pins = pins_digest(options.constraints)
    extras = set(options.extras.split(','))
    if interpreter is None:
        if old['pins'] == pins and extras <= set(old['extras']):
            return
        extras |= set(old['extras'])
        print(f'Updating {options.venv} ...', flush=True)
    else:
        print(f'Setting up {options.venv} with {interpreter} and {kind}; this takes a minute or '
              'two ...', flush=True)

    constraints = None if of_ros else ROOT / options.constraints
    try:
        if interpreter is not None:
            environment.create(interpreter, system_site_packages=of_ros)
        install(environment, extras, constraints, without_package=options.without_package)
        environment.write_stamp({
            'kind': kind,
            'interpreter': old['interpreter'] if interpreter is None else interpreter.path,
            'pins': pins,
            'extras': sorted(extras),
        })
    except BaseException:
        if interpreter is not None:
            environment.remove()
        raise


def main() -> int:
    """Run the program; return its exit status."""
    parser = argparse.ArgumentParser(description='Make a virtual environment for this package.')
    parser.add_argument('venv', help='folder of the environment, relative to the repository')
    parser.add_argument('--extras', required=True, help='extras of setup.py, joined by commas')
    parser.add_argument('--interpreter', default='', help='the Python to use, a name or a path')
    parser.add_argument('--python-version', help='the only suitable version of Python')
    parser.add_argument('--constraints', default='tools/constraints.txt', help='the pins')
    parser.add_argument(
        '--wheels', action='store_true', help='ROS from wheels, even if a ROS is sourced')
    parser.add_argument(
        '--without-package', action='store_true', help='install only the dependencies')
    parser.add_argument(
        '--find', action='store_true', help='only report whether there is a suitable Python')
    options = parser.parse_args()

    # So that a termination cleans up like an interrupt.
    signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))
    try:
        if options.find:
            print(find_for_wheels(options.interpreter, options.python_version))
            return 0
        with locked():
            set_up(options)
    except SetupError as error:
        print(f'error: {error}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == '__main__':
    sys.exit(main())
