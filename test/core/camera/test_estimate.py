# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What drives have told of a camera: kept, combined and used."""

from dataclasses import replace
import math

from phase_traj_ros.core.camera.estimate import CameraEstimate, combined
import pytest

FOUND = CameraEstimate(
    width=320, height=240, focal_px=160.0, focal_deviation=0.04, straightness=0.5,
    straightness_deviation=0.05, column_px=3.0, column_deviation_px=2.0, pitch_deg=5.0,
    pitch_deviation_deg=0.5, roll_deg=-1.0, roll_deviation_deg=0.8, turns=3)


@pytest.mark.parametrize(('values', 'word'), [
    ({'focal_px': math.nan}, 'focal_px'), ({'focal_px': -1.0}, 'focal_px'),
    ({'focal_deviation': -0.1}, 'focal_deviation'), ({'height': 0}, '320x0'),
    ({'turns': math.inf}, 'turns'), ({'straightness': 3.0}, 'straightness')])
def test_what_is_not_an_estimate_is_refused_by_name(values, word):
    with pytest.raises(ValueError, match=word):
        replace(FOUND, **values)


def test_it_has_the_field_of_view_of_its_lens():
    pinhole = replace(FOUND, straightness=1.0, column_px=0.0)
    assert pinhole.hfov_deg == pytest.approx(90.0)


def test_the_interval_holds_nine_in_ten():
    (low, high) = FOUND.focal_interval_px
    assert (low, high) == (pytest.approx(149.8, abs=0.1), pytest.approx(170.9, abs=0.1))
    assert FOUND.probability == pytest.approx(0.78, abs=0.01)
    assert replace(FOUND, focal_deviation=0.0).probability == 1.0


def test_recordings_that_agree_make_it_surer():
    both = combined([FOUND, replace(FOUND, focal_px=164.0)])
    assert both.focal_px == pytest.approx(162.0, abs=0.1)
    assert both.focal_deviation < FOUND.focal_deviation
    assert both.turns == 6


def test_recordings_that_do_not_agree_do_not():
    both = combined([FOUND, replace(FOUND, focal_px=240.0)])
    assert both.focal_deviation > FOUND.focal_deviation


def test_one_recording_alone_is_what_it_is():
    alone = combined([FOUND])
    assert alone.focal_px == pytest.approx(FOUND.focal_px)
    assert alone.focal_deviation == pytest.approx(FOUND.focal_deviation)
    assert alone.pitch_deg == pytest.approx(FOUND.pitch_deg, abs=0.1)


def test_an_exact_tilt_stays():
    exact = replace(FOUND, pitch_deviation_deg=0.0, roll_deviation_deg=0.0)
    both = combined([exact, FOUND])
    assert (both.pitch_deg, both.roll_deg) == (
        pytest.approx(FOUND.pitch_deg, abs=1e-3), pytest.approx(FOUND.roll_deg, abs=1e-3))


def test_a_reduced_recording_is_of_the_same_camera():
    half = replace(FOUND, width=160, height=120, focal_px=80.0, column_px=1.5)
    assert combined([FOUND, half]).focal_px == pytest.approx(160.0)


def test_pictures_of_another_shape_are_not():
    with pytest.raises(ValueError, match='one camera'):
        combined([FOUND, replace(FOUND, height=180)])


def test_the_field_of_view_is_as_sure_as_the_focal_length():
    sharp, usual = (replace(FOUND, focal_deviation=each).field_of_view for each in (1e-3, 0.04))
    assert sharp.hfov_deg == usual.hfov_deg == FOUND.hfov_deg
    # One more per mille of focal length takes this much of the view.
    less = FOUND.hfov_deg - replace(FOUND, focal_px=160.0 * math.exp(1e-3)).hfov_deg
    assert sharp.deviation_deg == pytest.approx(less, rel=0.01)
    assert usual.deviation_deg == pytest.approx(40 * less, rel=0.02)
    assert (usual.sureness, usual.turns) == (FOUND.probability, 3)
