# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
One step of the correlator against its peers, and against the minimum that any such step needs.

A step is everything from a greyscale frame of bytes to the shift. In each comparison, the two
alternate frame by frame, so the ratio compares what ran at the same time. The answers are compared
as well.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from benchmarks.shared.clips import Clip, usual_clips
from benchmarks.shared.peers import BareTransforms, Klt, OpenCv, Orb, Ours, Peer, ScikitImage
from benchmarks.shared.report import disturbance, paragraphs, table, verdict
from benchmarks.shared.timing import (
    Bystanders,
    bystanders,
    prepare,
    Quartiles,
    ratios,
    take_turns,
    Timed,
)
import cv2
import numpy as np

_FRAMES = 40
_WARM_UP = 5
#: Every comparison is repeated this many times, one after the other, so that a disturbance of a
#: few seconds does not decide any of them.
_PASSES = 3

INTRODUCTION = paragraphs("""
    A step of the correlator covers everything from an 8-bit grey frame to the subpixel shift:
    conversion, window, transforms, whitening and peak, on one thread. In each row, the step and
    its peer alternate frame by frame in one process and swap places every time. Times are medians
    of processor time. The ratio is that of the medians; its quartiles are those of the ratio from
    frame to frame. *Differ* is the median difference between the two answers. It is tenths of a
    pixel, because the peers round to whole pixels, have broader peaks, or measure the rotation
    alone.

    `cv2.phaseCorrelate` receives its own window and float32 frames, each converted once.
    scikit-image (upsample factor 1, no window) receives the frames as they are, and in a second
    row as float32. KLT tracks 1000 corners into the next frame; ORB matches 1000 features with a
    cross-check. Both estimate an essential matrix with RANSAC and decompose it into the rotation.
    The bare transforms are one forward and one inverse transform of the padded size, with the
    library that the step uses (`cv2.dft` with `dst=`, scipy in place).
    """)


@dataclass(frozen=True, slots=True, kw_only=True)
class Opponent:
    """A peer, the number of its frames in each pass, and the target."""

    name: str
    make: Callable[[Clip], Peer]
    rounds: int
    tolerance_px: float | None
    """Tolerance of the median answer relative to ours; None if it gives no answer."""
    limits: tuple[float | None, ...]
    """Target for the ratio at each size that is measured; None without a target."""


OPPONENTS = (
    Opponent(
        name='cv2.phaseCorrelate', make=lambda _: OpenCv(), rounds=120, tolerance_px=0.6,
        limits=(0.62, 0.62, 0.65)),
    Opponent(
        name='bare transforms', make=lambda clip: BareTransforms(clip.shape), rounds=120,
        tolerance_px=None, limits=(1.4, 1.4, 1.4)),
    Opponent(
        name='scikit-image', make=lambda _: ScikitImage(), rounds=40, tolerance_px=1.0,
        limits=(0.10, None)),
    Opponent(
        name='scikit-image, float32', make=lambda _: ScikitImage(dtype=np.float32), rounds=40,
        tolerance_px=1.0, limits=(None, None)),
    Opponent(
        name='KLT + essential matrix', make=lambda clip: Klt(clip.camera), rounds=40,
        tolerance_px=3.0, limits=(0.16, None)),
    Opponent(
        name='ORB + essential matrix', make=lambda clip: Orb(clip.camera), rounds=40,
        tolerance_px=3.0, limits=(0.12, None)),
)


@dataclass(frozen=True, slots=True)
class Duel:
    """Result of one comparison."""

    clip: Clip
    opponent: Opponent
    ours: Timed
    theirs: Timed
    limit: float | None

    @property
    def ratio(self) -> float:
        """Return the ratio of the medians."""
        return self.ours.ms / self.theirs.ms

    @property
    def spread(self) -> Quartiles:
        """Return the quartiles of the ratio from frame to frame."""
        return ratios(self.ours, self.theirs)

    @property
    def difference_px(self) -> float | None:
        """Return the median difference of the answers; None if there is none to compare."""
        if self.opponent.tolerance_px is None:
            return None
        # A missing answer counts as an infinite error.
        return float(np.median([
            np.inf if b is None else abs(a - b)
            for a, b in zip(self.ours.results, self.theirs.results)]))


def fight(clip: Clip, opponent: Opponent) -> tuple[Timed, Timed]:
    """Let the two alternate once through the clip."""
    cv2.setRNGSeed(0)
    peer = opponent.make(clip)
    timed = take_turns(
        {'ours': Ours().update, 'theirs': peer.update},
        clip.there_and_back(opponent.rounds + _WARM_UP), warm_up=_WARM_UP)
    if isinstance(peer, BareTransforms) and not peer.is_exact():
        raise AssertionError('the bare transforms do not lead back to where they began')
    return timed['ours'], timed['theirs']


def measure() -> tuple[list[Duel], Bystanders]:
    """Return the results of all comparisons, with checked answers, and the other load."""
    duels = [
        Duel(clip, opponent, Timed(), Timed(), opponent.limits[index])
        for index, clip in enumerate(usual_clips(_FRAMES)) for opponent in OPPONENTS
        if index < len(opponent.limits)]
    with bystanders() as watched:
        for _ in range(_PASSES):
            for duel in duels:
                for total, part in zip((duel.ours, duel.theirs), fight(duel.clip, duel.opponent)):
                    total.extend(part)
    for duel in duels:
        _check(duel)
    return duels, watched


def _check(duel: Duel) -> None:
    tolerance, difference = duel.opponent.tolerance_px, duel.difference_px
    if tolerance is not None and difference is not None and difference > tolerance:
        raise AssertionError(
            f'{duel.opponent.name} and the correlator differ by {difference:.2f} px (median) on '
            f'{duel.clip.name}: at least one of the two does not do what is measured here')


def section(duels: list[Duel], watched: Bystanders) -> str:
    """Return the results as Markdown."""
    header = ('frame', 'against', 'step, ms', 'peer, ms', 'ratio', 'quartiles', 'at most',
              'met', 'differ, px')
    rows = []
    for duel in duels:
        height, width = duel.clip.shape
        difference = duel.difference_px
        rows.append((
            f'{height}×{width}, {duel.clip.name}', duel.opponent.name, f'{duel.ours.ms:.2f}',
            f'{duel.theirs.ms:.2f}', f'{duel.ratio:.3f}',
            f'{duel.spread.low:.3f}–{duel.spread.high:.3f}',
            '' if duel.limit is None else f'{duel.limit:g}', verdict(duel.ratio, duel.limit),
            '' if difference is None else f'{difference:.2f}'))
    return (f'## Speed\n\n{INTRODUCTION}\n\n{table(header, rows)}\n\n'
            f'{disturbance(watched)}')


if __name__ == '__main__':
    prepare()
    print(section(*measure()))
