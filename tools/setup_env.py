# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Make a virtual environment that holds this package, editable, and what it needs; once.

It knows two kinds of machine. Where a ROS 2 is sourced whose Python has rclpy, that ROS is used
together with its own numpy and OpenCV, and only what is missing is added. Everywhere else ROS
comes as wheels, which exist for CPython 3.10 to 3.13 on Linux, x86_64, glibc 2.28 or newer.

Any Python from 3.8 on can run this script: it looks for a suitable one, and says what to do
where there is none. A failed or interrupted attempt leaves no new environment behind.
"""

from __future__ import annotations

import argparse
import contextlib
from dataclasses import dataclass
import hashlib
import json
import os
from pathlib import Path
import shutil
import signal
import subprocess
import sys

try:
    import fcntl
except ImportError:  # Windows: there are no wheels for it, which is said further down
    fcntl = None

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = 'phase_traj_ros'
STAMP = 'phase_traj_env.json'

WHEEL_PYTHONS = ('3.12', '3.13', '3.11', '3.10')
WHEEL_GLIBC = (2, 28)
# The order in which interpreters are tried: the usual one first.
CANDIDATES = ('python3', *(f'python{version}' for version in WHEEL_PYTHONS), '/usr/bin/python3')

ROS_MODULES = (
    'rclpy', 'builtin_interfaces', 'diagnostic_msgs', 'geometry_msgs', 'nav_msgs',
    'rcl_interfaces', 'rosgraph_msgs', 'sensor_msgs', 'std_msgs', 'std_srvs',
)

# Runs in every interpreter considered, however old.
PROBE = r"""
import json, platform, struct, sys, sysconfig

def lacks(names):
    missing = []
    for name in names:
        try:
            __import__(name)
        except Exception:
            missing.append(name)
    return missing

