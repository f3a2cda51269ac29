# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
from phase_traj_ros.core import TravelState


def test_the_names_of_the_states_are_an_interface():
    assert [state.value for state in TravelState] == [
        'measured', 'bridged', 'standing', 'given', 'unknown']
