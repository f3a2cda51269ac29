# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Tests against a peak locked to zero by a fixed pattern: every candidate on the same pairs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from benchmarks.quality.curves import (
    curve,
    draw,
    grouped,
    is_right,
    is_turning,
    percent,
    say,
    STRAIGHT_PX,
    TURNING_PX,
)
from benchmarks.quality.data import overlays, standing, windows
from benchmarks.shared.clips import Clip
from benchmarks.shared.report import paragraphs, table
import numpy as np
from phase_traj_ros.core import PhaseCorrelator, Shift
from phase_traj_ros.core.correlation.block_motion import BlockMotion
from phase_traj_ros.core.correlation.quality import GateSettings
from phase_traj_ros.core.correlation.tuning import TUNING

_TEXT = """
    A pattern that is fixed to the camera has a sharp peak at zero. In a turn, motion spreads the
    scene's own peak, and the fixed peak is higher. When the peak is at zero, the guard
    (`shift.look_past_zero`) looks at the second peak outside its neighbourhood. It takes the
    second peak if that peak is a measurement in its own right, is more significant than the first
    (a fixed pattern's peak is high, but one pixel wide), and explains more than half of the
    textured blocks better than zero shift does. The last condition prevents it from following
    traffic that passes in front of a standing vehicle. The guard has no parameters to tune.
    `shift.release_frames` compensates for the pairs that it misses.

    A mask over the fixed parts is the most direct remedy. Its edge has to be soft: at a hard edge,
    the brightness ends at the same place in every frame, which is a fixed pattern itself. In the
    table, a pair is a turning pair if the picture shifts by {turning:g} px or more.
    """


@dataclass(frozen=True, slots=True)
class Locked:
    """A pair seen through a fixed pattern."""

    overlay: str
    truth: float
    plain: float
    """The shift measured."""
    guarded: float
    """The shift after the guard."""
    masked: float
    """The shift measured with a mask."""
    both: float
    """The shift after the guard, with a mask."""
    at_zero: bool
    second: float
    height_ratio: float
    """Second peak over first."""
    significance: float
    """Significance of the second peak."""
    advantage: float
    """Significance of the second peak divided by that of the first."""
    share: float
    """Share of the blocks that follow the second peak."""

    @property
    def led_astray(self) -> bool:
        """Return whether the guard turns straight driving into a turn."""
        return is_turning(self.guarded) and not is_turning(self.plain)


class Follower:
    """A correlator and blocks, with or without a mask, and the guard."""

    def __init__(self, mask: np.ndarray | None) -> None:
        """Make a follower that waits for its first frame."""
        self.correlator, self.blocks = PhaseCorrelator(mask=mask), BlockMotion(mask=mask)
        self._guard = GateSettings()

    def update(self, frame: np.ndarray) -> tuple[Shift, Shift] | None:
        """Return the shift measured, and the shift after the guard."""
        shift, primed = self.correlator.update(frame), self.blocks.update(frame)
        if shift is None or not primed:
            return None
        return shift, self._guard.judge(shift, self.correlator, self.blocks) or shift


def measure(clips: Sequence[Clip]) -> list[Locked]:
    """Return all pairs on which the guard is tried."""
    pairs = []
    for number, clip in enumerate(clips):
        count = min(len(clip.frames), 120)
        part = windows(clip, 1, count, 3)
        truth = part.camera.focal * np.tan(np.diff(part.yaw))
        for overlay in overlays(clip.shape, number):
            plain, masked = Follower(None), Follower(overlay.mask)
            for index, frame in enumerate(part.frames):
                seen = overlay.over(frame)
                first, second = plain.update(seen), masked.update(seen)
                if first is not None and second is not None:
                    pairs.append(locked(
                        overlay.name, float(truth[index - 1]), first, second, plain))
        say(f'fixed patterns, {clip.name}')
    return pairs


