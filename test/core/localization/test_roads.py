# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The road map: pieces, successors, one-way streets."""

import numpy as np
from phase_traj_ros.core import RoadMap
from phase_traj_ros.core.localization.roads import PIECE_M
import pytest

CROSS = [[(-20, 0), (0, 0), (20, 0)], [(0, -20), (0, 0), (0, 20)]]


def following(roads, piece):
    return roads.successors[roads.first[piece]:roads.first[piece + 1]]


def test_pieces_are_short_and_cover_the_road_in_both_directions():
    roads = RoadMap.from_polylines([[(0, 0), (12, 0), (12, 7)]])
    assert roads.length.max() <= PIECE_M
    assert roads.length.sum() / 2 == pytest.approx(19.0)
    assert len(roads) == 2 * (3 + 2)
    np.testing.assert_allclose(roads.starts[roads.reverse], roads.ends)
    np.testing.assert_array_equal(roads.reverse[roads.reverse], np.arange(len(roads)))


def test_a_piece_is_followed_by_those_that_start_where_it_ends():
    roads = RoadMap.from_polylines(CROSS)
    for piece in range(len(roads)):
        for each in following(roads, piece):
            np.testing.assert_allclose(roads.starts[each], roads.ends[piece])


def test_a_junction_leads_everywhere_but_back():
    roads = RoadMap.from_polylines(CROSS)
    [arriving] = np.flatnonzero((np.abs(roads.ends).max(axis=1) == 0) & (roads.direction == 0.0))
    directions = sorted(np.degrees(roads.direction[following(roads, arriving)]).round())
    assert directions == [-90.0, 0.0, 90.0]


def test_the_end_of_a_road_leads_back():
    roads = RoadMap.from_polylines([[(0, 0), (5, 0)]])
    assert following(roads, 0).tolist() == [1]
    assert following(roads, 1).tolist() == [0]


def test_ways_meet_at_shared_nodes_only():
    nodes = [(-20, 0), (20, 0), (0, -20), (0, 20)]
    bridge = RoadMap.from_ways(nodes, [[0, 1], [2, 3]])
    assert np.diff(bridge.first).max() == 1
    junction = RoadMap.from_ways([*nodes, (0, 0)], [[0, 4, 1], [2, 4, 3]])
    assert np.diff(junction.first).max() == 3


@pytest.mark.parametrize(('rule', 'against'), [
    (0, [False, False]), (1, [False, True]), (-1, [True, False])])
def test_one_way_streets_are_marked_in_the_other_direction(rule, against):
    roads = RoadMap.from_polylines([[(0, 0), (5, 0)]], [rule])
    assert roads.against.tolist() == against


def test_tiny_edges_are_joined_but_junctions_stay():
    ring = [(0.1 * number, 0.0) for number in range(51)]
    roads = RoadMap.from_polylines([ring, [(2.5, 0), (2.5, 9)]])
    assert len(roads) < 20
    assert roads.length.sum() / 2 == pytest.approx(14.0)
    assert np.diff(roads.first).max() == 2


def test_a_junction_at_a_node_that_repeats_its_neighbour_stays():
    nodes = [(-20, 0), (0, 0), (0, 0), (5e-4, 0), (20, 0), (0, 30)]
    whole = RoadMap.from_ways(nodes, [[0, 1, 4], [1, 5]])
    for junction in (1, 2, 3):
        roads = RoadMap.from_ways(nodes, [[0, 1, 2, 3, 4], [junction, 5]])
        np.testing.assert_array_equal(roads.first, whole.first)
        np.testing.assert_array_equal(roads.successors, whole.successors)


def test_an_edge_of_micrometres_is_no_road():
    # Each stride would go back and forth on it.
    roads = RoadMap.from_ways([(0, 0), (20, 0), (50, 0), (50, 1e-5)], [[0, 1], [2, 3]])
    assert roads.length.min() == 5.0
    with pytest.raises(ValueError, match='no roads'):
        RoadMap.from_ways([(50, 0), (50, 1e-5)], [[0, 1]])


def test_the_distance_to_the_nearest_road():
    roads = RoadMap.from_polylines([[(0, 0), (100, 0)]])
    assert roads.distance_to(50.0, 3.0) == pytest.approx(3.0)
    assert roads.distance_to(103.0, 4.0) == pytest.approx(5.0)


@pytest.mark.parametrize(('nodes', 'ways', 'one_way', 'message'), [
    ([], [], None, 'no roads'),
    ([(1, 1), (1, 1)], [[0, 1]], None, 'no roads'),
    ([(0, 0)], [[0]], None, 'no roads'),
    ([(0, 0), (1, 1)], [[0, 2]], None, 'not among'),
    ([(0, 0), (np.nan, 1)], [[0, 1]], None, 'finite'),
    ([(0, 0), (1, 1)], [[0, 1]], [0, 1], 'one_way')])
def test_a_map_that_is_none_is_refused(nodes, ways, one_way, message):
    with pytest.raises(ValueError, match=message):
        RoadMap.from_ways(nodes, ways, one_way)
