# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Correct turns from unknown cameras: 16 cameras with 10 drives each, and real clips.

Renders the drives, which takes most of the time, and keeps their frames in out/any_camera (20 GB
in total). The complete run takes more than an hour on two cores, and writes
docs/measurements/any_camera.md; --camera and --plan select a part, of which it only prints.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import as_completed, ProcessPoolExecutor
import multiprocessing

from benchmarks.shared.report import paragraphs, table, versions, write_page
from benchmarks.turns.any_camera_drives import MOUNTS, PLANS
from benchmarks.turns.any_camera_runs import (
    Drive,
    keep,
    kept,
    Outcome,
    real,
    rendered,
    score,
    THRESHOLDS,
    variants,
)
import cv2
import numpy as np

_REAL = ('00', '06')
_LEARNED = (('first', 'after the first turn'), ('third', 'after three'), ('end', 'at the end'))
_WAYS = {
    'auto': 'turns, rounded to quarter turns (`auto`)',
    'one pass': 'the same in one pass, as the node',
    'heading': 'quantised heading',
    **{f'{rate:g}°/s': f"paper's state machine, T = {rate:g}°/s" for rate in THRESHOLDS}}

_INTRODUCTION = """
    This page measures whether `phase_traj replay VIDEO`, without any option, finds the right turns
    with an unknown camera.

    {right} of the {turning} drives with turns are right ({share:.0%}), and {clean} of the
    {straight} drives without turns have none. In one pass, as live, these numbers are {live} and
    {live_clean}. With the same cameras, the quantised heading is right on {heading} of the
    {turning} drives, and the paper's state machine with its best threshold on {paper}.

    The drives are rendered (`phase_traj_ros.synthetic`) for {cameras} cameras and {plans} plans of
    a drive, {drives} drives in all. The cameras differ in size, rate, field of view, lens
    and mount, and in their position on the vehicle. Clips of the KITTI odometry benchmark, without
    their calibration, add one real camera.

    The true turns are those that `find_turns` finds in the true heading; each one counts
    `quarter_turns` times, in order. Angles of 55° to 65° and of 130° to 140° are not counted, nor
    is a turn in progress at the end. The order of the codes is that of 0 (L) and 2 (R) in
    `movement`.

    Written by `make any-camera` with {versions}.
    """

_TURNS = """
    ## Turns

    *Yes* marks drives whose turns are right. Elsewhere the cell shows the codes, and after a slash
    those of one pass if they differ.
    """

_RELIABLE = """
    {reliable} of the {drives} results are reported as reliable ({share:.0%}). Of the {wrong} wrong
    results, {assured} are reported as reliable, too.
    """

_CAMERA = """
    ## What is learned of the camera

    The error is the relative error of the focal length. ± is half the width of the stated 90 %
    interval. *After* a turn means 1.6 s after its end.
    """

_COMPARISON = """
    ## Three ways to make codes

    All of them use the camera that the whole drive has determined. The state machine takes the
    shift of the picture, as in the paper, with a threshold that is a yaw rate, so it fits the
    camera and its frame rate. It judges how fast the picture turns and not how far: a slow turn
    has no code, a fast one several, and a bend can have codes although the direction stays. The
    quantised heading changes its code halfway between two directions, a little past 45°, wherever
    the drive began. Rounding the turns to quarter turns tolerates both crossings that are not
    right angles and errors of the field of view.
    """

_CLIPS = """
    ## Real clips

    These are clips of KITTI's left grey camera, as they are and modified. *Upper half* lacks the
    road. *Left half* has its optical axis at its right edge.
    """