def measure_passing(clips: Sequence[Clip]) -> list[Locked]:
    """Return pairs of a stationary vehicle while others pass."""
    pairs = []
    for stretch in standing(list(clips), pictures=2, count=16):
        if 'passes' not in stretch.condition:
            continue
        follower = Follower(None)
        for frame in stretch.frames:
            seen = follower.update(frame)
            if seen is not None:
                pairs.append(locked(stretch.condition, 0.0, seen, seen, follower))
    return pairs


def locked(
    name: str, truth: float, plain: tuple[Shift, Shift], masked: tuple[Shift, Shift],
    follower: Follower,
) -> Locked:
    """Return a pair seen through a fixed pattern."""
    second = follower.correlator.second_peak(apart=TUNING.peak_distance_px)
    significance = follower.correlator.significance(second)
    return Locked(
        name, truth, plain[0].dx, plain[1].dx, masked[0].dx, masked[1].dx,
        max(abs(plain[0].dx), abs(plain[0].dy)) <= TUNING.zero_px, second.dx,
        second.response / max(plain[0].response, 1e-9),
        significance, significance - follower.correlator.significance(plain[0]),
        follower.blocks.share_following(second))


def section(pairs: Sequence[Locked], passing: Sequence[Locked]) -> str:
    """Draw the curves of the guard; return its section of the document."""
    # A vehicle that fills most of the view is a separate case, covered by the table.
    usual = [pair for pair in passing if '60 %' not in pair.overlay]
    at_zero = [pair for pair in (*pairs, *usual) if pair.at_zero]
    good = [pair for pair in at_zero if is_turning(pair.truth)
            and is_right(pair.second, pair.truth)]
    bad = [pair for pair in at_zero if abs(pair.truth) <= STRAIGHT_PX]
    limit = GateSettings().min_significance

    def of(group: Sequence[Locked], name: str) -> np.ndarray:
        # A second peak too near for a turn does no harm.
        return np.array([
            getattr(pair, name) if is_turning(pair.second) else -np.inf for pair in group])

    curves = {
        label: curve(of(good, name), of(bad, name)) for name, label in (
            ('height_ratio', 'second peak over first'),
            ('significance', 'significance of the second'),
            ('advantage', 'significance of the second over the first'),
            ('share', 'share of the blocks that follow it'))}
    both = [np.where((of(group, 'significance') >= limit) & (of(group, 'advantage') > 0),
                     of(group, 'share'), -np.inf) for group in (good, bad)]
    curves['share, if significant, and more than the first'] = curve(*both)
    draw('zero_lock', curves, (float(np.mean(both[1] > 0.5)), float(np.mean(both[0] <= 0.5))),
         ('true zeros looked past', 'locked pairs missed'))
    rows = []
    for name, group in grouped(pairs, lambda pair: pair.overlay).items():
        turning = [pair for pair in group if is_turning(pair.truth)]
        straight = [pair for pair in group if abs(pair.truth) <= STRAIGHT_PX]
        rows.append((
            name, len(turning),
            percent(np.mean([pair.at_zero for pair in turning])),
            *(percent(np.mean([is_right(getattr(pair, way), pair.truth) for pair in turning]))
              for way in ('plain', 'guarded', 'masked', 'both')),
            len(straight), percent(np.mean([pair.led_astray for pair in straight]))))
    lured = [
        (name, len(group), percent(np.mean([not is_right(pair.plain, 0.0) for pair in group])),
         percent(np.mean([pair.led_astray for pair in group])))
        for name, group in grouped(passing, lambda pair: pair.overlay).items()]
    return '\n\n'.join((
        '## A fixed pattern', '![Curves](../images/quality_zero_lock.png)',
        paragraphs(_TEXT.format(turning=TURNING_PX)), 'Driving:',
        table(('', 'turning pairs', 'locked, %', 'right, %', 'with the guard', 'with a mask',
               'with both', 'straight pairs', 'led astray, %'), rows),
        'A standing vehicle that another vehicle passes:',
        table(('', 'pairs', 'peak elsewhere, %', 'guard follows it, %'), lured)))