print(json.dumps({
    # That of the base installation, should this be an activated environment, which may be the
    # very one that is about to be replaced.
    'executable': getattr(sys, '_base_executable', sys.executable),
    'version': list(sys.version_info[:3]),
    'implementation': platform.python_implementation(),
    'free_threaded': bool(sysconfig.get_config_var('Py_GIL_DISABLED')),
    'bits': 8 * struct.calcsize('P'),
    'system': platform.system(),
    'machine': platform.machine(),
    'libc': list(platform.libc_ver()),
    'lacks_venv': lacks(['venv', 'ensurepip']),
    'lacks': lacks(sys.argv[1:]),
}))
"""


class SetupError(Exception):
    """The environment cannot be made; the message says why, and what to do."""


@dataclass(frozen=True)
class Interpreter:
    """A Python that runs, and what its probe found."""

    name: str
    facts: dict

    @property
    def path(self) -> str:
        """Return the executable itself, not the shim or link it was found by."""
        return self.facts['executable']

    @property
    def version(self) -> str:
        """Return the full version, such as 3.12.3."""
        return '.'.join(map(str, self.facts['version']))

    @property
    def minor_version(self) -> str:
        """Return the version as in `python3.12`."""
        return '.'.join(map(str, self.facts['version'][:2]))

    def __str__(self) -> str:
        return f'{self.name} (Python {self.version})'


def child_environment() -> dict[str, str]:
    """Return the environment for child processes, without what would misdirect them."""
    environment = dict(os.environ)
    # The ROS wheels of an activated environment mark their own set-up as done, which would
    # keep those of the new one from doing theirs. The other two would install elsewhere.
    for name in ('_ROS_WHEELS_BOOTSTRAP_COMPLETE', 'PIP_USER', 'PIP_TARGET'):
        environment.pop(name, None)
    environment['PIP_DISABLE_PIP_VERSION_CHECK'] = '1'
    return environment


def probe(name: str, modules: tuple[str, ...] = ()) -> Interpreter | None:
    """Return the interpreter of that name or path, or None if it does not run."""
    path = shutil.which(name)
    if path is None:
        return None
    try:
        done = subprocess.run(
            [path, '-c', PROBE, *modules], env=child_environment(), stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, timeout=60, check=True)
        # Some installations print greetings first.
        return Interpreter(name, json.loads(done.stdout.decode().splitlines()[-1]))
    except (OSError, subprocess.SubprocessError, ValueError, IndexError):
        return None


def behind_shims(version: str) -> list[str]:
    """
    Return the interpreters of that version (such as 3.12) that pyenv has, but has not enabled.

    pyenv puts a `python3.12` on PATH for every version it has; those which are not enabled fail.
    """
    shim = shutil.which(f'python{version}')
    if shim is None or Path(shim).parent.name != 'shims':
        return []
    versions = Path(shim).parent.parent / 'versions'
    return [str(path) for path in sorted(versions.glob(f'{version}.*/bin/python{version}'))]


def venv_advice(interpreter: Interpreter) -> str:
    """Return how to get the venv module for an interpreter."""
    return ('it has no venv module (Debian and Ubuntu: sudo apt install '
            f'python{interpreter.minor_version}-venv)')


def wheels_refuse_platform(interpreter: Interpreter) -> str | None:
    """Return why there are no ROS wheels for this platform, or None if there are."""
    facts = interpreter.facts
    libc, libc_version = facts['libc']
    if facts['system'] != 'Linux':
        return f'for {facts["system"]}, only for Linux'
    if facts['machine'] != 'x86_64':
        return f'for {facts["machine"]}, only for x86_64'
    if libc != 'glibc':
        return 'for this C library, only for glibc'
    if tuple(int(part) for part in libc_version.split('.')[:2]) < WHEEL_GLIBC:
        return f'for glibc {libc_version}, only for 2.28 and newer'
    return None


def wheels_refuse(interpreter: Interpreter, version: str | None) -> str | None:
    """Return why the ROS wheels cannot be used with this interpreter, or None if they can."""
    facts = interpreter.facts
    wanted = WHEEL_PYTHONS if version is None else (version,)
    if interpreter.minor_version not in wanted:
        return f'not {version}' if version else 'there are no ROS wheels for this version'
    if facts['implementation'] != 'CPython':
        return f'it is {facts["implementation"]}, not CPython'
    if facts['free_threaded']:
        return 'it is the free-threaded build'
    if facts['bits'] != 64:
        return 'it is a 32-bit build'
    if facts['lacks_venv']:
        return venv_advice(interpreter)
    return None


def find_for_wheels(asked: str, version: str | None) -> Interpreter:
    """
    Return an interpreter for the ROS wheels.

    asked: the name or path of the interpreter to use, or '' for the first that suits.
    version: the only one that will do, such as '3.12'.
    """
    if os.environ.get('ROS_DISTRO'):
        raise SetupError(
            f'ROS wheels are wanted here, and ROS {os.environ["ROS_DISTRO"]} is sourced.\n'
            'What to do: run this again in a shell where no ROS is sourced.')
    if asked:
        names = [asked]
    else:
        names = [*CANDIDATES] if version is None else [f'python{version}', 'python3']
        for each in WHEEL_PYTHONS if version is None else [version]:
            names += behind_shims(each)

    refusals = []
    for name in names:
        interpreter = probe(name)
        if interpreter is None:
            if asked:
                refusals.append(f'{name}: it does not run')
            continue
        reason = wheels_refuse_platform(interpreter)
        if reason is not None:
            raise SetupError(
                f'there are no ROS 2 wheels {reason}.\n'
                'What to do: install ROS 2 Jazzy (https://docs.ros.org/en/jazzy), source its '
                'setup file\nand run this again; or work in its container image, ros:jazzy.')
        reason = wheels_refuse(interpreter, version)
        if reason is None:
            return interpreter
        refusals.append(f'{interpreter}: {reason}')

    wanted = version or '3.10 to 3.13'
    raise SetupError('\n'.join([
        f'no suitable Python found: CPython {wanted} with its venv module is needed.',
        *(f'  {refusal}' for refusal in dict.fromkeys(refusals)),
        f'What to do: install one, or name the one to use (make PYTHON=/path/to/'
        f'python{version or "3.12"} ...);',
        'or source the setup file of a ROS 2 Jazzy installation, which is then used instead.']))


def find_of_ros(asked: str) -> Interpreter:
    """Return the interpreter of the ROS that is sourced."""
    distro = os.environ['ROS_DISTRO']
    lacking = []
    for name in [asked] if asked else ['python3', '/usr/bin/python3']:
        interpreter = probe(name, ROS_MODULES)
        if interpreter is None:
            continue
        if interpreter.facts['lacks']:
            missing = ', '.join(interpreter.facts['lacks'])
            lacking.append(f'  {interpreter} cannot import {missing}')
        elif interpreter.facts['lacks_venv']:
            raise SetupError(f'{interpreter} cannot be used: {venv_advice(interpreter)}.')
        else:
            return interpreter
    raise SetupError('\n'.join([
        f'ROS {distro} is sourced, but cannot be used:',
        *(lacking or ['  there is no Python that runs']),
        'What to do: source a ROS 2 that has these packages, or run this again in a shell where '
        'no ROS\nis sourced: ROS then comes as wheels.']))


def pins_digest(constraints: str) -> str:
    """Return a digest of everything that says what an extra consists of."""
    digest = hashlib.sha256()
    for name in ('setup.py', 'setup.cfg', constraints):
        digest.update((ROOT / name).read_bytes())
    return digest.hexdigest()


@contextlib.contextmanager
def locked():
    """Let only one of several runs of this script work at a time, for `make -j`."""
    with open(__file__, 'rb') as lock:
        if fcntl is not None:
            fcntl.flock(lock, fcntl.LOCK_EX)
        yield


class Environment:
    """A virtual environment, and the stamp in it that says what was installed."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.python = path / 'bin' / 'python'

    def stamp(self) -> dict:
        """Return what is installed; empty if the environment is absent or does not work."""
        try:
            stamp = json.loads((self.path / STAMP).read_text())
            if stamp['path'] == str(self.path) and probe(str(self.python)) is not None:
                return stamp
        except (OSError, ValueError, KeyError):
            pass
        return {}

    def write_stamp(self, stamp: dict) -> None:
        """Note what is installed."""
        (self.path / STAMP).write_text(json.dumps({**stamp, 'path': str(self.path)}, indent=2))

    def create(self, interpreter: Interpreter, *, system_site_packages: bool) -> None:
        """Make the environment, empty but for pip, in place of any other one."""
        self.remove()
        options = ['--system-site-packages'] if system_site_packages else []
        self._run('venv', [interpreter.path, '-m', 'venv', *options, str(self.path)])

    def remove(self) -> None:
        """Remove the environment, if it is there."""
        shutil.rmtree(self.path, ignore_errors=True)

    def pip(self, *arguments: str) -> None:
        """Run the environment's pip; it prints errors only."""
        self._run(
            f'pip {arguments[0]}',
            [str(self.python), '-m', 'pip', '-qq', '--no-input', *arguments])

    @staticmethod
    def _run(name: str, command: list[str]) -> None:
        done = subprocess.run(
            command, cwd=ROOT, env=child_environment(), stdin=subprocess.DEVNULL, check=False)
        if done.returncode:
            raise SetupError(
                f'{name} failed; its message is above.\n'
                'What to do: see to that (mostly it is the network or the disk), and run this '
                'again.')


