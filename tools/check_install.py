# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Install the package with colcon, as ROS users do, and check the installation.

Works on a copy in a new, temporary workspace. A part of the tests runs on the installation, one of
each layer; `make test` runs all of them. Needs an environment with colcon and all dependencies
of the package, but without the package.
"""

from __future__ import annotations

from importlib.metadata import PathDistribution
import os
from pathlib import Path
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from xml.etree import ElementTree

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = 'phase_traj_ros'
NOT_SOURCE = shutil.ignore_patterns(
    '.git', '.venv*', '.hypothesis', '.*_cache', '__pycache__', '*.egg-info',
    'build', 'install', 'log', 'out')
NODE_TIMEOUT_S = 60.0
SMOKE = (
    'test/test_package.py', 'test/test_collection.py', 'test/core/codes', 'test/io/messages',
    'test/ros', 'test/cli/test_command_line.py')
# Plugins that a ROS installation adds to pytest's collection.
ROS_PLUGINS = ('launch_testing', 'launch_ros', 'launch_pytest')


class CheckError(Exception):
    """The installation is not as it should be."""


def say(text: str) -> None:
    """Print a progress message."""
    print(f'-- {text}', flush=True)


def colcon(*arguments: str, workspace: Path, environment: dict[str, str]) -> None:
    """Run the colcon of this interpreter in the workspace."""
    program = 'import sys; from colcon_core.command import main; sys.exit(main())'
    done = subprocess.run(
        [sys.executable, '-c', program, *arguments],
        cwd=workspace, env=environment, stdin=subprocess.DEVNULL, check=False)
    if done.returncode:
        raise CheckError(f'colcon {arguments[0]} failed; its messages are above')


def sourced(script: Path, environment: dict[str, str]) -> dict[str, str]:
    """Return the environment of a shell that has sourced the script."""
    done = subprocess.run(
        ['bash', '-c', '. "$0" >&2 && env -0', str(script)],
        env=environment, stdout=subprocess.PIPE, check=True)
    pairs = (entry.partition('=') for entry in done.stdout.decode().split('\0') if entry)
    return {name: value for name, _, value in pairs}


def require(*paths: Path) -> None:
    """Check that all of these exist."""
    for path in paths:
        if not path.exists():
            raise CheckError(f'not installed: {path}')


def check_share(prefix: Path, source: Path) -> None:
    """Check that all data files are installed."""
    share = prefix / 'share'
    require(share / 'ament_index' / 'resource_index' / 'packages' / PACKAGE)
    require(share / PACKAGE / 'package.xml')
    for folder in ('config', 'launch'):
        expected = [path.name for path in (source / folder).iterdir() if path.is_file()]
        if not expected:
            raise CheckError(f'{folder}/ is empty')
        require(*(share / PACKAGE / folder / name for name in expected))


def check_program(program: Path, environment: dict[str, str], folder: Path) -> None:
    """Check that the command-line program runs, from a folder outside the source."""
    require(program)
    done = subprocess.run(
        [str(program), '--version'], cwd=folder, env=environment, stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE, check=False, text=True)
    if done.returncode or not any(part[0].isdigit() for part in done.stdout.split()):
        raise CheckError(f'{program} --version: exit status {done.returncode}, {done.stdout!r}')


def check_node(program: Path, environment: dict[str, str], folder: Path) -> None:
    """Check that the node appears in the graph, and ends with status 0 on SIGINT."""
    import rclpy  # only here: its import needs the environment of this process as it was started

    require(program)
    namespace = f'/check_install_{os.getpid()}'  # others may run on this machine, too
    process = subprocess.Popen(
        [str(program), '--ros-args', '-r', f'__ns:={namespace}'],
        cwd=folder, env=environment, stdin=subprocess.DEVNULL)
    rclpy.init()
    try:
        watcher = rclpy.create_node('check_install')
        deadline = time.monotonic() + NODE_TIMEOUT_S
        while ('phase_traj', namespace) not in watcher.get_node_names_and_namespaces():
            if process.poll() is not None:
                raise CheckError(f'{program}: exit status {process.returncode} at once')
            if time.monotonic() > deadline:
                raise CheckError(f'{program}: no node named phase_traj appeared')
            time.sleep(0.1)
        process.send_signal(signal.SIGINT)
        status = process.wait(NODE_TIMEOUT_S)
        if status != 0:
            raise CheckError(f'{program}: exit status {status} on SIGINT')
    finally:
        rclpy.shutdown()
        if process.poll() is None:
            process.kill()
            process.wait()


def check_colcon(workspace: Path, source: Path, environment: dict[str, str]) -> None:
    """Build, check the installation, run it, test it."""
    say('colcon build')
    colcon('build', workspace=workspace, environment=environment)
    prefix = workspace / 'install' / PACKAGE
    check_share(prefix, source)

    say('the installed programs')
    installed = sourced(workspace / 'install' / 'setup.bash', environment)
    programs = prefix / 'lib' / PACKAGE
    check_program(programs / 'phase_traj', installed, workspace)
    check_node(programs / 'phase_traj_node', installed, workspace)

    check_requirements(prefix)

    say('colcon test')
    colcon('test', '--event-handlers', 'console_direct+', '--pytest-args', *SMOKE,
           workspace=workspace, environment=installed)
    results = workspace / 'build' / PACKAGE / 'pytest.xml'
    require(results)  # without any results, the next command would not find an error
    colcon('test-result', '--verbose', workspace=workspace, environment=installed)
    check_all_ran(results, source, installed)


def check_requirements(prefix: Path) -> None:
    """Check that the package does not require what rosdep has installed under another name."""
    [metadata] = prefix.glob('lib/python*/site-packages/*.egg-info')
    required = [
        each for each in PathDistribution(metadata).requires or [] if 'extra ==' not in each]
    if required != ['setuptools']:
        raise CheckError(f'built by colcon, the package requires {required}')


def check_all_ran(results: Path, source: Path, environment: dict[str, str]) -> None:
    """Check that as many tests ran as pytest finds without the plugins of ROS."""
    done = subprocess.run(
        [sys.executable, '-m', 'pytest', '--collect-only', '-q', *SMOKE,
         *(argument for plugin in ROS_PLUGINS for argument in ('-p', f'no:{plugin}'))],
        cwd=source, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
        check=True, text=True)
    expected = sum('::' in line for line in done.stdout.splitlines())
    ran = sum(
        int(suite.get('tests', 0)) for suite in ElementTree.parse(results).iter('testsuite'))
    if not 0 < expected <= ran:
        raise CheckError(f'colcon test ran {ran} tests, and pytest collects {expected}')
    say(f'{ran} tests ran')


def main() -> int:
    """Run the program; return its exit status."""
    with tempfile.TemporaryDirectory(prefix='phase_traj_ws_') as folder:
        workspace = Path(folder).resolve()
        source = workspace / 'src' / PACKAGE
        shutil.copytree(ROOT, source, ignore=NOT_SOURCE)
        os.environ['COLCON_HOME'] = str(workspace / '.colcon')  # no settings of the user's
        os.environ['ROS_LOG_DIR'] = str(workspace / 'ros_log')
        environment = dict(os.environ)
        try:
            check_colcon(workspace, source, environment)
        except (CheckError, subprocess.CalledProcessError) as error:
            print(f'error: {error}', file=sys.stderr)
            return 1
    say('all checks passed')
    return 0


if __name__ == '__main__':
    sys.exit(main())
