# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The overview, thumbnails, and the figures made of them."""

from pathlib import Path
import xml.etree.ElementTree as ElementTree

import cv2
import numpy as np
from phase_traj_ros.core import Movement, TrajectoryEstimator, View
from phase_traj_ros.core.path.thinning import Thinned
from phase_traj_ros.io.replay.overview import extremes, outline, overview
from phase_traj_ros.io.replay.run import replay
from phase_traj_ros.io.results.figures import write_trajectory_picture
from phase_traj_ros.io.results.pictures import as_shown, draw, Thumbnails
from phase_traj_ros.io.sources.base import StampedFrame
from phase_traj_ros.parameters import Parameters
import pytest
from rolled import RATE_NS, rolled_frames, SHIFTS, START_NS, TEXTURE


@pytest.fixture(scope='module')
def watched():
    """Return a replay, and its thumbnails."""
    thumbnails = Thumbnails()
    result = replay(
        rolled_frames(), Parameters(threshold=16.0), source='rolled', watchers=[thumbnails])
    return result, thumbnails


def svg_texts(path: Path):
    """Return the comments of an SVG, in which matplotlib stores the texts it draws as outlines."""
    parser = ElementTree.XMLParser(target=ElementTree.TreeBuilder(insert_comments=True))
    root = ElementTree.parse(path, parser).getroot()
    return [each.text.strip() for each in root.iter() if each.tag is ElementTree.Comment]


def test_overview(watched):
    shown = overview(watched[0])
    np.testing.assert_allclose(shown.seconds, 0.1 * np.arange(1, len(SHIFTS) + 1))
    np.testing.assert_allclose(shown.dx, SHIFTS, atol=0.1)
    assert shown.path[0].tolist() == [0, 0] and shown.path[-1].tolist() == [7, 4]
    assert len(shown.path) == len(SHIFTS) + 1
    left, right = shown.turns
    assert (left.number, left.side, left.pair, left.end_pair) == (1, Movement.LEFT, 3, 5)
    assert (left.start_s, left.end_s) == (pytest.approx(0.3), pytest.approx(0.6))
    assert (right.number, right.side, right.pair, right.end_pair) == (2, Movement.RIGHT, 9, 10)


def test_the_text_of_the_debug_image_has_an_outline_of_equal_width():
    grey = [np.full((480, 1280), shade, np.uint8) for shade in (128, 129)]
    estimator = TrajectoryEstimator(Parameters(threshold=16.0).settings)
    estimator.update(grey[0], 0)
    update = estimator.update(grey[1], RATE_NS)

    above = draw(StampedFrame(grey[1], RATE_NS), update, estimator)[:100]
    text, rim = (above > 230).all(axis=2), (above < 30).all(axis=2)

    assert text.any()
    text_columns, rim_columns = (np.flatnonzero(each.any(axis=0)) for each in (text, rim))
    assert rim_columns[0] < text_columns[0] and text_columns[-1] < rim_columns[-1]
    assert rim_columns[-1] - text_columns[-1] <= 3


def test_a_turn_under_way_at_the_end_ends_with_the_last_frame():
    result = replay(rolled_frames([0, 0, 30, 30]), Parameters(threshold=16.0), source='')
    [turn] = overview(result).turns
    assert (turn.pair, turn.end_pair, turn.end_s) == (2, 3, pytest.approx(0.4))


def test_a_turn_goes_on_over_a_pair_that_cannot_be_judged():
    frames = rolled_frames([0, 0, 30, 30, 30, 30, 0, 0])
    dark = StampedFrame(np.zeros((96, 160), np.uint8), frames[4].stamp_ns)
    result = replay(
        [*frames[:4], dark, *frames[5:]], Parameters(threshold=16.0), source='')
    assert [code.value for code in (update.status for update in result.updates)][2:6] == [
        'ok', 'no_measurement', 'no_measurement', 'turning']
    [turn] = overview(result).turns
    assert (turn.pair, turn.end_pair) == (2, 5)


def test_health_counts_what_is_missing():
    frames = rolled_frames([0] * 12)
    frames = [*frames[:4], *frames[5:8], frames[7], *frames[10:]]
    frames[-1] = StampedFrame(np.zeros((96, 160), np.uint8), frames[-1].stamp_ns)
    result = replay(frames, Parameters(threshold=16.0), source='')
    shown = overview(result)
    assert (result.frames, shown.seconds[-1]) == (10, pytest.approx(1.2))
    assert (shown.interval_s, shown.intervals.max()) == (pytest.approx(0.1), pytest.approx(0.3))
    assert (shown.missing, result.counters.repeated, result.counters.time_resets) == (3, 1, 0)
    assert shown.low_responses == 1 and shown.median_response > 0.2