def main() -> None:
    """Run the drives and write the document."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--camera', action='append', help='part of the name of a camera')
    parser.add_argument('--plan', action='append', help='part of the name of a plan')
    parser.add_argument('--jobs', type=int, default=2, help='processes')
    parser.add_argument(
        '--go-on', action='store_true', help='take what an earlier run has found')
    chosen = parser.parse_args()
    jobs: list[tuple[str, str]] = [
        (plan, camera) for camera in _matching(MOUNTS, chosen.camera)
        for plan in _matching(PLANS, chosen.plan)]
    drives: list[Outcome] = []
    context = multiprocessing.get_context('spawn')
    with ProcessPoolExecutor(
            chosen.jobs, context, initializer=cv2.setNumThreads, initargs=(1,)) as workers:
        clips = [workers.submit(_clips, sequence, go_on=chosen.go_on) for sequence in _REAL]
        for done in as_completed([
                workers.submit(_drive, *job, go_on=chosen.go_on)
                for job in sorted(jobs, key=_pixels)]):
            drives.append(done.result())
            print(_line(drives[-1]), flush=True)
        real_ones = [outcome for each in clips for outcome in each.result()]
    for outcome in real_ones:
        print(_line(outcome))
    drives.sort(key=lambda each: jobs.index((each.plan, each.camera)))
    if len(drives) == len(MOUNTS) * len(PLANS):
        write_page('any_camera', document(drives, real_ones))


def document(drives: Sequence[Outcome], clips: Sequence[Outcome]) -> Iterator[str]:
    """Yield the blocks of the page on these results."""
    turning = [each for each in drives if each.right]
    straight = [each for each in drives if not each.right]

    def right(some: Iterable[Outcome], way: str) -> int:
        return sum(each.is_right(way) for each in some)

    parts = [
        '# Any camera',
        _INTRODUCTION.format(
            right=right(turning, 'auto'), turning=len(turning),
            share=right(turning, 'auto') / len(turning), straight=len(straight),
            clean=right(straight, 'auto'), live=right(turning, 'one pass'),
            live_clean=right(straight, 'one pass'), heading=right(turning, 'heading'),
            paper=max(right(turning, f'{rate:g}°/s') for rate in THRESHOLDS),
            cameras=len(MOUNTS), plans=len(PLANS), drives=len(drives), versions=versions()),
        _TURNS,
        table(('camera', *PLANS), (
            (camera, *(_cell(drives, camera, plan) for plan in PLANS)) for camera in MOUNTS)),
        *_reliable(drives), _CAMERA, _targets(drives), _learned(drives), _COMPARISON,
        table(('codes', f'right, of {len(turning)} with turns',
               f'none, of {len(straight)} without'), (
            (words, right(turning, way), right(straight, way)) for way, words in _WAYS.items())),
    ]
    if clips:
        parts += [_CLIPS, table(
            ('clip', 'pictures', 'true', 'codes', 'one pass', 'reliable', 'focal length, error',
             '± (90 %)'),
            ((each.plan, each.camera, each.right or '–', each.orders['auto'] or '–',
              each.orders['one pass'] or '–', _reasons(each), *_focal(each, 'end'))
             for each in clips))]
    for part in parts:
        yield part if part.startswith(('|', '#')) else paragraphs(part)


def _cell(drives: Iterable[Outcome], camera: str, plan: str) -> str:
    found = next(each for each in drives if (each.camera, each.plan) == (camera, plan))
    two, one = ('yes' if found.is_right(way) else f'**{found.orders[way] or "none"}**'
                for way in ('auto', 'one pass'))
    return two if one == two else f'{two} / {one}'


def _reliable(drives: Sequence[Outcome]) -> Iterator[str]:
    """Yield what the results say of themselves, and which of them say that they are not sure."""
    doubtful = [each for each in drives if each.reasons]
    wrong = [each for each in drives if not each.is_right('auto')]
    yield _RELIABLE.format(
        drives=len(drives), reliable=len(drives) - len(doubtful),
        share=1 - len(doubtful) / len(drives), wrong=len(wrong),
        assured=sum(not each.reasons for each in wrong))
    if doubtful:
        yield table(('camera', 'plan', 'turns', 'reasons'), (
            (each.camera, each.plan, 'right' if each.is_right('auto') else 'wrong',
             _reasons(each)) for each in doubtful))


def _reasons(outcome: Outcome) -> str:
    return ', '.join(f'`{reason}`' for reason in outcome.reasons) or 'yes'


def _targets(drives: Sequence[Outcome]) -> str:
    """Return the table of how near and how sure the focal length was."""
    def shares(name: str) -> tuple[str, ...]:
        some = [each.focal[name] for each in drives if name in each.focal]
        known = [each for each in some if each is not None]
        if not known:
            return ('0', *(['–'] * 6))

        def share(holds: Callable[[float, float], bool]) -> str:
            return f'{sum(holds(each.error, each.half) for each in known) / len(some):.0%}'

        return (
            f'{len(known)} of {len(some)}', share(lambda error, _: abs(np.expm1(error)) < 0.1),
            share(lambda error, _: abs(np.expm1(error)) < 0.05),
            share(lambda error, half: abs(error) <= half),
            f'{np.median([abs(each.error) for each in known]):.1%}',
            f'{np.median([each.half for each in known]):.1%}',
            f'{max(each.half for each in known):.1%}')

    return table(
        ('', 'with an estimate', 'within 10 %', 'within 5 %', 'in the interval', 'median error',
         'median ±', 'widest ±'), ((words, *shares(name)) for name, words in _LEARNED))


def _learned(drives: Sequence[Outcome]) -> str:
    """Return the table of what was learned of each camera."""
    rows = []
    for camera, mount in MOUNTS.items():
        some = [each for each in drives if each.camera == camera]
        cells: list[str] = []
        for name, _ in _LEARNED:
            known = [each.focal[name] for each in some if each.focal.get(name) is not None]
            errors = [each.error for each in known if each is not None]
            covered = sum(each.covered for each in known if each is not None)
            cells += [
                f'{np.expm1(min(errors)):+.1%} to {np.expm1(max(errors)):+.1%}' if errors else '–',
                f'{covered} of {len(known)}']
        told = [each.tilt for each in some if each.focal.get('end') is not None]
        pitch, roll = np.median(told, axis=0) if told else (0.0, 0.0)
        rows.append((camera, *cells, f'{pitch:+.1f}° ({mount.pitch_deg:+g}°)',
                     f'{roll:+.1f}° ({mount.roll_deg:+g}°)'))
    header = [word for _, words in _LEARNED for word in (words, 'in the interval')]
    return table(('camera', *header, 'pitch (true)', 'roll (true)'), rows)


def _focal(outcome: Outcome, name: str) -> tuple[str, str]:
    known = outcome.focal.get(name)
    return ('–', '–') if known is None else (
        f'{np.expm1(known.error):+.1%}', f'{known.half:.1%}')


def _line(outcome: Outcome) -> str:
    verdict = 'right' if outcome.is_right('auto') else 'WRONG'
    return (
        f'{verdict} {outcome.plan}, {outcome.camera}: {outcome.orders["auto"] or "none"}, in one'
        f' pass {outcome.orders["one pass"] or "none"}; true: {outcome.right or "none"};'
        f' focal length {", ".join(_focal(outcome, "end"))}; reliable: {_reasons(outcome)};'
        f' {outcome.seconds:.0f} s')


def _matching(names: Iterable[str], parts: Sequence[str] | None) -> list[str]:
    return [
        name for name in names if not parts or any(part in name for part in parts)]


def _pixels(job: tuple[str, str]) -> float:
    """Return how many pixels a second the camera of a job takes: the most work comes last."""
    mount = MOUNTS[job[1]]
    return mount.camera.width * mount.camera.height * mount.rate_hz


def _drive(plan: str, camera: str, *, go_on: bool) -> Outcome:
    return _outcome(plan, camera, lambda: rendered(plan, camera), go_on=go_on)


def _clips(sequence: str, *, go_on: bool) -> list[Outcome]:
    clip = real(sequence)
    return [] if clip is None else [
        _outcome(each.plan, each.camera, lambda each=each: each, go_on=go_on)
        for each in variants(clip)]


def _outcome(plan: str, camera: str, drive: Callable[[], Drive], *, go_on: bool) -> Outcome:
    """Return what an earlier run has kept, if that is wanted, or replay the drive."""
    outcome = kept(plan, camera) if go_on else None
    if outcome is None:
        outcome = score(drive())
        keep(outcome)
    return outcome


if __name__ == '__main__':
    main()
