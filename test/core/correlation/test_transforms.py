# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The choice of the library of the transforms, and that the results do not depend on it."""

import sys

import cv2
import numpy as np
from phase_traj_ros.core import PhaseCorrelator, TrajectoryEstimator
from phase_traj_ros.core.correlation import transforms
from phase_traj_ros.core.correlation.transforms import (
    find_transform,
    OpenCvTransform,
    ScipyTransform,
    transform_hint,
)
from phase_traj_ros.errors import MissingDependencyError
from phase_traj_ros.synthetic import render
import pytest
from smaller import half_demo

try:
    ScipyTransform()
    HAS_SCIPY = True
except MissingDependencyError:
    HAS_SCIPY = False

SHAPES = [(8, 8), (64, 80), (72, 16), (136, 250), (384, 1296)]
needs_scipy = pytest.mark.skipif(not HAS_SCIPY, reason='scipy is not installed')


@pytest.fixture(autouse=True)
def nothing_remembered():
    find_transform.cache_clear()
    yield
    find_transform.cache_clear()


@pytest.fixture
def no_scipy(monkeypatch):
    for name in ('scipy', 'scipy.fft', 'scipy.fftpack'):
        monkeypatch.setitem(sys.modules, name, None)


def built_with(monkeypatch, intels):
    monkeypatch.setattr(transforms, 'opencv_has_intels', lambda: intels)


@needs_scipy
@pytest.mark.parametrize('shape', SHAPES)
def test_all_libraries_pack_spectra_the_same_way(shape):
    rows = shape[0] * 3 // 4
    picture = np.zeros(shape, np.float32)
    picture[:rows] = np.random.default_rng(0).normal(size=(rows, shape[1]))
    packed = picture.copy()
    ScipyTransform().forward(packed, rows)
    expected = cv2.dft(picture)
    np.testing.assert_allclose(packed, expected, atol=2e-6 * np.abs(expected).max())


@pytest.mark.parametrize('shape', SHAPES)
@pytest.mark.parametrize('library', [
    OpenCvTransform, pytest.param(ScipyTransform, marks=needs_scipy)])
def test_the_inverse_restores_the_input(library, shape):
    picture = np.random.default_rng(1).normal(size=shape).astype(np.float32)
    work = picture.copy()
    library().forward(work, len(work))
    factor = library().inverse(work)
    np.testing.assert_allclose(work / factor, picture, atol=1e-5)


def test_intels_transforms_are_preferred(monkeypatch):
    built_with(monkeypatch, True)
    assert isinstance(find_transform(), OpenCvTransform)
    assert 'Intel' in find_transform().name
    assert transform_hint() == ''


@needs_scipy
def test_scipy_replaces_intels(monkeypatch):
    built_with(monkeypatch, False)
    assert find_transform().name.startswith('scipy ')
    assert transform_hint() == ''


def test_without_either_opencvs_own_are_used(monkeypatch, no_scipy):
    built_with(monkeypatch, False)
    assert isinstance(find_transform(), OpenCvTransform)
    assert find_transform().name == f'OpenCV {cv2.__version__} (its own)'
    assert 'python3-scipy' in transform_hint()


def test_missing_scipy_is_an_error(no_scipy):
    with pytest.raises(MissingDependencyError, match='python3-scipy'):
        ScipyTransform()


def test_the_choice_does_not_change_when_intels_are_switched_off():
    chosen = type(find_transform())
    used = cv2.ipp.useIPP()
    cv2.ipp.setUseIPP(False)
    try:
        find_transform.cache_clear()
        assert type(find_transform()) is chosen
    finally:
        cv2.ipp.setUseIPP(used)


@needs_scipy
@pytest.mark.parametrize('shape', [(240, 320), (135, 241), (376, 1241)])
def test_both_libraries_measure_the_same_shifts(shape, monkeypatch):
    rng = np.random.default_rng(2)
    scene = cv2.GaussianBlur(rng.integers(0, 256, (shape[0], 2 * shape[1])).astype(np.float32),
                             (0, 0), 2.0)
    correlators = []
    for intels in (True, False):
        built_with(monkeypatch, intels)
        find_transform.cache_clear()
        correlators.append(PhaseCorrelator())
    for start in (0, 3, 20, 21, 60, 30):
        frame = scene[:, start:start + shape[1]] + rng.normal(size=shape).astype(np.float32)
        one, other = (each.update(frame) for each in correlators)
        if one is None:
            assert other is None
            continue
        assert other.dx == pytest.approx(one.dx, abs=0.002)
        assert other.dy == pytest.approx(one.dy, abs=0.002)
        assert other.response == pytest.approx(one.response, abs=0.001)
        ones, others = (each.second_peak(apart=8) for each in correlators)
        assert others.response == pytest.approx(ones.response, abs=0.001)
        signs = [each.significance(one) for each in correlators]
        assert signs[1] == pytest.approx(signs[0], rel=1e-3)
        maps = [each.correlation_map() for each in correlators]
        np.testing.assert_allclose(maps[1], maps[0], atol=1e-5)


@needs_scipy
def test_both_libraries_give_the_same_codes_of_a_drive(monkeypatch):
    drive = half_demo(60)
    scene = drive.build_scene()
    frames = [render(scene, drive.camera, drive.pose(index)) for index in range(len(drive))]
    streams = []
    for intels, name in ((True, 'OpenCV'), (False, 'scipy')):
        built_with(monkeypatch, intels)
        find_transform.cache_clear()
        assert find_transform().name.startswith(name)
        estimator = TrajectoryEstimator()
        streams.append([
            update and (update.step.movement, update.status)
            for update in (estimator.update(frame, 10**8 * index)
                           for index, frame in enumerate(frames, 1))])
    assert streams[0] == streams[1]
    assert len({each[0] for each in streams[0][1:]}) >= 3
