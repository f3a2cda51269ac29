# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The heartbeat for nav2's lifecycle manager, with stand-ins of the node and of package bond."""

import sys
from types import SimpleNamespace
from unittest.mock import MagicMock

from phase_traj_ros.ros.nodes.bond import keep_bond


def status(**fields):
    return SimpleNamespace(header=SimpleNamespace(), **fields)


def test_a_node_is_alive_until_it_ends_the_bond(monkeypatch):
    monkeypatch.setitem(sys.modules, 'bond.msg', SimpleNamespace(Status=status))
    node = MagicMock()
    node.get_name.return_value = 'phase_traj'
    end = keep_bond(node)
    (period, beat), _ = node.create_timer.call_args
    beat()
    end()
    sent = [call.args[0] for call in node.create_publisher.return_value.publish.mock_calls]
    assert [each.active for each in sent] == [True, True, False]
    assert {each.id for each in sent} == {'phase_traj'}
    assert len({each.instance_id for each in sent}) == 1
    # The manager waits for half of its time-out, which may be as short as a second.
    assert period < 0.5
    node.destroy_timer.assert_called_once_with(node.create_timer.return_value)
    node.destroy_publisher.assert_called_once_with(node.create_publisher.return_value)


def test_without_the_messages_nothing_is_sent(monkeypatch):
    monkeypatch.setitem(sys.modules, 'bond.msg', None)
    node = MagicMock()
    keep_bond(node)()
    assert not node.mock_calls
