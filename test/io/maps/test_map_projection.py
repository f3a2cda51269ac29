# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The plane around the middle of a map."""

import math

import numpy as np
from phase_traj_ros.io.maps.projection import bearing_deg, LocalProjection
import pytest

PLACES = [(49.0, 8.4), (0.0, 0.0), (-33.9, 179.99), (71.2, -179.95), (89.0, 12.0)]


@pytest.mark.parametrize(('latitude', 'longitude'), PLACES)
def test_the_inverse_is_exact(latitude, longitude):
    plane = LocalProjection(latitude, longitude)
    rng = np.random.default_rng(1)
    points = rng.uniform(-60e3, 60e3, (500, 2))

    assert plane.to_metres(*plane.to_degrees(*points.T)) == pytest.approx(points, abs=1e-6)


@pytest.mark.parametrize(('latitude', 'longitude'), PLACES[:3])
def test_a_second_of_arc_has_the_length_of_the_ellipsoid(latitude, longitude):
    plane = LocalProjection(latitude, longitude)
    e2 = 0.00669437999014
    sine2 = math.sin(math.radians(latitude)) ** 2
    meridian = 6378137.0 * (1 - e2) / (1 - e2 * sine2) ** 1.5
    parallel = 6378137.0 / math.sqrt(1 - e2 * sine2) * math.cos(math.radians(latitude))
    second = math.radians(1 / 3600)

    north, east = plane.to_metres(
        [latitude + 1 / 3600, latitude], [longitude, longitude + 1 / 3600])

    assert north == pytest.approx([0.0, meridian * second], abs=1e-3)
    assert east == pytest.approx([parallel * second, 0.0], abs=2e-3)


def test_lengths_hold_within_a_city():
    plane = LocalProjection(49.0, 8.4)
    # 10 km north of the middle, and 100 m further, by the radius of the meridian there.
    latitude = math.degrees(1 / 6367.5) * 10 + 49.0
    ends = plane.to_metres([latitude, latitude + 0.0009], [8.4, 8.4])
    truth = math.radians(0.0009) * 6378137.0 * (1 - 0.00669437999014) / (
        1 - 0.00669437999014 * math.sin(math.radians(latitude)) ** 2) ** 1.5

    assert math.dist(*ends) == pytest.approx(truth, rel=3e-6)


def test_the_middle_of_points_across_the_date_line():
    plane = LocalProjection.around([10.0, 10.2], [179.9, -179.7])

    assert plane.latitude == pytest.approx(10.1)
    assert plane.longitude == pytest.approx(-179.9)
    assert plane.to_degrees(0.0, 0.0) == (pytest.approx(10.1), pytest.approx(-179.9))


def test_the_other_side_of_the_earth_is_nowhere():
    assert np.isnan(LocalProjection(49.0, 8.4).to_metres(-40.0, 172.0)).all()


def test_bearings_are_clockwise_from_north():
    assert [bearing_deg(math.radians(angle)) for angle in (0, 90, 180, -90, 91)] == pytest.approx(
        [90, 0, 270, 180, 359])
