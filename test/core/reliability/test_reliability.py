# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A result is reliable if its pairs are; otherwise there are reasons."""

from itertools import pairwise
import math

from phase_traj_ros.core import (
    CodeSource,
    EstimatorSettings,
    Lens,
    TrajectoryEstimator,
    Travel,
    TravelState,
)
from phase_traj_ros.core.reliability.monitor import ReliabilityMonitor
from phase_traj_ros.core.reliability.reason import Evidence, Reason
from phase_traj_ros.synthetic import Camera, plan_drive, render_drive, Straight
import pytest


SECOND = 1_000_000_000
TENTH = SECOND // 10
BRIDGED = Travel(1.0, 0.1, TravelState.BRIDGED)
UNKNOWN = Travel(0.0, 1.0, TravelState.UNKNOWN)
RIVALLED = Travel(1.0, 0.1, TravelState.MEASURED, rivalled=True)


class Driven:
    """A monitor, and the stamp of the newest frame."""

    def __init__(self, start=5 * SECOND):
        self.monitor, self.now = ReliabilityMonitor(), start

    def add(self, name, seconds, *, interval=TENTH, **options):
        for _ in range(round(seconds * SECOND / interval)):
            self.now += interval
            self.monitor.add(Evidence(name), self.now, interval, **options)
        return self

    @property
    def spans(self):
        """Return the spans in seconds since the first frame."""
        found = self.monitor.verdict()
        return [
            (*((stamp - found.start_ns) / SECOND for stamp in (span.start_ns, span.end_ns)),
             tuple(reason.value for reason in span.reasons)) for span in found.spans]


def test_without_metres_the_distance_may_be_unknown_but_the_road_must_not_contradict():
    for travel in (UNKNOWN, BRIDGED):
        assert Driven().add('trusted', 20, travel=travel, metric=False).spans == []
    driven = Driven().add('trusted', 20, travel=RIVALLED, metric=False)
    assert driven.monitor.verdict().reasons == (Reason.ROAD_UNCLEAR,)


def test_a_road_that_slows_down_alone_is_unclear():
    fast, slow = (Travel(way, 0.01, TravelState.MEASURED) for way in (1.0, 0.12))
    for metric in (True, False):
        driven = Driven().add('trusted', 10, travel=fast, near=0.1, metric=metric)
        driven.add('trusted', 5, travel=slow, near=0.1, metric=metric)
        (start, end, reasons), = driven.spans
        assert 10.8 < start < 12.4 and end == pytest.approx(15)
        assert reasons == (Reason.ROAD_UNCLEAR.value,)
    # Nothing of this applies to another scene.
    driven = Driven().add('trusted', 10, travel=fast, near=0.1).add(
        'trusted', 0.1, travel=fast, near=0.1, cut=True)
    assert driven.add('trusted', 10, travel=slow, near=0.1).spans == []