def of_ros_options(environment: Environment, extras: set[str]) -> tuple[set[str], list[str]]:
    """
    Return the extras to install beside a ROS, and the constraints to do so under.

    No second numpy or OpenCV may be put over those ROS was built with.
    """
    extras = extras - {'ros'}
    if 'offline' in extras:
        extras = extras - {'offline'} | {'bags', 'plot', 'progress', 'yaml'}
        present = probe(str(environment.python), ('cv2',))
        if present is not None and 'cv2' in present.facts['lacks']:
            extras |= {'vision'}
    shown = subprocess.run(
        [str(environment.python), '-c', 'import numpy; print(numpy.__version__)'],
        env=child_environment(), stdout=subprocess.PIPE, check=True)
    return extras, [f'numpy=={shown.stdout.decode().strip()}']


def install(
        environment: Environment, extras: set[str], constraints: Path | None,
        *, without_package: bool) -> None:
    """Install the package, editable, with those extras."""
    if constraints is None:
        extras, lines = of_ros_options(environment, extras)
        constraints = environment.path / 'constraints.txt'
        constraints.write_text('\n'.join(lines) + '\n')
    wanted = f'[{",".join(sorted(extras))}]' if extras else ''
    environment.pip(
        'install', '--use-pep517', '--constraint', str(constraints), '--editable', f'.{wanted}')
    if without_package:
        environment.pip('uninstall', '--yes', PACKAGE)


def set_up(options: argparse.Namespace) -> None:
    """Bring the environment into the state asked for, if it is not in it."""
    environment = Environment(ROOT / options.venv)
    old = environment.stamp()
    of_ros = bool(os.environ.get('ROS_DISTRO')) and not options.wheels
    kind = f'sourced ROS {os.environ["ROS_DISTRO"]}' if of_ros else 'ROS wheels'

    if old.get('kind') == kind and not options.interpreter:
        interpreter = None  # whichever it was made with
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
    parser.add_argument('--python-version', help='the only version of Python that will do')
    parser.add_argument('--constraints', default='tools/constraints.txt', help='the pins')
    parser.add_argument(
        '--wheels', action='store_true', help='ROS from wheels, although a ROS may be sourced')
    parser.add_argument(
        '--without-package', action='store_true', help='install only what the package needs')
    parser.add_argument(
        '--find', action='store_true', help='only tell whether there is a suitable Python')
    options = parser.parse_args()

    # So that a termination cleans up as an interrupt does.
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
