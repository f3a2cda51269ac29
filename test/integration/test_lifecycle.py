# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The managed node, through its services."""

import json

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import GetState
from live import image, LATCHED, SHIFT, stop
import numpy as np
import pytest
from std_msgs.msg import String, UInt8

SECOND = 1_000_000_000


@pytest.fixture
def managed(live):
    """Return the means to start a managed node, and to ask its state."""
    class Managed:

        def start(self, *arguments):
            self.process = live.start(*SHIFT, *arguments, '-p', 'autostart:=false')
            self.state()
            # Its services can be known before the node is.
            live.until(
                lambda: 'phase_traj' in live.node.get_node_names(), process=self.process)

        def state(self):
            return live.call(
                GetState, '/phase_traj/get_state', GetState.Request()).current_state.id

    return Managed()


def show(camera, positions, start_ns):
    frame = np.kron(
        np.random.default_rng(0).integers(0, 256, (24, 40), np.uint8), np.ones((4, 4), np.uint8))
    for index, position in enumerate(positions):
        camera.publish(image(np.roll(frame, position, axis=1), start_ns + index * SECOND // 10))


def topics(live):
    """Return what is published; DDS itself tells that, also if the list of nodes is late."""
    return {name for name in ('/phase_traj/movement', '/phase_traj/path')
            if live.node.count_publishers(name)}


def work(live, managed, start_ns):
    """Activate, show five images, look at what comes of them, deactivate."""
    movement = live.listen(UInt8, 'phase_traj/movement')
    texts = live.listen(String, 'phase_traj/chain_code', LATCHED)
    assert live.change_state(Transition.TRANSITION_ACTIVATE)
    assert managed.state() == State.PRIMARY_STATE_ACTIVE
    camera = live.camera()
    live.until(lambda: texts and texts[-1].data.startswith('frames 0;'))
    show(camera, [0, 2, 32, 62, 64], start_ns)
    live.until(lambda: len(movement) == 4, process=managed.process)
    # Each activation starts anew: its first pair is forward.
    assert [each.data for each in movement] == [1, 0, 3, 1]
    assert live.change_state(Transition.TRANSITION_DEACTIVATE)
    live.until(lambda: camera.get_subscription_count() == 0)
    live.node.destroy_publisher(camera)
    for subscription in list(live.node.subscriptions):
        live.node.destroy_subscription(subscription)


def test_configure_activate_deactivate_cleanup_and_again(live, managed):
    managed.start()
    assert managed.state() == State.PRIMARY_STATE_UNCONFIGURED
    for start_ns in (100 * SECOND, 200 * SECOND):
        assert '/phase_traj/movement' not in topics(live)
        assert live.change_state(Transition.TRANSITION_CONFIGURE)
        live.until(lambda: '/phase_traj/movement' in topics(live))
        assert live.node.count_subscribers('/image') == 0
        work(live, managed, start_ns)
        work(live, managed, start_ns + 10 * SECOND)
        assert live.change_state(Transition.TRANSITION_CLEANUP)
        live.until(lambda: '/phase_traj/movement' not in topics(live))
    assert managed.state() == State.PRIMARY_STATE_UNCONFIGURED
    assert stop(managed.process) == 0
    assert 'Traceback' not in live.logs()


def test_an_image_that_cannot_be_used_is_reported_once(live, managed):
    managed.start()
    reports = live.listen(DiagnosticArray, '/diagnostics', 10)
    assert live.change_state(Transition.TRANSITION_CONFIGURE)
    assert live.change_state(Transition.TRANSITION_ACTIVATE)
    bad = image(np.zeros((96, 160), np.uint8), SECOND)
    bad.encoding = 'unknown'
    live.camera().publish(bad)
    live.until(lambda: reports and reports[-1].status[0].level == DiagnosticStatus.ERROR)
    assert live.change_state(Transition.TRANSITION_DEACTIVATE)
    reports.clear()
    assert live.change_state(Transition.TRANSITION_ACTIVATE)
    live.until(lambda: reports)
    assert reports[0].status[0].level != DiagnosticStatus.ERROR


def test_an_inactive_node_takes_a_threshold_and_saves_its_drive(live, managed, tmp_path):
    managed.start('-p', 'code_source:=auto', '-p', f'output_dir:={tmp_path}')
    assert live.change_state(Transition.TRANSITION_CONFIGURE)
    assert live.set_parameter('threshold', 16.0).successful
    work(live, managed, 100 * SECOND)
    assert live.set_parameter('threshold', 60.0).successful
    assert live.set_parameter('threshold', 0.0).successful
    live.until_said('restarted, with codes from the turns')
    live.until_said('save: written to')
    saved = json.loads((tmp_path / 'phase_traj_1' / 'chain_code.json').read_text())
    assert (saved['frames'], saved['code_source'], saved['threshold']) == (5, 'shift', 16.0)
    assert live.set_parameter('threshold', 16.0).successful
    work(live, managed, 200 * SECOND)
    assert stop(managed.process) == 0
    assert 'Traceback' not in live.logs()


def test_what_cannot_be_configured_stays_unconfigured(live, managed):
    managed.start('-p', 'mask_file:=/does/not/exist.png')
    assert not live.change_state(Transition.TRANSITION_CONFIGURE)
    assert managed.state() == State.PRIMARY_STATE_UNCONFIGURED
    live.until_said('/does/not/exist.png')
    assert topics(live) == set()


def test_shutdown_ends_it_whatever_it_does(live, managed):
    managed.start()
    assert live.change_state(Transition.TRANSITION_CONFIGURE)
    assert live.change_state(Transition.TRANSITION_ACTIVATE)
    assert live.change_state(Transition.TRANSITION_ACTIVE_SHUTDOWN)
    assert managed.state() == State.PRIMARY_STATE_FINALIZED
    assert stop(managed.process) == 0


def test_it_lives_on_after_what_once_killed_it(live, managed):
    managed.start()
    live.until_said('unconfigured: ros2 lifecycle set /phase_traj configure')
    assert not live.change_state(Transition.TRANSITION_ACTIVATE)
    for _ in range(2):
        assert live.change_state(Transition.TRANSITION_CONFIGURE)
        assert live.change_state(Transition.TRANSITION_CLEANUP)
        assert managed.state() == State.PRIMARY_STATE_UNCONFIGURED
    assert live.change_state(Transition.TRANSITION_CONFIGURE)
    assert live.change_state(Transition.TRANSITION_INACTIVE_SHUTDOWN)
    assert managed.state() == State.PRIMARY_STATE_FINALIZED
    assert stop(managed.process) == 0
    assert 'Traceback' not in live.logs()


@pytest.mark.parametrize(('given', 'active'), [
    ([], True), (['-p', 'autostart:=true'], True), (['-p', 'autostart:=false'], False)])
def test_the_node_starts_itself_or_waits(live, given, active):
    live.start(*given)
    state = live.call(GetState, '/phase_traj/get_state', GetState.Request()).current_state.id
    assert state == (State.PRIMARY_STATE_ACTIVE if active else State.PRIMARY_STATE_UNCONFIGURED)
