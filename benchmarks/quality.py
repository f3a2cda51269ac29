# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
How the tests of quality were chosen: what tells a measurement, standing still, a fixed pattern.

Every candidate is tried on the same pairs of frames. Takes a quarter of an hour; writes
docs/quality.md and the curves in docs/images.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
import sys
import time

from clips import Clip
from conditions import CONDITIONS
import cv2
from matplotlib.figure import Figure
import numpy as np
from phase_traj_ros.core import PhaseCorrelator, Shift
from phase_traj_ros.core.block_motion import BlockFlow, BlockMotion
from phase_traj_ros.core.quality import (
    GateSettings,
    MeasurementGate,
    StillnessDetector,
    StillnessSettings,
)
from quality_data import (
    blind,
    creeping,
    cropped,
    driving,
    named,
    overlays,
    standing,
    Stretch,
    windows,
)
from report import paragraphs, ROOT, table, versions

_IMAGES = ROOT / 'docs' / 'images'
_DOCUMENT = ROOT / 'docs' / 'quality.md'
_APART = 8
_STRIDES = (1, 2, 3)
_GAPS = (10, 20, 40)
#: A shift is right if it is off by no more than so many pixels, or by so much of the truth.
_RIGHT_PX, _RIGHT_SHARE = 6.0, 0.15
_TURNING_PX, _STRAIGHT_PX = 10.0, 3.0
_FLOOR = 1e-4

_INTRODUCTION = """
    The paper judges every pair of frames by its shift. A covered lens, a scene cut and a vehicle
    at a red light then drive straight on. These tests, off in `config/paper.yaml` and on in
    `config/vehicle.yaml`, tell such pairs apart. They were chosen by trying each candidate on the
    same pairs: the clips of the KITTI odometry benchmark where they are at hand, and rendered
    drives (`phase_traj_ros.synthetic`), some of them along the true poses of KITTI drives. In the
    curves below, down and left is better; the circle is where the test chosen stands.

    Written by `benchmarks/quality.py` with {versions}.
    """

_GATE_TEXT = """
    The peak's height cannot tell (in the words of the first table, at {accepted:g} % of unrelated
    pairs accepted it loses {response:.0f} % of the good ones): forward motion spreads the peak
    over several pixels, noise lowers it, and the less there is in common the higher is the
    highest of a million noise values. Peak against second peak does better, and loses
    {ratio:.0f} %. What was chosen is the **significance** of the peak: the sum of the
    correlation map over a small square about it, over the standard deviation that such a sum has
    when the frames have nothing in common. That deviation is known, not estimated: the map of
    unrelated frames is noise whose energy is that of the whitened spectrum (Parseval). The sum
    keeps what motion spreads, and noise of either sign cancels in it. It loses {chosen:.1f} %.

    A pair counts as measured from {limit:g} standard deviations on. The square's side is the
    root of the frame's area over 85 (9 pixels for 376×1241), so that it grows with the
    resolution as the spread does; half and twice the size do about as well.
    """

_STILL_TEXT = """
    How high the peak is tells noise from no noise, not standing from creeping. The shift itself
    is zero for both. What differs is that every part of the picture moves, if only by tenths of
    a pixel, when the vehicle does. So both frames are reduced to some thousands of pixels, which
    averages noise away, and cut into 4×8 blocks, of each of which one step of least squares
    gives the displacement (Lucas, Kanade 1981; gain and offset of each block are unknowns, too,
    so that flicker does not matter). The displacements are averaged over several pairs, in which
    noise and shaking cancel and motion adds up; what the whole picture does is taken for shaking
    if it is small. The vehicle stands if half of the blocks with texture have moved by less than
    {limit} of the width, and is taken to have driven off when two thirds move, as a bus that
    passes hides many of them.
    """

_LOCK_TEXT = """
    A pattern that stays where it is in the picture has a sharp peak at zero, and the scene,
    whose own peak is spread by motion, loses against it in a turn. When the peak is at zero, the
    guard looks at the second one outside of its neighbourhood, and takes that if it is a
    measurement in its own right, is more significant than the first (a fixed pattern's peak is
    high, but a single pixel wide), and explains more than half of the blocks with texture better
    than no shift does. The last keeps it from following what passes in front of a vehicle that
    stands. There is nothing to tune in it: more, and more than half. What a pair loses when it is
    missed, `release_frames` makes good.

    A mask over what never moves is better than any guard. Its soft edge matters: with a hard one
    the picture's brightness ends at the same places in every frame, which is a fixed pattern
    itself. In the table a pair turns if the picture does by {turning:g} px or more.
    """


