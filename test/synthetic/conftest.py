# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Scenes and drives used by several tests, built once."""

from collections.abc import Callable
from functools import cache

from phase_traj_ros.synthetic import Drive, named_drive, Scene
import pytest


@pytest.fixture(scope='session')
def demo_drive() -> Drive:
    """Return the demo drive."""
    return named_drive('demo')


@pytest.fixture(scope='session')
def scene_of_drive() -> Callable[[str], Scene]:
    """Return the scenes of the named drives."""
    return cache(lambda name: named_drive(name).build_scene())


@pytest.fixture(scope='session')
def demo_scene(scene_of_drive: Callable[[str], Scene]) -> Scene:
    """Return the scene of the demo drive."""
    return scene_of_drive('demo')
