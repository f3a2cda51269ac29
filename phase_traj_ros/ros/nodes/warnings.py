# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Warns of what the data of a drive lack."""

from phase_traj_ros.core import PairStatus, TrajectoryEstimator, TravelState, Update
from phase_traj_ros.core.codes.threshold_hint import Misfit
from rclpy.node import Node

_THROTTLE_S = 5.0
# At the start of a turn, the shift may reach the threshold later.
_LASTING_NS = 5_000_000_000


class Warnings:
    """Logs warnings of the mount and the threshold once, and others at most every 5 s."""

    def __init__(self, node: Node, estimator: TrajectoryEstimator) -> None:
        """Log to ``node`` what ``estimator`` shows."""
        self._node, self._estimator = node, estimator
        self._dropped = 0
        self._doubted: set[str] = set()
        self._hinted = False
        self._misfit: Misfit | None = None
        self._misfit_since_ns = 0

    def threshold_changed(self) -> None:
        """Warn again if the threshold does not fit."""
        self._hinted = False

    def of_mount(self, *doubts: str) -> None:
        """Warn once of each doubt about the mount of the camera."""
        for doubt in doubts:
            if doubt not in self._doubted:
                self._doubted.add(doubt)
                self._node.get_logger().warning(doubt)

    def of_stamps(self) -> None:
        """Warn that images were dropped because of their stamps."""
        before, self._dropped = self._dropped, self._estimator.counters.dropped
        if self._dropped > before:
            self._node.get_logger().warning(
                f'images dropped so far: {self._dropped}, with stamps that are late, or far from'
                ' those of the images around', throttle_duration_sec=_THROTTLE_S)

    def of_threshold(self, update: Update) -> None:
        """Warn once that the threshold does not fit, if the hint lasts for some seconds."""
        hint = None if self._hinted else self._estimator.threshold_hint
        if hint is None or hint.misfit is not self._misfit:
            self._misfit = None if hint is None else hint.misfit
            self._misfit_since_ns = update.stamp_ns
        elif update.stamp_ns - self._misfit_since_ns >= _LASTING_NS:
            self._node.get_logger().warning(hint.sentence)
            self._hinted = True

    def of_speed(self, update: Update, topic: str) -> None:
        """Warn that a pair has no speed from the topic."""
        travel = update.travel
        if update.status is PairStatus.REPEATED or (
                travel is not None and travel.state is TravelState.GIVEN):
            return
        newest_ns = self._estimator.newest_speed_ns
        known = 'none has arrived yet'
        if newest_ns is not None:
            apart_s = (update.stamp_ns - newest_ns) / 1e9
            known = f'the newest is {abs(apart_s):.3f} s {"older" if apart_s > 0 else "newer"}'
        self._node.get_logger().warning(
            f'no speed on {topic} for the stamp of an image ({known}):'
            f' {"it is measured on the road" if travel and travel.known else "it is unknown"}',
            throttle_duration_sec=_THROTTLE_S)