@dataclass(frozen=True, slots=True)
class Pair:
    """What all candidates see of a pair of frames, and what is true of it."""

    source: str
    condition: str
    gap: int
    """Frames from the first to the second; 0 for frames that have nothing in common."""
    right: bool
    """Whether the shift is the true one."""
    response: float
    ratio: float
    """Peak over second peak."""
    significance: float


_CORRELATORS: dict[tuple[int, ...], PhaseCorrelator] = {}


def observed(
    source: str, condition: str, frames: tuple[np.ndarray, np.ndarray], gap: int, truth: float,
) -> Pair:
    """Return a pair whose true shift is ``truth`` pixels, NaN where there is none."""
    correlator = _CORRELATORS.setdefault(frames[0].shape, PhaseCorrelator())
    correlator.reset()
    correlator.update(frames[0])
    shift = correlator.update(frames[1])
    assert shift is not None
    second = correlator.second_peak(apart=_APART)
    return Pair(
        source, condition, gap, is_right(shift.dx, truth), shift.response,
        shift.response / max(second.response, 1e-9), correlator.significance(shift))


def is_right(dx: float, truth: float) -> bool:
    """Return whether a shift is the true one, but for what nearness and parallax do."""
    return bool(abs(dx - truth) <= max(_RIGHT_PX, _RIGHT_SHARE * abs(truth)))


def is_turning(dx: float) -> bool:
    """Return whether the picture moves enough for a turn."""
    return abs(dx) >= _TURNING_PX


def true_shift(clip: Clip, first: int, second: int) -> float:
    """Return the shift that turning alone would give, in pixels; NaN beyond the frame."""
    yaw = clip.yaw[second] - clip.yaw[first]
    shift = clip.camera.focal * np.tan(np.clip(yaw, -1.5, 1.5))
    return float(shift) if abs(shift) < clip.camera.width / 2 else float('nan')


def related_pairs(clip: Clip, condition: str, length: int) -> Iterable[Pair]:
    """Yield the pairs within each window of a clip made by ``windows``."""
    for begin in range(0, len(clip.frames), length):
        for gap in _STRIDES:
            for first in range(begin, begin + length - gap):
                second = first + gap
                yield observed(
                    clip.name, condition, (clip.frames[first], clip.frames[second]), gap,
                    true_shift(clip, first, second))


def unrelated_pairs(
    clips: Sequence[Clip], condition: str, count: int, seed: int,
) -> Iterable[Pair]:
    """Yield pairs of frames of different clips, cut to the same size."""
    rng = np.random.default_rng(seed)
    for number in range(count):
        first, second = (clips[each] for each in rng.choice(len(clips), 2, replace=False))
        # A mirrored clip shows the same streets, the other way round: that is another picture.
        frames = (
            first.frames[rng.integers(len(first.frames))],
            cropped(second.frames[rng.integers(len(second.frames))], first.shape))
        yield observed(f'{number}', condition, frames, 0, float('nan'))


def distant_pairs(clip: Clip, count: int, seed: int) -> Iterable[Pair]:
    """Yield pairs of frames of the same clip that are far apart in time."""
    rng = np.random.default_rng(seed)
    for gap in _GAPS:
        for _ in range(count if gap < len(clip.frames) else 0):
            first = int(rng.integers(len(clip.frames) - gap))
            yield observed(
                clip.name, f'{gap} frames apart',
                (clip.frames[first], clip.frames[first + gap]), gap,
                true_shift(clip, first, first + gap))


def blind_pairs(clip: Clip, count: int) -> Iterable[Pair]:
    """Yield pairs on which there is little or nothing to see."""
    for number in range(count):
        at = 7 * number % (len(clip.frames) - 1)
        for name, first, second, related in blind(clip, 7 * number):
            truth = true_shift(clip, at, at + 1) if related else float('nan')
            yield observed(clip.name, name, (first, second), int(related), truth)


