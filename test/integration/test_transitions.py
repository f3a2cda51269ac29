# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Every transition of the managed node in every state, and errors in each of its callbacks."""

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from phase_traj_ros.errors import OutputError
from phase_traj_ros.ros.nodes.node import PhaseTrajNode
from phase_traj_ros.ros.nodes.work import Work
import pytest
import rclpy

TRANSITIONS = {
    'configure': Transition.TRANSITION_CONFIGURE,
    'cleanup': Transition.TRANSITION_CLEANUP,
    'activate': Transition.TRANSITION_ACTIVATE,
    'deactivate': Transition.TRANSITION_DEACTIVATE,
    'unconfigured shutdown': Transition.TRANSITION_UNCONFIGURED_SHUTDOWN,
    'inactive shutdown': Transition.TRANSITION_INACTIVE_SHUTDOWN,
    'active shutdown': Transition.TRANSITION_ACTIVE_SHUTDOWN,
    'destroy': Transition.TRANSITION_DESTROY,
    'of another state machine': 97,
}
# How each state is reached, and where its transitions lead.
STATES = {
    'unconfigured': ([], {'configure': 'inactive', 'unconfigured shutdown': 'finalized'}),
    'inactive': (['configure'], {
        'cleanup': 'unconfigured', 'activate': 'active', 'inactive shutdown': 'finalized'}),
    'active': (['configure', 'activate'], {
        'deactivate': 'inactive', 'active shutdown': 'finalized'}),
    'finalized': (['unconfigured shutdown'], {}),
}
LEGAL = [(state, name) for state, (_, leads_to) in STATES.items() for name in leads_to]


@pytest.fixture
def make(domain):
    """Return a function that makes an unconfigured node in this process."""
    rclpy.init(args=['--ros-args', '-p', 'autostart:=false'])
    nodes = []

    def made():
        nodes.append(PhaseTrajNode())
        return nodes[-1]

    yield made
    for node in nodes:
        node.destroy_node()
    rclpy.shutdown()


def change(node, name):
    """Ask as the service does; return whether it succeeded, and the state afterwards."""
    [service] = [each for each in node.services if each.srv_name.endswith('/change_state')]
    request = ChangeState.Request(transition=Transition(id=TRANSITIONS[name]))
    response = service.callback(request, ChangeState.Response())
    return response.success, state_of(node)


def state_of(node):
    return node._state_machine.current_state[1]


def reach(node, state):
    for name in STATES[state][0]:
        assert change(node, name)[0]
    assert state_of(node) == state


def entities(node):
    """Return the names of what the node has, by kind."""
    return (
        {each.topic_name for each in node.publishers}, {each.srv_name for each in node.services},
        {each.topic_name for each in node.subscriptions}, len(list(node.timers)))


@pytest.mark.parametrize('state', STATES)
def test_what_a_state_does_not_allow_is_refused_and_said(make, capfd, state):
    node = make()
    reach(node, state)
    before = entities(node)
    capfd.readouterr()
    for name in TRANSITIONS.keys() - STATES[state][1].keys():
        assert change(node, name) == (False, state), name
        assert f'still {state}: there is no transition' in capfd.readouterr().err
    assert entities(node) == before


@pytest.mark.parametrize(('state', 'name'), LEGAL)
def test_what_a_state_allows_leads_where_it_should(make, capfd, state, name):
    node = make()
    unconfigured = entities(node)
    reach(node, state)
    capfd.readouterr()
    after = STATES[state][1][name]
    assert change(node, name) == (True, after)
    assert f'{state} -> {after}' in capfd.readouterr().err
    publishers, services, subscriptions, _ = entities(node)
    assert ('/phase_traj/movement' in publishers) == (after in ('inactive', 'active'))
    assert ('~/reset' in services) == (after in ('inactive', 'active'))
    assert ('/image' in subscriptions) == (after == 'active')
    if after in ('unconfigured', 'finalized'):
        assert entities(node) == unconfigured
    if after == 'unconfigured':
        reach(node, 'active')


@pytest.mark.parametrize('kind', [OutputError, RuntimeError])
@pytest.mark.parametrize(('state', 'name', 'method'), [
    ('unconfigured', 'configure', '__init__'), ('inactive', 'activate', 'start'),
    ('active', 'deactivate', 'stop'), ('inactive', 'cleanup', 'close'),
    ('inactive', 'inactive shutdown', 'close')])
def test_an_error_in_a_callback_is_said_and_leaves_nothing(
        make, capfd, monkeypatch, kind, state, name, method):
    node = make()
    unconfigured = entities(node)
    reach(node, state)
    own = getattr(Work, method)

    def failing(*_, **__):
        monkeypatch.setattr(Work, method, own)
        raise kind('the disk is full')

    monkeypatch.setattr(Work, method, failing)
    capfd.readouterr()
    # A refusal keeps the state; any other error ends where the node can be configured again.
    refused = kind is OutputError and name == 'activate'
    assert change(node, name) == (False, 'inactive' if refused else 'unconfigured')
    assert 'the disk is full' in capfd.readouterr().err
    if refused:
        assert change(node, 'cleanup')[0]
    assert entities(node) == unconfigured
    reach(node, 'active')
