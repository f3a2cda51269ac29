# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Paths as users write them."""

from pathlib import Path

from phase_traj_ros.errors import ParameterError
from phase_traj_ros.io.user_path import user_path
import pytest


def test_a_path_may_begin_with_the_home_folder(monkeypatch, tmp_path):
    monkeypatch.setenv('HOME', str(tmp_path))
    assert user_path('~/film.mp4') == tmp_path / 'film.mp4'
    assert user_path('film~/a.mp4') == Path('film~/a.mp4')


def test_a_user_who_does_not_exist_is_said():
    with pytest.raises(ParameterError, match='~nobody-of-that-name/x: there is no such user'):
        user_path('~nobody-of-that-name/x')