def test_a_pair_that_covers_foreseen_frames_counts_as_many():
    """A vehicle that stands at 60 Hz has six times the pairs of one that drives."""
    driven = Driven().add('trusted', 5, frames=6).add('fixed', 1.5, interval=SECOND // 60)
    assert driven.monitor.verdict().reliable
    often = Driven().add('trusted', 5, interval=SECOND // 60).add(
        'fixed', 1.5, interval=SECOND // 60)
    assert often.monitor.verdict().reliable


def test_what_gaps_may_have_hidden_of_a_turn_adds_up():
    def gapped(missed_deg, *, gaps=12):
        driven = Driven()
        for _ in range(gaps):
            driven.add('trusted', 1.9).add('scattered', 0.1, seen=False).add(
                'trusted', 0.1, missed=math.radians(missed_deg))
        return driven
    assert gapped(4.0).monitor.verdict().reliable
    assert gapped(5.0).monitor.verdict().reasons == (Reason.HEADING_UNKNOWN,)
    # The verdict is about the last minute.
    assert gapped(5.0).add('trusted', 100).monitor.verdict().reliable
    assert gapped(2.5, gaps=40).spans == []


def summed_up(**pairs):
    driven = Driven()
    for name, count in pairs.items():
        driven.add(name, count / 10)
    return driven.monitor


@pytest.mark.parametrize(('pairs', 'reasons'), [
    ({'trusted': 100}, ()),
    ({'trusted': 60, 'scattered': 40}, ()),
    ({'trusted': 40, 'scattered': 60}, (Reason.NOT_ONE_MOTION,)),
    ({'trusted': 30, 'blank': 60, 'jerked': 10}, (Reason.NOTHING_TO_SEE,)),
    ({'trusted': 20, 'jerked': 40, 'scattered': 40}, (Reason.NOT_ONE_MOTION, Reason.SHAKING)),
    ({'fixed': 100}, (Reason.VIEW_BLOCKED,)),
    ({'trusted': 60, 'fixed': 40}, (Reason.VIEW_BLOCKED,)),
    ({'trusted': 75, 'fixed': 25}, ()),
    ({'still': 100}, ()),
    ({'still': 95, 'fixed': 5}, ()),
    ({'apart': 100}, (Reason.NOT_COMPARED,)),
    ({'trusted': 40, 'apart': 60}, (Reason.NOT_COMPARED,)),
    ({'trusted': 60, 'apart': 40}, ()),
    ({'apart': 1}, (Reason.TOO_SHORT,)),
    ({'still': 300, 'trusted': 30, 'scattered': 100}, (Reason.NOT_ONE_MOTION,)),
    ({'trusted': 9}, ()),
    ({'trusted': 3, 'scattered': 5}, (Reason.TOO_SHORT,)),
    ({}, (Reason.TOO_SHORT,)),
])
def test_what_most_pairs_are_worth_decides(pairs, reasons):
    verdict = summed_up(**pairs).verdict()
    assert verdict.reasons == reasons
    assert verdict.of_drive.reasons == reasons
    assert verdict.reliable == (not reasons)
    assert verdict.words == tuple(reason.value for reason in reasons)


def test_frames_far_apart_are_the_reason_for_scattered_blocks():
    monitor = Driven().add('scattered', 20, interval=SECOND // 2).monitor
    assert monitor.verdict().reasons == (Reason.NOT_ONE_MOTION, Reason.RATE_TOO_LOW)


def test_a_camera_that_is_needed_and_a_film_in_pieces_are_reasons():
    monitor = summed_up(trusted=100)
    verdict = monitor.verdict(camera_reason=Reason.CAMERA_NOT_KNOWN)
    assert verdict.reasons == (Reason.CAMERA_NOT_KNOWN,)
    monitor = Driven().add('trusted', 8.9).add('trusted', 1.1, cut=True).monitor
    assert monitor.verdict().reasons == (Reason.MANY_CUTS,)
    assert ReliabilityMonitor().verdict().reasons == (Reason.TOO_SHORT,)


def test_a_cover_after_a_good_hour_is_told_at_once_and_is_a_span_of_the_drive():
    driven = Driven().add('trusted', 3600)
    assert driven.monitor.verdict().reliable and driven.spans == []
    driven.add('blank', 40)
    assert driven.monitor.verdict().words == ('nothing_to_see',)
    assert driven.monitor.verdict().of_drive.reliable
    driven.add('blank', 58 * 60 - 40)
    [(start, end, words)] = driven.spans
    assert (start, end) == (pytest.approx(3600, abs=2), 3600 + 58 * 60)
    assert words == ('nothing_to_see',)
    assert driven.monitor.verdict().of_drive.words == ('nothing_to_see',)
    driven.add('trusted', 56)
    assert driven.monitor.verdict().words == ('nothing_to_see',)
    driven.add('trusted', 2)
    assert driven.monitor.verdict().reliable
    assert not driven.monitor.verdict().of_drive.reliable


def test_a_drive_is_unreliable_from_a_twentieth_on():
    driven = Driven().add('trusted', 800).add('jerked', 40).add('trusted', 100)
    assert driven.monitor.verdict().of_drive.reliable
    [span] = driven.monitor.verdict().of_drive.spans
    assert span.reasons == (Reason.SHAKING,)
    driven.add('jerked', 40).add('trusted', 40)
    assert driven.monitor.verdict().of_drive.words == ('shaking',)


def test_the_longest_reason_is_the_first():
    driven = Driven().add('blank', 100).add('trusted', 200).add('scattered', 150)
    assert driven.monitor.verdict().of_drive.words == ('not_one_motion', 'nothing_to_see')
    assert [words for _, _, words in driven.spans] == [('nothing_to_see',), ('not_one_motion',)]


def test_a_camera_that_repeats_a_picture_for_more_than_a_second_is_frozen():
    driven = Driven().add('trusted', 100)
    assert driven.add('repeated', 1).monitor.verdict().reliable and driven.spans == []
    driven.add('repeated', 0.2)
    assert driven.monitor.verdict().words == ('frozen',)
    [(start, end, words)] = driven.spans
    assert (start, end, words) == (pytest.approx(100), pytest.approx(101.2), ('frozen',))
    driven.add('trusted', 10)
    assert driven.monitor.verdict().reliable and len(driven.spans) == 1
    driven.add('repeated', 500)
    assert driven.monitor.verdict().of_drive.words == ('frozen',)


def test_a_film_with_every_picture_twice_is_judged_by_the_others():
    driven = Driven()
    for _ in range(100):
        driven.add('trusted', 0.1).add('repeated', 0.1)
    assert driven.monitor.verdict().reliable and driven.spans == []


def test_a_long_pair_of_frames_that_were_seen_loses_none():
    for gap, lost in ((1, []), (19, [('frames_lost',)])):
        frozen = Driven().add('trusted', 10).add('repeated', 2)
        frozen.now += gap * TENTH
        frozen.monitor.add(
            Evidence.TRUSTED, frozen.now, (20 + gap) * TENTH, frames=21)
        assert [words for *_, words in frozen.spans] == [('frozen',), *lost]
    # Frames that were foreseen, and another encoding.
    for foreseen, lost in ((6, 0), (1, 1)):
        driven = Driven().add('trusted', 30, interval=SECOND // 60)
        driven.add('apart', 0.1, interval=TENTH, frames=foreseen)
        assert len(driven.spans) == lost


@pytest.mark.parametrize(('evidence', 'seconds', 'lost'), [
    ('trusted', 0.9, False), ('trusted', 5, True), ('apart', 0.3, True), ('apart', 0.1, False)])
def test_a_part_without_frames_is_a_span(evidence, seconds, lost):
    driven = Driven().add('trusted', 30)
    driven.add(evidence, seconds, interval=round(seconds * SECOND)).add('trusted', 20)
    expected = [(pytest.approx(30), pytest.approx(30 + seconds), ('frames_lost',))]
    assert driven.spans == (expected if lost else [])
    assert driven.monitor.verdict().reliable == (seconds < 3)


def test_a_low_rate_loses_no_frames():
    driven = Driven().add('trusted', 300, interval=2 * SECOND)
    assert driven.monitor.verdict().reliable and driven.spans == []


def test_a_direction_against_the_heading_is_a_span():
    driven = Driven().add('trusted', 200).add('trusted', 30, contradicted=True)
    assert driven.monitor.verdict().words == ('direction_contradicts_heading',)
    [(start, end, words)] = driven.spans
    assert (start, end) == (pytest.approx(200), pytest.approx(230))
    assert driven.monitor.verdict().of_drive.words == words


def test_a_road_on_which_another_motion_stands_out_is_a_span():
    driven = Driven().add('trusted', 60).add('trusted', 0.1, travel=RIVALLED).add('trusted', 60)
    # One pair may be anything.
    assert driven.monitor.verdict().of_drive.reliable and driven.spans == []
    for _ in range(20):
        driven.add('trusted', 0.6).add('trusted', 0.1, travel=RIVALLED)
    assert driven.monitor.verdict().words == ('road_unclear',)
    assert driven.monitor.verdict().of_drive.words == ('road_unclear',)


@pytest.mark.parametrize('metric', [True, False])
def test_a_speed_that_a_later_one_refutes_is_a_span(metric):
    refuting = Travel(1.0, 0.1, TravelState.MEASURED, refuted=1.5)
    driven = Driven().add('trusted', 1).add('trusted', 0.1, travel=refuting, metric=metric)
    driven.add('trusted', 8.9)
    # It cannot begin before the drive.
    assert driven.spans == [(0.0, pytest.approx(1.0), ('road_unclear',))]
    assert driven.monitor.verdict().words == ('road_unclear',)
    driven.add('trusted', 0.1, travel=refuting)
    assert driven.spans[1] == (pytest.approx(8.5), pytest.approx(10.0), ('road_unclear',))
    # Repeated pictures in between do not count.
    driven.add('repeated', 0.4)
    driven.now += TENTH
    driven.monitor.add(Evidence.TRUSTED, driven.now, SECOND // 2, travel=refuting)
    assert driven.spans[1] == (pytest.approx(8.5), pytest.approx(10.1), ('road_unclear',))


def test_a_distance_that_is_missed_for_more_than_a_second_is_a_span():
    driven = Driven().add('trusted', 20)
    for _ in range(20):
        driven.add('trusted', 0.8, travel=BRIDGED).add('trusted', 0.2)
    assert driven.monitor.verdict().reliable and driven.spans == []
    driven.add('trusted', 10, travel=BRIDGED)
    assert driven.monitor.verdict().words == ('distance_unknown',)
    [(start, end, words)] = driven.spans
    assert (start, end) == (pytest.approx(40), pytest.approx(50))
    assert driven.monitor.verdict().of_drive.words == words
    driven.add('trusted', 100)
    assert driven.monitor.verdict().reliable


def test_an_unknown_distance_is_a_span_however_short():
    driven = Driven().add('trusted', 0.2, travel=UNKNOWN).add('trusted', 2.8)
    assert driven.monitor.verdict().words == ('distance_unknown',)
    assert driven.spans == [(pytest.approx(0), pytest.approx(0.2), ('distance_unknown',))]
    driven.add('trusted', 7)
    assert driven.monitor.verdict().reliable


@pytest.mark.parametrize(('height', 'speed', 'reasons'), [
    (1.65, 24.0, (Reason.DISTANCE_UNKNOWN,)), (0.0, 24.0, ()), (1.65, 15.0, ())])
def test_a_road_that_moves_too_far_between_frames_is_told_where_metres_are_wanted(
    height, speed, reasons,
):
    plan = [Straight(4.0)]
    camera = Camera.with_field_of_view(640, 240, 85)
    estimator = TrajectoryEstimator(EstimatorSettings(
        code_source=CodeSource.AUTO, lens=Lens(hfov_deg=85), camera_height=height))
    drive = plan_drive('', plan, rate_hz=5.0, camera=camera, speed=speed, seed=17)
    for frame, stamp in zip(render_drive(drive), drive.stamps_ns.tolist()):
        estimator.update(frame, stamp)
    assert estimator.reliability.reasons == reasons
    assert estimator.reliability.of_drive.reasons == reasons


def test_a_camera_not_known_is_a_span_over_all():
    driven = Driven().add('trusted', 200).add('blank', 100)
    found = driven.monitor.verdict(camera_reason=Reason.CAMERA_NOT_KNOWN)
    assert [span.reasons for span in found.spans] == [
        (Reason.CAMERA_NOT_KNOWN,), (Reason.NOTHING_TO_SEE,)]
    whole = found.spans[0]
    assert (whole.start_ns, whole.end_ns) == (found.start_ns, found.end_ns)
    assert found.of_drive.reasons == (Reason.CAMERA_NOT_KNOWN, Reason.NOTHING_TO_SEE)


def test_frames_at_a_very_low_rate_are_judged_by_the_newest():
    driven = Driven().add('trusted', 3000, interval=10 * SECOND)
    assert driven.monitor.verdict().reliable
    driven.add('blank', 300, interval=10 * SECOND)
    assert driven.monitor.verdict().words == ('nothing_to_see',)


def test_days_with_a_loose_cable_are_a_bounded_number_of_spans():
    driven = Driven()
    for _ in range(700):
        driven.add('trusted', 50, interval=SECOND).add('trusted', 5, interval=5 * SECOND)
    spans = driven.monitor.verdict().spans
    assert 100 < len(spans) <= 600
    assert spans[-1].end_ns == driven.now
    assert all(before.end_ns <= after.start_ns for before, after in pairwise(spans))


def test_a_camera_that_repeats_one_stamp_for_more_than_a_second_is_frozen():
    driven = Driven().add('trusted', 100)
    driven.monitor.add_unused(Reason.FROZEN, 9)
    assert driven.monitor.verdict().reliable and driven.spans == []
    # Eleven frames of 0.1 s each: nobody knows when they were taken.
    driven.monitor.add_unused(Reason.FROZEN, 2)
    verdict = driven.monitor.verdict()
    assert verdict.words == ('frozen',)
    assert (verdict.end_ns - verdict.start_ns) / SECOND == pytest.approx(101.1)
    assert driven.spans == [(pytest.approx(100), pytest.approx(101.1), ('frozen',))]
    # The next stamp ends it.
    driven.add('trusted', 0.1)
    assert driven.monitor.verdict().reliable


def test_a_first_pair_at_a_low_rate_loses_nothing_and_a_single_rival_is_none():
    driven = Driven().add('trusted', 2, interval=2 * SECOND, travel=RIVALLED).add('trusted', 30)
    verdict = driven.monitor.verdict()
    assert verdict.reliable and verdict.spans == ()
    assert (verdict.end_ns - verdict.start_ns) / SECOND == pytest.approx(32)


def test_another_motion_on_the_road_counts_if_it_was_there_within_a_second():
    apart, close = (
        Driven().add('trusted', 10).add('trusted', 0.1, travel=RIVALLED).add('trusted', seconds)
        .add('trusted', 0.1, travel=RIVALLED).spans for seconds in (1.2, 0.8))
    assert apart == []
    assert close == [(pytest.approx(10.9), pytest.approx(11.0), ('road_unclear',))]


def test_each_part_is_judged_by_half_a_minute_on_both_sides():
    """So the span of a long cover begins and ends where the cover does."""
    driven = Driven().add('trusted', 120).add('blank', 90).add('trusted', 120)
    assert driven.spans == [
        (pytest.approx(120, abs=2), pytest.approx(210, abs=2), ('nothing_to_see',))]
    # Pairs that are in doubt, but measured, count where they are half of a minute.
    assert Driven().add('trusted', 120).add('blank', 15).add('trusted', 120).spans == []


def test_a_motion_that_is_not_measured_for_more_than_a_second_is_a_span():
    driven = Driven().add('trusted', 140)
    for _ in range(10):
        driven.add('scattered', 0.9, seen=False).add('trusted', 0.6)
    assert driven.spans == []
    driven.add('blank', 15, seen=False).add('still', 5)
    assert driven.monitor.verdict().words == ('nothing_to_see',)
    driven.add('trusted', 120)
    assert driven.spans == [(pytest.approx(155), pytest.approx(170), ('nothing_to_see',))]
    assert driven.monitor.verdict().reliable
    # 15 of 295 s are more than a twentieth.
    assert driven.monitor.verdict().of_drive.words == ('nothing_to_see',)
    assert driven.add('trusted', 10).monitor.verdict().of_drive.reliable


def test_spans_of_a_minute_and_of_a_second_are_in_order():
    # More than half of each minute is spoilt, and then all of a few seconds.
    driven = Driven().add('trusted', 100)
    for _ in range(60):
        driven.add('blank', 0.6, seen=False).add('trusted', 0.4)
    driven.add('trusted', 20).add('blank', 3, seen=False).add('trusted', 100)
    spans = driven.spans
    assert all(before[1] < after[0] for before, after in pairwise(spans))
    assert spans[-1][:2] == (pytest.approx(180), pytest.approx(183))
    assert spans[0][0] < 130 < spans[0][1] < 170


@pytest.mark.parametrize('start', [0, 1_700_000_000 * SECOND])
def test_a_third_of_the_first_minute_is_not_most_of_it(start):
    driven = Driven(start).add('blank', 20).add('trusted', 100)
    assert driven.monitor.verdict().reliable and driven.spans == []


def test_after_a_long_gap_the_pairs_before_it_still_tell_why():
    driven = Driven().add('blank', 20, interval=SECOND).add('blank', 300, interval=300 * SECOND)
    assert 'nothing_to_see' in driven.monitor.verdict().words


def test_what_lasts_counts_by_its_share_of_the_last_minute():
    """A twentieth of it, 3 s; what was more than a minute ago does not count."""
    driven = Driven().add('trusted', 200).add('trusted', 2.5, contradicted=True)
    assert driven.monitor.verdict().reliable
    driven.add('trusted', 20).add('trusted', 1, contradicted=True)
    assert driven.monitor.verdict().words == ('direction_contradicts_heading',)
    driven.add('trusted', 38)
    assert driven.monitor.verdict().reliable
    short = Driven().add('trusted', 20).add('trusted', 1.5, contradicted=True)
    assert not short.monitor.verdict().reliable


def test_cuts_count_by_their_share_of_the_pairs():
    driven = Driven().add('trusted', 18).add('trusted', 2, cut=True)
    assert driven.monitor.verdict().reliable
    driven.add('trusted', 0.1, cut=True)
    assert driven.monitor.verdict().words == ('many_cuts',)


def test_only_far_frames_explain_scattered_blocks():
    for interval, low in ((0.2, False), (0.3, True)):
        driven = Driven().add('scattered', 30, interval=round(interval * SECOND))
        assert ('rate_too_low' in driven.monitor.verdict().words) == low


def test_far_frames_explain_a_part_in_which_blocks_are_scattered():
    for interval, words in ((0.2, ('not_one_motion',)), (0.5, ('not_one_motion', 'rate_too_low'))):
        interval = round(interval * SECOND)
        driven = Driven().add('trusted', 20, interval=interval).add(
            'scattered', 5, interval=interval, seen=False)
        assert driven.monitor.verdict().words == words
        assert driven.spans[-1][2] == words
    driven = Driven().add('trusted', 20, interval=interval).add(
        'blank', 5, interval=interval, seen=False)
    assert driven.spans[-1][2] == ('nothing_to_see',)


@pytest.mark.parametrize(('usual', 'far'), [
    ({}, {'interval': 3 * TENTH}), ({}, {'interval': 40 * SECOND}),
    ({'interval': 3 * TENTH, 'frames': 6}, {'interval': 3 * TENTH, 'frames': 6})])
def test_few_far_frames_and_foreseen_ones_explain_no_scattered_blocks(usual, far):
    driven = Driven().add('trusted', 12, **usual)
    driven.add('scattered', far['interval'] / SECOND, seen=False, **far)
    driven.add('scattered', 6, seen=False, **usual)
    words = driven.monitor.verdict().words
    assert 'not_one_motion' in words and 'rate_too_low' not in words


def test_far_frames_are_no_reason_where_too_little_is_scattered_or_shaken():
    half = SECOND // 2
    driven = Driven().add('trusted', 40, interval=half)
    for name in ('scattered', 'jerked'):
        driven.add(name, 2, interval=half, seen=False).add('trusted', 5, interval=half)
    assert driven.monitor.verdict().reliable


def test_each_reason_has_a_word_and_a_sentence():
    for reason in Reason:
        assert reason.value == reason.name.lower()
        assert reason.sentence.endswith('.')
