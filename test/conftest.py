# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Fixtures for all tests."""

import gc
import os
from pathlib import Path
import signal
import sys

from needs import lacking
import pytest

try:
    from hypothesis import HealthCheck, settings
except ImportError:
    pass
else:
    # A slow machine must not make a test fail.
    settings.register_profile(
        'patient', deadline=None, suppress_health_check=[HealthCheck.too_slow])
    settings.load_profile('patient')

# Before numpy and OpenCV are loaded: one thread for each of the processes that share the
# processors.
for variable in ('OPENBLAS_NUM_THREADS', 'OPENCV_FOR_THREADS_NUM'):
    os.environ.setdefault(variable, '1')

collect_ignore = lacking()


def pytest_addoption(parser):
    parser.addoption(
        '--without-scipy', action='store_true', help='as if scipy were not installed')


def pytest_configure(config):
    # A job in the background ignores Ctrl-C, and after nohup the end of its terminal; so would
    # every process that a test ends.
    for number, usual in (
            (signal.SIGINT, signal.default_int_handler), (signal.SIGHUP, signal.SIG_DFL)):
        if signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, usual)
    if config.getoption('--without-scipy'):
        for name in ('scipy', 'scipy.fft', 'scipy.fftpack'):
            sys.modules[name] = None


def shared(folder, variable):
    """Return a folder of data, ../shared/FOLDER beside the project if the variable is not set."""
    beside = Path(__file__).resolve().parents[2] / 'shared' / folder
    root = Path(os.environ.get(variable, beside))
    if not root.is_dir():
        pytest.skip(f'no data in {root} (set {variable})')
    return root


def pytest_make_parametrize_id(val):
    # Each process sends the names of its tests, and a broken file of a megabyte is no name.
    return f'{len(val)} long' if isinstance(val, (bytes, str)) and len(val) > 500 else None


def pytest_collection_modifyitems(items):
    # Tests of processes mostly wait. At the end, the processors would wait with them.
    items.sort(key=lambda item: 'integration' not in item.path.parts)


def pytest_collection_finish():
    # Thousands of tests, which live to the end, cost each collection of garbage time.
    gc.collect()
    gc.freeze()


@pytest.fixture(scope='session')
def kitti_root() -> Path:
    """Return the folder with the KITTI clips; skip the test if there is none."""
    return shared('kitti', 'PHASE_TRAJ_KITTI')


@pytest.fixture(scope='session')
def maps_root() -> Path:
    """Return the folder with the road maps; skip the test if there is none."""
    return shared('maps', 'PHASE_TRAJ_MAPS')
