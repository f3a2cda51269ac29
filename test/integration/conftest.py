# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Real processes over real DDS, each test in a domain of its own."""

from importlib.util import find_spec
from itertools import count
import os

import pytest

# Without ROS there is nothing to run.
collect_ignore_glob = [] if find_spec('rclpy') else ['test_*.py']

# 0 to 101 are safe on every platform; a process id spreads runs that share a machine.
_DOMAINS = (1 + (os.getpid() + number) % 100 for number in count())


def pytest_collection_modifyitems(items):
    """Mark every test of this folder."""
    here = os.path.dirname(__file__)
    for item in items:
        if str(item.path).startswith(here):
            item.add_marker(pytest.mark.integration)


@pytest.fixture(autouse=True)
def domain(monkeypatch, tmp_path):
    """Keep the test's ROS traffic and logs to itself."""
    monkeypatch.setenv('ROS_DOMAIN_ID', str(next(_DOMAINS)))
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    monkeypatch.setenv('ROS_LOG_DIR', str(tmp_path / 'ros_log'))
    monkeypatch.setenv('RCUTILS_COLORIZED_OUTPUT', '0')


@pytest.fixture
def live(domain, tmp_path):
    """Yield a node of the test's own, and the means to start the real one."""
    from live import Live
    with Live(tmp_path) as harness:
        yield harness
