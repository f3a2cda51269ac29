# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Tests of a measurement: every candidate on related and unrelated pairs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from benchmarks.quality.curves import curve, draw, grouped, is_right, percent, say, true_shift
from benchmarks.quality.data import BLIND, blind_frames, cropped, windows
from benchmarks.shared.clips import Clip
from benchmarks.shared.conditions import CONDITIONS
from benchmarks.shared.report import paragraphs, table
import numpy as np
from phase_traj_ros.core import PhaseCorrelator
from phase_traj_ros.core.correlation.quality import GateSettings
from phase_traj_ros.core.correlation.tuning import TUNING

_STRIDES = (1, 2, 3)
_GAPS = (10, 20, 40)
_ACCEPTED = (0.02, 0.01, 0.003)
_CANDIDATES = {
    'response': 'response (height of the peak)', 'ratio': 'peak over second peak',
    'significance': 'significance of the peak'}
#: Number of unrelated pairs for each condition.
_UNRELATED = 150

_TEXT = """
    The height of the peak (the response) does not separate the two: with a limit that accepts 1 %
    of the unrelated pairs, it loses {response:.0f} % of the good ones. Forward motion spreads the
    peak over many pixels and noise lowers it, while the highest of half a million noise values is
    high by chance. The ratio of the peak to the second peak loses {ratio:.0f} %.

    The chosen test loses {significance:.1f} %. It is the **significance** of the peak: the sum of
    the correlation map over a small square around the peak, divided by the standard deviation of
    this sum for unrelated frames. This deviation is known and not estimated: for unrelated frames
    the map is noise, and its energy is that of the whitened spectrum (Parseval). The sum keeps the
    energy that motion spreads, and noise of either sign cancels in it. The side of the square is
    the square root of the frame's area divided by 85 (9 pixels for 376×1241), so it grows with the
    resolution as the spread does. Half and twice this side work about as well.

    A pair counts as measured from {limit:g} standard deviations on. This loses almost no pair that
    is right, at any noise level. The lost pairs are those of every second or third frame of a fast
    drive, where most pairs are at the limit of what can be measured. A shift is *right* if it is
    off by at most 6 px or 15 %, since near objects move more than rotation alone would move them.
    """


@dataclass(frozen=True, slots=True)
class Pair:
    """The values of all candidates for a pair of frames, and its ground truth."""

    source: str
    condition: str
    gap: int
    """Frames from the first to the second; 0 for unrelated frames."""
    right: bool
    """Whether the shift is correct."""
    response: float
    ratio: float
    """Peak divided by second peak."""
    significance: float


_CORRELATORS: dict[tuple[int, ...], PhaseCorrelator] = {}


def observed(
    source: str, condition: str, frames: tuple[np.ndarray, np.ndarray], gap: int, truth: float,
) -> Pair:
    """Return a pair whose true shift is ``truth`` pixels, NaN if there is none."""
    correlator = _CORRELATORS.setdefault(frames[0].shape, PhaseCorrelator())
    correlator.reset()
    correlator.update(frames[0])
    shift = correlator.update(frames[1])
    assert shift is not None
    second = correlator.second_peak(apart=TUNING.peak_distance_px)
    return Pair(
        source, condition, gap, is_right(shift.dx, truth), shift.response,
        shift.response / max(second.response, 1e-9), correlator.significance(shift))


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
        # A mirrored clip shows the same streets reversed, which makes it a different image.
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
    """Yield pairs with little or nothing to see."""
    for number in range(count):
        at = 7 * number % (len(clip.frames) - 1)
        for name, first, second, related in blind_frames(clip, 7 * number):
            truth = true_shift(clip, at, at + 1) if related else float('nan')
            yield observed(clip.name, name, (first, second), int(related), truth)


def measure(clips: Sequence[Clip]) -> list[Pair]:
    """Return all pairs on which the test of a measurement is tried."""
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
        pairs += unrelated_pairs(spoiled, condition.name, _UNRELATED, number)
        say(f'pairs, {condition.name}')
    for seed, clip in enumerate(clips):
        pairs += distant_pairs(clip, 40, seed)
        pairs += blind_pairs(clip, 15)
    return pairs


def lost_at(good: np.ndarray, bad: np.ndarray, accepted: float) -> float:
    """Return the share of good pairs lost if a share ``accepted`` of the bad ones is accepted."""
    limit = np.quantile(bad, 1.0 - accepted)
    return float(np.mean(good <= limit))


def values(pairs: Iterable[Pair], name: str) -> np.ndarray:
    """Return the values of one candidate for pairs."""
    return np.array([getattr(pair, name) for pair in pairs])


def section(pairs: Sequence[Pair]) -> str:
    """Draw the curves of the first test; return its section of the document."""
    limit = GateSettings().min_significance
    driven = [pair for pair in pairs if pair.gap in _STRIDES and not is_blind(pair)]
    good = [pair for pair in driven if pair.right]
    unrelated = [pair for pair in pairs if not pair.gap and not is_blind(pair)]
    far_or_blind = [pair for pair in pairs if is_blind(pair) or pair.gap in _GAPS]
    draw('measurement', {
        label: curve(values(good, name), values(unrelated, name))
        for name, label in _CANDIDATES.items()
    }, (float(np.mean(values(unrelated, 'significance') >= limit)),
        float(np.mean(values(good, 'significance') < limit))),
        ('unrelated pairs accepted', 'good pairs lost'))
    loss = {(name, share): lost_at(values(good, name), values(unrelated, name), share)
            for name in _CANDIDATES for share in _ACCEPTED}
    text = _TEXT.format(limit=limit, **{name: 100 * loss[name, 0.01] for name in _CANDIDATES})
    return '\n\n'.join((
        '## Pairs that are not measurements',
        '![Curves](../images/quality_measurement.png)', paragraphs(text),
        table(
            ('good pairs lost, %', *(
                f'{percent(share)} % of the unrelated accepted' for share in _ACCEPTED)),
            [(label, *(percent(loss[name, share]) for share in _ACCEPTED))
             for name, label in _CANDIDATES.items()]),
        f'At {limit:g} standard deviations, by condition (every, every second and every third'
        ' frame):',
        gate_table(driven, unrelated, limit, key=lambda pair: pair.condition),
        'By drive, all conditions:',
        gate_table(driven, [], limit, key=lambda pair: f'{pair.source}, every '
                   f'{("", "2nd ", "3rd ")[pair.gap - 1]}frame'),
        'Frames that are far apart or show little:', blind_table(far_or_blind, limit)))


def is_blind(pair: Pair) -> bool:
    """Return whether there is little to see in a pair."""
    return pair.condition.startswith(BLIND)


def gate_table(
    driven: Sequence[Pair], unrelated: Sequence[Pair], limit: float, *,
    key: Callable[[Pair], str],
) -> str:
    """Return which good pairs are lost and which unrelated ones are accepted, by a key."""
    others = grouped(unrelated, key)
    rows = []
    for name, group in grouped(driven, key).items():
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
    """Return the results for pairs that have little or nothing in common."""
    rows = []
    for name, group in grouped(pairs, lambda pair: pair.condition).items():
        accepted = [pair for pair in group if pair.significance >= limit]
        right = percent(np.mean([pair.right for pair in accepted])) if accepted else ''
        rows.append((
            name, len(group), percent(len(accepted) / len(group)),
            right if any(pair.gap for pair in group) else '–'))
    return table(('', 'pairs', 'accepted, %', 'of these right, %'), rows)
