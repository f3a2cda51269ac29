# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Whatever the stamps and the images are, the node and the replay use the same frames."""

from itertools import pairwise
from types import SimpleNamespace
from unittest.mock import MagicMock

from hypothesis import given, strategies as st
import numpy as np
from phase_traj_ros.core import Movement
from phase_traj_ros.errors import SourceError
from phase_traj_ros.io.messages.image import encoding_of, msg_to_frame
from phase_traj_ros.io.messages.mounting import Mounting
from phase_traj_ros.io.messages.stamps import StampRule, to_nanoseconds
from phase_traj_ros.io.replay.run import replay, Watcher
from phase_traj_ros.io.sources.base import Candidate, FrameSource
from phase_traj_ros.io.sources.selection import EVERYTHING
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.ros.nodes.work import Work
import pytest
from rolled import TEXTURE

RECEIVED_NS = 1_800_000_000 * 10**9
EPOCH_NS = 1_700_000_000 * 10**9
TENTH_NS = 10**8
PAPER = Parameters(threshold=16.0)


# How the stamps go on, and how a single one strays, in nanoseconds.
ON = {'next': TENTH_NS, 'gap': 5 * 10**9, 'stepped back': -3 * TENTH_NS}
STRAY = {
    'repeated': 0, 'late': -TENTH_NS // 2, 'hour ahead': 3600 * 10**9,
    'hour back': -3600 * 10**9}
STAMPS = st.sampled_from(['next'] * 8 + [*ON, *STRAY, 'zero', 'loop'])
IMAGES = st.sampled_from(
    ['forward'] * 6 + ['left', 'right', 'same', 'cut off', 'tiny', 'unknown encoding', 'colour'])


def stamps_of(start_ns, kinds):
    """Return the stamps in nanoseconds that belong to the kinds."""
    stamps, now = [start_ns], start_ns
    for kind in kinds:
        if kind == 'loop':
            now = start_ns
        now += ON.get(kind, 0)
        stamps.append(0 if kind == 'zero' else max(now + STRAY.get(kind, 0), 0))
    return stamps


def messages(start_ns, events):
    """Return images as messages, with the stamps and faults of the events."""
    rng = np.random.default_rng(0)
    place, picture = 0, TEXTURE
    made = []
    kinds = ['forward', *(kind for _, kind in events)]
    for stamp_ns, kind in zip(stamps_of(start_ns, [stamp for stamp, _ in events]), kinds):
        place += {'left': 30, 'right': -30}.get(kind, 0)
        if kind != 'same':
            noisy = np.roll(TEXTURE, place, axis=1) + rng.normal(0, 3, TEXTURE.shape)
            picture = np.clip(noisy, 0, 255).astype(np.uint8)
        shown = picture[:4, :4] if kind == 'tiny' else picture
        if kind == 'colour':
            shown = np.dstack([shown] * 3)
        data = shown.tobytes()
        made.append(SimpleNamespace(
            header=SimpleNamespace(
                stamp=SimpleNamespace(sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9),
                frame_id='camera'),
            height=shown.shape[0], width=shown.shape[1],
            encoding={'unknown encoding': 'x', 'colour': 'rgb8'}.get(kind, 'mono8'),
            is_bigendian=0, step=shown[0].nbytes,
            data=data[:100] if kind == 'cut off' else data))
    return made


class Messages(FrameSource):
    """The messages as a bag gives them."""

    def __init__(self, given):
        super().__init__(description='messages', selection=EVERYTHING, frame_count=None)
        self._given = given

    def _candidates(self):
        rule = StampRule()
        for index, message in enumerate(self._given):
            stamp_ns = rule.stamp_ns(
                to_nanoseconds(message.header.stamp), RECEIVED_NS + index * TENTH_NS)
            yield Candidate(
                index, stamp_ns, lambda message=message: msg_to_frame(message),
                encoding_of(message))


class Stamps(Watcher):
    """Keeps the stamps of the frames used since the last restart."""

    def __init__(self):
        self.used = []

    def start(self, frame, estimator):
        self.used = [frame.stamp_ns]

    def add(self, frame, update, estimator):
        self.used.append(frame.stamp_ns)


def live(given):
    """Return the estimator of a node that has received the messages."""
    node = MagicMock()
    node.resolve_topic_name.side_effect = lambda name, **_: f'/{name}'
    node.count_publishers.return_value = 1
    node.create_publisher.return_value.get_subscription_count.return_value = 0
    clock = node.get_clock.return_value.now.return_value
    clock.nanoseconds = RECEIVED_NS
    work = Work(node, Mounting(PAPER))
    work.start()
    [receive] = [
        call.args[2] for call in node.create_subscription.call_args_list
        if call.args[1] == '/image']
    for index, message in enumerate(given):
        clock.nanoseconds = RECEIVED_NS + index * TENTH_NS
        receive(message, {'publication_sequence_number': index, 'received_timestamp': 0})
    work.stop()
    return work._estimator


@given(st.sampled_from([0, TENTH_NS, EPOCH_NS]), st.lists(st.tuples(STAMPS, IMAGES), max_size=30))
def test_the_same_frames_live_and_offline(start_ns, events):
    given_ = messages(start_ns, events)
    estimator, stamps = live(given_), Stamps()
    try:
        result = replay(Messages(given_).entries(), PAPER, source='messages', watchers=[stamps])
    except SourceError:
        assert estimator.frames < 2
        return
    assert list(result.codes.movement) == list(estimator.codes.movement)
    assert list(result.codes.direction) == list(estimator.codes.direction)
    assert result.counters == estimator.counters
    assert result.frames == estimator.frames
    # Every frame is accounted for, and those used are in order.
    counters = result.counters
    assert counters.frames + counters.dropped + counters.skipped + counters.repeated >= len(given_)
    assert all(later > earlier for earlier, later in pairwise(stamps.used))
    assert len(result.direction) == len(result.movement) - result.movement.count(
        Movement.NO_CHANGE)
    assert len(stamps.used) == len(result.frame_numbers) == len(result.movement) + 1


@pytest.mark.parametrize(('kinds', 'lost', 'restarts'), [
    (['next'] * 20, 0, 0),
    (['next'] * 9 + ['zero'] + ['next'] * 9, 1, 0),
    (['next'] * 9 + ['hour ahead'] + ['next'] * 9, 1, 0),
    (['next'] * 9 + ['stepped back'] + ['next'] * 9, 4, 0),
    (['next'] * 15 + ['loop'] + ['next'] * 9, 0, 1),
    (['next'] * 9 + ['gap'] + ['next'] * 9, 0, 0),
])
def test_what_a_fault_costs_live(kinds, lost, restarts):
    counters = live(messages(EPOCH_NS, [(kind, 'forward') for kind in kinds])).counters
    assert len(kinds) + 1 - counters.frames == lost
    assert (counters.dropped + counters.repeated, counters.time_resets) == (lost, restarts)
