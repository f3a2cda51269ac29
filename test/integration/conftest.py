# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Real processes over real DDS, each test in a domain of its own."""

from contextlib import contextmanager
import fcntl
from importlib.util import find_spec
import os
from pathlib import Path
import tempfile

import pytest

# Without ROS there is nothing to run.
collect_ignore_glob = [] if find_spec('rclpy') else ['test_*.py']

# 0 to 101 are safe on every platform.
_DOMAINS = range(1, 102)
# Of Fast DDS; others ignore it.
_DISCOVERY = Path(__file__).parents[1] / 'support' / 'discovery.xml'


@contextmanager
def free_domain():
    """Yield a domain that no other test on this machine uses, and the locked file that says so."""
    for domain in _DOMAINS:
        path = Path(tempfile.gettempdir()) / f'phase_traj_ros_domain_{domain}'
        with path.open('w') as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                continue
            yield domain, file
            return
    raise RuntimeError('every ROS domain is in use')


def pytest_collection_modifyitems(items):
    """Mark every test of this folder."""
    here = os.path.dirname(__file__)
    for item in items:
        if str(item.path).startswith(here):
            item.add_marker(pytest.mark.integration)


@contextmanager
def own_domain(monkeypatch, folder):
    """Set the environment for ROS in a domain of its own; yield the file that holds it."""
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    monkeypatch.setenv('ROS_LOG_DIR', str(folder / 'ros_log'))
    monkeypatch.setenv('RCUTILS_COLORIZED_OUTPUT', '0')
    monkeypatch.setenv('FASTRTPS_DEFAULT_PROFILES_FILE', str(_DISCOVERY))
    with free_domain() as (number, lock):
        monkeypatch.setenv('ROS_DOMAIN_ID', str(number))
        yield lock


@pytest.fixture(autouse=True)
def domain(monkeypatch, tmp_path):
    """Keep the test's ROS traffic and logs to itself."""
    with own_domain(monkeypatch, tmp_path) as lock:
        yield lock


@pytest.fixture
def live(domain, tmp_path):
    """Yield a node of the test's own, and the means to start the real one."""
    from live import Live
    with Live(tmp_path, lock=domain) as harness:
        yield harness


@pytest.fixture(scope='module')
def shared_live(tmp_path_factory):
    """Yield what ``live`` does, for a node that several tests share."""
    from live import Live
    folder = tmp_path_factory.mktemp('shared')
    with (pytest.MonkeyPatch.context() as monkeypatch,
          own_domain(monkeypatch, folder) as lock, Live(folder, lock=lock) as harness):
        yield harness


@pytest.fixture
def run(live):
    """Return a function that starts the node by the paper's rule and listens to its codes."""
    from coded import started
    return lambda *arguments, **named: started(live, *arguments, **named)


@pytest.fixture(scope='module')
def shared_node(shared_live):
    """Start the node that tests share, and listen to its codes."""
    from coded import started
    return started(shared_live)


@pytest.fixture
def tuned(shared_live, shared_node):
    """Return a function that resets the shared node, with parameters for one test."""
    from coded import restart
    from phase_traj_ros.parameters import specs
    changed = {}

    def tune(parameters=()):
        changed.update(parameters)
        for name, value in changed.items():
            answer = shared_live.set_parameter(name, value)
            assert answer.successful, answer.reason
        restart(shared_live, shared_node)
        return shared_node

    yield tune
    defaults = {each.name: each.default for each in specs()}
    for name in changed:
        assert shared_live.set_parameter(name, defaults[name]).successful