def measure_gate(clips: Sequence[Clip]) -> list[Pair]:
    """Return all pairs that the test of a measurement is tried on."""
    pairs: list[Pair] = []
    length = max(_STRIDES) + 1
    for number, condition in enumerate(CONDITIONS):
        if 'lost' in condition.name:
            continue
        spoiled = [
            condition.spoil(windows(clip, 10, length, seed), seed)
            for seed, clip in enumerate(clips)]
        for clip in spoiled:
            pairs += related_pairs(clip, condition.name, length)
        pairs += unrelated_pairs(spoiled, condition.name, 150, number)
        say(f'pairs, {condition.name}')
    for seed, clip in enumerate(clips):
        pairs += distant_pairs(clip, 40, seed)
        pairs += blind_pairs(clip, 15)
    return pairs


def rates(values: np.ndarray, limits: np.ndarray) -> np.ndarray:
    """Return which share of the values is at or above each limit."""
    return 1.0 - np.searchsorted(np.sort(values), limits, side='left') / len(values)


def lost_at(good: np.ndarray, bad: np.ndarray, accepted: float) -> float:
    """Return the share of good pairs lost where a share of the bad ones is accepted."""
    limit = np.quantile(bad, 1.0 - accepted)
    return float(np.mean(good <= limit))


def curve(good: np.ndarray, bad: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return for every limit the shares of bad values accepted and of good ones lost."""
    limits = np.unique(np.concatenate([good, bad]))
    return rates(bad, limits), 1.0 - rates(good, limits)


def draw(
    name: str, curves: Mapping[str, tuple[np.ndarray, np.ndarray]],
    chosen: tuple[float, float], labels: tuple[str, str],
) -> None:
    """Write a picture of curves, both axes logarithmic, and the point chosen."""
    figure = Figure(figsize=(6.4, 4.4), layout='constrained')
    plot = figure.add_subplot()
    for label, (false, lost) in curves.items():
        plot.plot(np.maximum(false, _FLOOR), np.maximum(lost, _FLOOR), label=label)
    plot.plot(*(max(each, _FLOOR) for each in chosen), 'ko', markersize=9, fillstyle='none',
              markeredgewidth=2, label='chosen')
    plot.set(xscale='log', yscale='log', xlabel=labels[0], ylabel=labels[1],
             xlim=(_FLOOR * 0.9, 1), ylim=(_FLOOR * 0.9, 1))
    plot.grid(alpha=0.3)
    plot.legend(fontsize='small')
    figure.savefig(_IMAGES / f'quality_{name}.png', dpi=110)


def percent(share: float) -> str:
    """Return a share in per cent, as finely as it matters."""
    return f'{100 * share:.1f}' if share < 0.1 else f'{100 * share:.0f}'


def values(pairs: Iterable[Pair], name: str) -> np.ndarray:
    """Return what one candidate says of pairs."""
    return np.array([getattr(pair, name) for pair in pairs])


def gate_section(pairs: Sequence[Pair]) -> str:
    """Draw the curves of the first test; return its part of the document."""
    limit = GateSettings().min_significance
    driven = [pair for pair in pairs if pair.gap in _STRIDES and not is_blind(pair)]
    good = [pair for pair in driven if pair.right]
    unrelated = [pair for pair in pairs if not pair.gap and not is_blind(pair)]
    names = {'response': 'response (height of the peak)', 'ratio': 'peak over second peak',
             'significance': 'significance of the peak'}
    draw('measurement', {
        label: curve(values(good, name), values(unrelated, name))
        for name, label in names.items()
    }, (float(np.mean(values(unrelated, 'significance') >= limit)),
        float(np.mean(values(good, 'significance') < limit))),
        ('unrelated pairs accepted', 'good pairs lost'))
    first = table(
        ('good pairs lost, %', *(f'{percent(share)} % of the unrelated accepted'
                                 for share in (0.02, 0.01, 0.003))),
        [(label, *(percent(lost_at(values(good, name), values(unrelated, name), share))
                   for share in (0.02, 0.01, 0.003))) for name, label in names.items()])
    loss = {name: 100 * lost_at(values(good, name), values(unrelated, name), 0.01)
            for name in names}
    text = paragraphs(_GATE_TEXT.format(
        accepted=1, response=loss['response'], ratio=loss['ratio'],
        chosen=loss['significance'], limit=limit))
    return '\n\n'.join((
        '## No measurement', '![Curves](images/quality_measurement.png)', text, first,
        f'At {limit:g}, by condition (strides 1 to 3) and by what was driven:',
        gate_table(driven, unrelated, limit, key=lambda pair: pair.condition),
        gate_table(driven, [], limit, key=lambda pair: f'{pair.source}, every '
                   f'{("", "2nd ", "3rd ")[pair.gap - 1]}frame'),
        'Pairs with little or nothing in common:',
        blind_table([pair for pair in pairs if is_blind(pair) or pair.gap in _GAPS], limit)))


def is_blind(pair: Pair) -> bool:
    """Return whether it is a pair on which there is little to see."""
    return pair.condition.startswith(('covered', 'lens', 'glare')) or 'px, noise' in (
        pair.condition)


def grouped(items: Iterable[object], key: object) -> dict[str, list[object]]:
    """Return items by a key, in the order in which the keys came."""
    groups = defaultdict(list)
    for item in items:
        groups[key(item)].append(item)  # type: ignore[operator]
    return groups


def gate_table(driven: object, unrelated: object, limit: float, *, key: object) -> str:
    """Return which good pairs are lost and which unrelated ones are accepted, by a key."""
    others = grouped(unrelated, key)  # type: ignore[arg-type]
    rows = []
    for name, group in grouped(driven, key).items():  # type: ignore[arg-type]
        good = values([pair for pair in group if pair.right], 'significance')
        row = [name, len(group), percent(len(good) / len(group)), percent(np.mean(good < limit)),
               f'{np.quantile(good, 0.01):.0f} / {np.median(good):.0f}']
        if others:
            other = values(others[name], 'significance')
            row += [percent(np.mean(other >= limit)), f'{other.max():.1f}']
        rows.append(row)
    header = ['', 'pairs', 'right, %', 'right ones lost, %', 'significance: 1 % / median']
    return table(header + (['unrelated accepted, %', 'highest'] if others else []), rows)


def blind_table(pairs: Sequence[Pair], limit: float) -> str:
    """Return what becomes of pairs that have little or nothing in common."""
    rows = []
    for name, group in grouped(pairs, lambda pair: pair.condition).items():
        accepted = [pair for pair in group if pair.significance >= limit]
        right = percent(np.mean([pair.right for pair in accepted])) if accepted else ''
        rows.append((
            name, len(group), percent(len(accepted) / len(group)),
            right if any(pair.gap for pair in group) else 'there is none'))
    return table(('', 'pairs', 'accepted, %', 'of these right, %'), rows)


@dataclass(frozen=True, slots=True, eq=False)
class Watched:
    """A stretch of frames as the candidates for stillness see it."""

    name: str
    condition: str
    width: int
    moving: np.ndarray
    shifts: list[Shift]
    flows: list[BlockFlow]

    def settled(self, frames: int, state: float) -> np.ndarray:
        """Return at which pairs the last ``frames`` ones were all in this state."""
        same = np.convolve(self.moving == state, np.ones(frames), 'full')[:len(self.moving)]
        return same >= frames


def watch(stretch: Stretch) -> Watched:
    """Return what a correlator and blocks make of a stretch."""
    correlator, blocks = PhaseCorrelator(), BlockMotion()
    shifts, flows = [], []
    for frame in stretch.frames:
        shift, primed = correlator.update(frame), blocks.update(frame)
        if shift is not None and primed:
            shifts.append(shift)
            flows.append(blocks.flow())
    width = stretch.frames[0].shape[1]
    return Watched(stretch.name, stretch.condition, width, stretch.moving, shifts, flows)


def measure_stillness(clips: Sequence[Clip]) -> list[Watched]:
    """Return all stretches that the test of stillness is tried on."""
    watched = []
    for stretch in standing(list(clips), pictures=2, count=16):
        watched.append(watch(stretch))
    say('standing')
    for stretch in creeping():
        watched.append(watch(stretch))
    say('creeping')
    for clip in clips:
        for condition in named('as they are', 'noise, σ = 20'):
            part = windows(clip, 1, min(len(clip.frames), 40), 1)
            spoiled = condition.spoil(part, 1)
            moving = np.ones(len(spoiled.frames) - 1)
            watched.append(watch(Stretch('driving', condition.name, spoiled.frames, moving)))
    say('driving')
    return watched


def still(seen: Watched, settings: StillnessSettings) -> np.ndarray:
    """Return what the detector says of every pair."""
    detector = StillnessDetector(settings)
    return np.array([detector.update(flow, seen.width) for flow in seen.flows])


def by_response(seen: Watched, frames: int) -> np.ndarray:
    """Return how high the peaks were of late where the shift was zero, else 0."""
    heights = [shift.response * (max(abs(shift.dx), abs(shift.dy)) < 1) for shift in seen.shifts]
    return np.array([
        np.median(heights[max(end - frames, 0):end]) for end in range(1, len(heights) + 1)])


def said(
    watched: Sequence[Watched], verdicts: Sequence[np.ndarray], state: float, frames: int,
) -> np.ndarray:
    """Return the verdicts where the state was settled."""
    return np.concatenate([
        verdict[seen.settled(frames, state)] for seen, verdict in zip(watched, verdicts)])


def stillness_section(watched: Sequence[Watched]) -> str:
    """Draw the curves of the second test; return its part of the document."""
    chosen = StillnessSettings()
    # A vehicle that fills most of the view is another question, which the table answers.
    usual = [seen for seen in watched if '60 %' not in seen.condition]
    settle = 10
    curves = {}
    for label, frames in (('response', 1), ('response, median of 5', 5)):
        verdicts = [by_response(seen, frames) for seen in usual]
        curves[label] = curve(
            said(usual, verdicts, 0.0, settle), said(usual, verdicts, 1.0, settle))
    limits = chosen.max_motion * np.geomspace(0.02, 60, 40)
    for frames in (1, 3, 5, 10):
        points = []
        for limit in limits:
            settings = StillnessSettings(frames=frames, max_motion=float(limit))
            verdicts = [still(seen, settings) for seen in usual]
            points.append((
                said(usual, verdicts, 1.0, settle).mean(),
                1.0 - said(usual, verdicts, 0.0, settle).mean()))
        false, missed = np.array(points).T
        curves[f'motion of blocks, mean of {frames}' if frames > 1
               else 'motion of blocks, one pair'] = (false, missed)
    verdicts = [still(seen, chosen) for seen in usual]
    draw('stillness', curves, (
        float(said(usual, verdicts, 1.0, settle).mean()),
        1.0 - float(said(usual, verdicts, 0.0, settle).mean())),
        ('moving pairs taken for still', 'standing pairs missed'))
    return '\n\n'.join((
        '## Standing still', '![Curves](images/quality_stillness.png)',
        paragraphs(_STILL_TEXT.format(limit=f'{1e4 * chosen.max_motion:g}/10000')),
        f'With {chosen.frames} pairs, a limit of {1e4 * chosen.max_motion:g}/10000 of the width,'
        ' where the state has lasted for a while:', stillness_table(watched, chosen, settle),
        paragraphs(f"""
            It takes {chosen.frames} pairs to notice that a vehicle has stopped; these are
            forward. A camera of 30 Hz sees a third of the motion between two frames: there
            `still_frames` should be half a second's worth of them, and what creeps at less than
            half a meter per second counts as standing. Frozen video stands, too.
            """)))


def stillness_table(
    watched: Sequence[Watched], settings: StillnessSettings, settle: int,
) -> str:
    """Return how often standing and moving vehicles are taken to stand."""
    rows = []
    for name, group in grouped(
            watched, lambda seen: f'{seen.name}, {seen.condition}' if seen.moving.any()
            else f'held picture, {seen.condition}').items():
        verdicts = [still(seen, settings) for seen in group]
        cells = []
        for state in (0.0, 1.0):
            shares = said(group, verdicts, state, settle)
            cells += [len(shares), percent(shares.mean()) if len(shares) else '']
        heights = np.median([shift.response for seen in group for shift in seen.shifts])
        rows.append((name, *cells, f'{heights:.2f}'))
    return table(
        ('', 'standing pairs', 'found still, %', 'moving pairs', 'taken for still, %',
         'median response'), rows)


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
    """Of the second peak."""
    advantage: float
    """Of the second peak's significance over that of the first."""
    share: float
    """Of the blocks that follow it."""

    @property
    def led_astray(self) -> bool:
        """Return whether the guard makes a turn of what was none."""
        return is_turning(self.guarded) and not is_turning(self.plain)


class Follower:
    """A correlator and blocks, with or without a mask, and the guard."""

    def __init__(self, mask: np.ndarray | None) -> None:
        """Make one that waits for its first frame."""
        self.correlator, self.blocks = PhaseCorrelator(mask=mask), BlockMotion(mask=mask)
        self._guard = MeasurementGate(GateSettings())

    def update(self, frame: np.ndarray) -> tuple[Shift, Shift] | None:
        """Return the shift measured, and that after the guard."""
        shift, primed = self.correlator.update(frame), self.blocks.update(frame)
        if shift is None or not primed:
            return None
        return shift, self._guard.judge(shift, self.correlator, self.blocks) or shift


def measure_locks(clips: Sequence[Clip]) -> list[Locked]:
    """Return all pairs that the guard is tried on."""
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
    """Return pairs of a vehicle that stands while others pass."""
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
    second = follower.correlator.second_peak(apart=_APART)
    significance = follower.correlator.significance(second)
    return Locked(
        name, truth, plain[0].dx, plain[1].dx, masked[0].dx, masked[1].dx,
        max(abs(plain[0].dx), abs(plain[0].dy)) < 0.75, second.dx,
        second.response / max(plain[0].response, 1e-9),
        significance, significance - follower.correlator.significance(plain[0]),
        follower.blocks.share_following(second))


def lock_section(pairs: Sequence[Locked], passing: Sequence[Locked]) -> str:
    """Draw the curves of the guard; return its part of the document."""
    at_zero = [pair for pair in (*pairs, *passing) if pair.at_zero]
    good = [pair for pair in at_zero if is_turning(pair.truth)
            and is_right(pair.second, pair.truth)]
    bad = [pair for pair in at_zero if abs(pair.truth) <= _STRAIGHT_PX]
    limit = GateSettings().min_significance

    def of(group: Sequence[Locked], name: str) -> np.ndarray:
        # A second peak so near that it makes no turn does no harm.
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
        straight = [pair for pair in group if abs(pair.truth) <= _STRAIGHT_PX]
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
        '## A fixed pattern', '![Curves](images/quality_zero_lock.png)',
        paragraphs(_LOCK_TEXT.format(turning=_TURNING_PX)),
        table(('', 'turning pairs', 'locked, %', 'right, %', 'with the guard', 'with a mask',
               'with both', 'straight pairs', 'led astray, %'), rows),
        'A vehicle that stands while another one passes:',
        table(('', 'pairs', 'peak elsewhere, %', 'guard follows it, %'), lured)))


