# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What is said where images are lost."""

from pathlib import Path

from phase_traj_ros.ros.health import advice, PROFILE
import pytest

FULL_HD = 1920 * 1080 * 3


def test_images_too_large_for_the_defaults_of_fast_dds():
    text = advice(FULL_HD, 'rmw_fastrtps_cpp', {})
    assert 'image of 6.2 MB' in text
    assert 'set FASTRTPS_DEFAULT_PROFILES_FILE=' in text
    profile = Path(text.partition('_PROFILES_FILE=')[2].split()[0])
    assert profile.name == PROFILE and profile.is_file()


@pytest.mark.parametrize(('size', 'middleware', 'environment'), [
    (1241 * 100, 'rmw_fastrtps_cpp', {}),
    (FULL_HD, 'rmw_cyclonedds_cpp', {}),
    (FULL_HD, 'rmw_fastrtps_cpp', {'FASTRTPS_DEFAULT_PROFILES_FILE': '/a.xml'}),
])
def test_other_losses(size, middleware, environment):
    assert 'faster than they are processed' in advice(size, middleware, environment)
