# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A small town, and a drive through it."""

import pytest
from streets import drive, Town


@pytest.fixture(scope='session')
def town():
    return Town(5)


@pytest.fixture(scope='session')
def poses(town):
    return drive(town.walk(14, seed=4))