def cost_section(clip: Clip) -> str:
    """Return what the tests cost per frame, as a share of the correlation."""
    correlator, blocks, detector = PhaseCorrelator(), BlockMotion(), StillnessDetector()
    spent: dict[str, list[float]] = defaultdict(list)

    def timed(name: str, call: object, *given: object, **named_: object) -> object:
        began = time.perf_counter()
        result = call(*given, **named_)  # type: ignore[operator]
        spent[name].append(time.perf_counter() - began)
        return result

    for frame in clip.frames[:60]:
        shift = timed('correlation', correlator.update, frame)
        if timed('reduced frame', blocks.update, frame):
            timed('significance', correlator.significance, shift)
            flow = timed('motion of the blocks', blocks.flow)
            timed('stillness', detector.update, flow, frame.shape[1])
            second = timed('second peak', correlator.second_peak, apart=_APART)
            timed('share of the blocks', blocks.share_following, second)
    base = np.median(spent['correlation'])
    when = {'second peak': 'peak at zero', 'share of the blocks': 'peak at zero',
            'correlation': ''}
    return '\n\n'.join(('## Cost', table(
        (f'{clip.camera.width}×{clip.camera.height}', 'share of the correlation, %', 'when'),
        [(name, f'{100 * np.median(each) / base:.0f}', when.get(name, 'every pair'))
         for name, each in spent.items()])))


def say(what: str) -> None:
    """Report progress."""
    print(f'\r\033[K{what}', end='', file=sys.stderr, flush=True)


def main() -> None:
    """Run the program."""
    cv2.setNumThreads(1)
    clips = driving()
    say('clips rendered')
    _IMAGES.mkdir(exist_ok=True)
    text = '\n\n'.join((
        '# Quality: what is a measurement, and what stands still',
        paragraphs(_INTRODUCTION.format(versions=versions())),
        gate_section(measure_gate(clips)),
        stillness_section(measure_stillness(clips)),
        lock_section(measure_locks(clips), measure_passing(clips)),
        cost_section(clips[0]))) + '\n'
    _DOCUMENT.write_text(text, encoding='utf-8')
    print(f'\n{text}')


if __name__ == '__main__':
    main()
