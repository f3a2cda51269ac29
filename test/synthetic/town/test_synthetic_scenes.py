# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Streets along any route are free, and there is always something to see."""

from hypothesis import given, settings, strategies as st
import numpy as np
from phase_traj_ros.errors import ParameterError
from phase_traj_ros.synthetic import CLEARANCE, DRIVES, named_drive, scene_along, street_grid
from phase_traj_ros.synthetic.textures.materials import Material, materials
from phase_traj_ros.synthetic.town.buildings import Town
from phase_traj_ros.synthetic.town.keep_out import KeepOut
from phase_traj_ros.synthetic.town.streets import evenly, grid_streets, streets_along
import pytest


def distance(scene, point):
    """Return the distance of the nearest panel's footprint from a point on the ground."""
    panels = scene.panels
    (along, offset) = (panels.end - panels.start, np.array(point) - panels.start)
    share = (offset * along).sum(axis=1) / np.maximum((along * along).sum(axis=1), 1e-12)
    gap = offset - np.clip(share, 0.0, 1.0)[:, None] * along
    return float(np.hypot(gap[:, 0], gap[:, 1]).min())


def clearance(scene, points):
    return min(distance(scene, point) for point in points)


def figure_of_eight():
    angle = np.linspace(0, 2 * np.pi, 300)
    return 60 * np.stack([np.sin(angle), np.sin(angle) * np.cos(angle)], axis=1)


def hairpin():
    out = np.stack([np.arange(60.0), np.zeros(60)], axis=1)
    return np.concatenate([out, out[::-1] + np.array([0.0, 5.0])])


def standing():
    rng = np.random.default_rng(0)
    still = np.array([50.0, 0.0]) + 0.02 * rng.standard_normal((40, 2))
    go = np.stack([np.arange(50.0), np.zeros(50)], axis=1)
    return np.concatenate([go, still, go + np.array([50.0, 0.0])])


@pytest.mark.parametrize('route', [figure_of_eight(), hairpin(), standing()])
def test_nothing_stands_near_a_route_that_meets_itself(route):
    scene = scene_along(route, seed=3)
    assert clearance(scene, route) >= CLEARANCE
    assert max(distance(scene, point) for point in route) < 12


@settings(max_examples=5, deadline=None)
@given(st.lists(st.tuples(st.floats(-1.0, 1.0), st.floats(0.0, 1.5)), min_size=1, max_size=12),
       st.integers(0, 5))
def test_nothing_stands_near_any_route(moves, seed):
    (turns, speeds) = np.repeat(np.array(moves), 10, axis=0).T
    heading = np.cumsum(turns) / 10
    route = np.cumsum(np.stack([np.cos(heading), np.sin(heading)]) * speeds, axis=1).T
    assert clearance(scene_along(route, seed=seed), route) >= CLEARANCE


@pytest.mark.parametrize('name', DRIVES)
def test_nothing_stands_near_a_named_drive(name, scene_of_drive):
    assert clearance(scene_of_drive(name), named_drive(name).poses[:, :2]) >= CLEARANCE


def test_houses_stand_7_to_10_metres_from_a_straight_route():
    scene = scene_along(np.stack([np.arange(100.0), np.zeros(100)], axis=1))
    atlas = scene.materials.atlas
    fronts = (scene.panels.top > 5) & (scene.panels.base == 0) & (
        np.ptp([scene.panels.start[:, 1], scene.panels.end[:, 1]], axis=0) < 0.1) & (
        atlas.density[scene.panels.texture] == 56) & (
        np.abs(scene.panels.start[:, 0] - 50) < 40) & (
        np.abs(scene.panels.start[:, 1]) < 14)
    distances = np.abs(scene.panels.start[fronts, 1])
    assert len(distances) > 5
    assert distances.min() >= 7
    assert distances.max() <= 10


def test_a_grid_has_its_streets_and_leaves_them_free():
    scene = street_grid([0.0, 80.0], [0.0, 70.0], seed=1)
    for (x, y) in [(x, y) for x in (0.0, 80.0) for y in range(-40, 110, 5)]:
        assert distance(scene, (x, y)) > 4
    for (x, y) in [(x, y) for y in (0.0, 70.0) for x in range(-40, 120, 5)]:
        assert distance(scene, (x, y)) > 4
    # A block is not empty.
    assert distance(scene, (40.0, 10.0)) < 6


def test_a_grid_goes_on_beyond_its_crossings():
    streets = grid_streets([0.0, 80.0], [10.0])
    assert len(streets) == 3
    assert streets[0].line[:, 1] == pytest.approx(10.0)
    assert streets[0].line[0, 0] < -80
    assert streets[0].line[-1, 0] > 160


def test_scenes_differ_by_their_seed_only():
    route = [(0.0, 0.0), (40.0, 0.0)]
    (first, again, other) = (scene_along(route, seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.panels.start, again.panels.start)
    np.testing.assert_array_equal(first.ground.paint[0], again.ground.paint[0])
    assert len(first.panels.base) != len(other.panels.base) or (
        first.panels.start != other.panels.start).any()


def test_a_route_of_one_point_looks_forward():
    line = evenly([(3.0, 4.0)])
    np.testing.assert_allclose(line, [(3.0, 4.0), (4.0, 4.0)])


@pytest.mark.parametrize('route', [[], [(0.0, float('nan'))]])
def test_invalid_routes_are_refused(route):
    with pytest.raises(ParameterError, match='route'):
        scene_along(route)


def test_a_grid_without_streets_is_refused():
    with pytest.raises(ParameterError, match='grid'):
        street_grid([], [0.0])


def test_the_same_street_is_not_built_twice():
    route = hairpin()
    (rng, other) = (np.random.default_rng(0), np.random.default_rng(0))
    once = [street for street in streets_along(route[:60], rng) if not street.again]
    twice = [street for street in streets_along(route, other) if street.again]
    assert not any(street.again for street in once)
    assert sum(len(street.line) for street in twice) > 30


def test_streets_go_straight_on_where_the_route_turns():
    route = [(0.0, 0.0), (60.0, 0.0), (60.0, 60.0)]
    streets = streets_along(route, np.random.default_rng(0))
    ends = np.concatenate([street.line[[0, -1]] for street in streets])
    assert (np.abs(ends[:, 1]) < 2)[ends[:, 0] > 100].any()
    assert (np.abs(ends[:, 0] - 60) < 2)[ends[:, 1] < -40].any()


def test_a_car_one_side_of_which_is_too_near_to_a_pose_changes_no_other_panel():
    nowhere = KeepOut([np.array([[900.0, 900.0]])], 1.0)
    town = Town(
        rng=np.random.default_rng(0), materials=materials(),
        # Beside a car, between the corners that are checked.
        poses=KeepOut([np.array([[1.0, 0.85]])], 0.35), corridors=nowhere, roadways=nowhere,
        sun=np.array([1.0, 0.0]))
    town.wall(np.array([0.0, 9.0]), np.array([0.5, 9.0]), 2.0, Material.MASONRY)
    [wall] = town.panels
    town.car(np.zeros(2), np.array([1.0, 0.0]))
    assert town.panels[0] == wall
    assert len(town.panels) == 4