@pytest.mark.parametrize('offered', [0, 1, 10, 11, 25, 1000])
def test_thinned_is_bounded_and_evenly_spread(offered):
    thinned = Thinned(10)
    for item in range(offered):
        thinned.offer(item if thinned.wants_next else None)
    kept = thinned.kept
    assert len(kept) <= 10
    if offered:
        assert kept[0] == 0 and len(set(np.diff(kept))) <= 1
        assert offered <= 10 or len(kept) > 4


def test_thumbnails_are_small_pictures_of_their_frames(watched):
    result, thumbnails = watched
    assert [each.frame for each in thumbnails.kept] == list(range(result.frames))
    for each, frame in zip(thumbnails.kept, rolled_frames()):
        picture = cv2.imdecode(np.frombuffer(each.jpeg, np.uint8), cv2.IMREAD_UNCHANGED)
        assert np.abs(picture.astype(int) - frame.image).mean() < 5


def test_thumbnails_are_bounded_in_number_width_and_bytes():
    frames = rolled_frames([0] * 60)
    for bounds in ({'limit': 8}, {'max_bytes': 20_000}):
        thumbnails = Thumbnails(width=100, **bounds)
        replay(frames, Parameters(threshold=16.0), source='', watchers=[thumbnails])
        kept = thumbnails.kept
        assert 4 <= len(kept) <= 9 and sum(len(each.jpeg) for each in kept) <= 20_000
        assert kept[-1].frame > 40
        picture = cv2.imdecode(np.frombuffer(kept[0].jpeg, np.uint8), cv2.IMREAD_UNCHANGED)
        assert picture.shape == (60, 100)


def test_when_time_goes_back_the_thumbnails_restart():
    thumbnails = Thumbnails()
    frames = rolled_frames(start_ns=START_NS + 10**12) + rolled_frames([0, 0, 30])
    replay(frames, Parameters(threshold=16.0), source='', watchers=[thumbnails])
    assert [each.frame for each in thumbnails.kept] == [0, 1, 2, 3]


@pytest.mark.parametrize(('bits', 'rotate'), [(8, False), (10, True), (16, False)])
def test_frames_are_shown_upright_in_eight_bits(bits, rotate):
    image = (np.arange(64, dtype=np.uint32).reshape(8, 8) * (2**bits - 1) // 63).astype(
        np.uint8 if bits == 8 else np.uint16)
    shown = as_shown(image, View(rotate_180=rotate))
    assert shown.dtype == np.uint8 and shown.flags.c_contiguous
    assert sorted(shown[[0, -1], [0, -1]]) == [0, 255]
    assert shown[0, 0] == (255 if rotate else 0)


@pytest.mark.parametrize('suffix', ['png', 'svg'])
def test_the_pictures(watched, tmp_path, suffix):
    result, _ = watched
    trajectory = tmp_path / f'trajectory.{suffix}'
    write_trajectory_picture(result, trajectory)
    if suffix == 'png':
        assert cv2.imread(str(trajectory)).std() > 10
    else:
        texts = svg_texts(trajectory)
        assert {'start', 'end', '+T', '−T', 'backward 3', 'no change 3'} <= {*texts}
        # Numbered on the path and above the shift.
        assert texts.count('1') == texts.count('2') == 2
        again = tmp_path / 'again.svg'
        write_trajectory_picture(result, again)
        assert again.read_bytes() == trajectory.read_bytes()


def test_a_plot_of_many_values_shows_the_extremes_of_each_column():
    values = np.random.default_rng(0).normal(size=50_000)
    values[::7] = np.nan
    shown = extremes(values, 100)
    assert len(shown) == 200
    drawn, every = values[shown].reshape(100, 2), values.reshape(100, 500)
    np.testing.assert_array_equal(drawn.min(axis=1), np.nanmin(every, axis=1))
    np.testing.assert_array_equal(drawn.max(axis=1), np.nanmax(every, axis=1))
    assert extremes(values[:200], 100).tolist() == list(range(200))


def test_the_outline_of_a_path_keeps_its_shape():
    side = np.linspace(0, 30, 1000)
    path = np.array([*((x, 0.0) for x in side), *((30.0, y) for y in side[1:]),
                     *((x, 30.0) for x in side[-2:400:-1])])
    assert outline(path, 1e-3).tolist() == pytest.approx(
        np.array([(0, 0), (30, 0), (30, 30), path[-1]]))


def test_a_long_drive_does_not_make_a_huge_svg(tmp_path):
    # A dot of an SVG takes about 100 bytes, two for each pair.
    frames = [
        StampedFrame(TEXTURE[:32, :32], START_NS + index * RATE_NS) for index in range(2100)]
    result = replay(frames, Parameters(threshold=16.0), source='')
    write_trajectory_picture(result, tmp_path / 'long.svg')
    assert (tmp_path / 'long.svg').stat().st_size < 250_000
