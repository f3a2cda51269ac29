# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Find a Python that suits this package, or explain why there is none and what to do."""

from __future__ import annotations

from dataclasses import dataclass
import json
import os
from pathlib import Path
import shutil
import subprocess

WHEEL_PYTHONS = ('3.12', '3.13', '3.11', '3.10')
WHEEL_GLIBC = (2, 28)
# The order in which interpreters are tried: the default one first.
CANDIDATES = ('python3', *(f'python{version}' for version in WHEEL_PYTHONS), '/usr/bin/python3')

ROS_MODULES = (
    'rclpy', 'builtin_interfaces', 'diagnostic_msgs', 'geometry_msgs', 'nav_msgs',
    'rcl_interfaces', 'rosgraph_msgs', 'sensor_msgs', 'std_msgs', 'std_srvs',
)

# Runs in every candidate, whatever its version.
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
    """A working Python, and the results of its probe."""

    name: str
    facts: dict

    @property
    def path(self) -> str:
        """Return the executable itself, not the shim or link that led to it."""
        return self.facts['executable']

    @property
    def version(self) -> str:
        """Return the full version, such as 3.12.3."""
        return '.'.join(map(str, self.facts['version']))

    @property
    def minor_version(self) -> str:
        """Return the version in the form of `python3.12`."""
        return '.'.join(map(str, self.facts['version'][:2]))

    def __str__(self) -> str:
        return f'{self.name} (Python {self.version})'


def child_environment() -> dict[str, str]:
    """Return the environment for child processes, without variables that misdirect them."""
    environment = dict(os.environ)
    # The ROS wheels of an activated environment mark their set-up as done, which would keep those
    # of the new one from doing theirs. The other two variables install elsewhere.
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
        # Some installations print other text first.
        return Interpreter(name, json.loads(done.stdout.decode().splitlines()[-1]))
    except (OSError, subprocess.SubprocessError, ValueError, IndexError):
        return None


def behind_shims(version: str) -> list[str]:
    """
    Return the interpreters of that version (such as 3.12) that pyenv has, but has not enabled.

    pyenv puts a `python3.12` on PATH for every version it has. Those not enabled fail.
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


def wheels_refuse(interpreter: Interpreter, version: str | None) -> str | None:
    """Return why the ROS wheels cannot be used with this interpreter, or None if they can."""
    facts = interpreter.facts
    libc, libc_version = facts['libc']
    if facts['system'] != 'Linux' or facts['machine'] != 'x86_64':
        return f'there are no ROS wheels for {facts["system"]} on {facts["machine"]}'
    if libc != 'glibc' or tuple(map(int, libc_version.split('.')[:2])) < WHEEL_GLIBC:
        return f'there are no ROS wheels for {libc or "this C library"} {libc_version}'.rstrip()
    if version and interpreter.minor_version != version:
        return f'not {version}'
    if interpreter.minor_version not in WHEEL_PYTHONS:
        return 'there are no ROS wheels for this version'
    if facts['implementation'] != 'CPython' or facts['free_threaded'] or facts['bits'] != 64:
        return 'there are ROS wheels only for the usual 64-bit build of CPython'
    if facts['lacks_venv']:
        return venv_advice(interpreter)
    return None


def find_for_wheels(asked: str, version: str | None) -> Interpreter:
    """
    Return an interpreter for the ROS wheels.

    asked: the name or path of the interpreter to use, or '' for the first suitable one.
    version: the only suitable version, such as '3.12'.
    """
    if os.environ.get('ROS_DISTRO'):
        raise SetupError(
            f'ROS wheels were requested, but ROS {os.environ["ROS_DISTRO"]} is sourced.\n'
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
        reason = wheels_refuse(interpreter, version)
        if reason is None:
            return interpreter
        refusals.append(f'{interpreter}: {reason}')

    raise SetupError('\n'.join([
        f'no suitable Python found: CPython {version or "3.10 to 3.13"} with its venv module is '
        'required,\non Linux, x86_64, glibc 2.28 or newer.',
        *(f'  {refusal}' for refusal in dict.fromkeys(refusals)),
        f'What to do: install one, or give the one to use (make PYTHON=/path/to/'
        f'python{version or "3.12"} ...);',
        'or source the setup file of a ROS 2 Jazzy installation (https://docs.ros.org/en/jazzy),\n'
        'which is then used instead; or work in its container image, ros:jazzy.']))


def find_of_ros(asked: str) -> Interpreter:
    """Return the interpreter of the sourced ROS."""
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
