# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Draws the state of a replay in the terminal while it runs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
import shutil
import time
from typing import TextIO

from phase_traj_ros.cli.escaping import escaped
from phase_traj_ros.core import Corner, Movement, TrajectoryEstimator, Update
from phase_traj_ros.io.replay.run import Watcher
from phase_traj_ros.io.results.path_text import path_lines
from phase_traj_ros.io.sources.base import Entry, StampedFrame

_PERIOD_S = 0.1
_PATH_ROWS = 14
_PATH_COLUMNS = 72
_BAR = 24
_KEPT_CORNERS = 100_000
_HIDE_CURSOR, _SHOW_CURSOR = '\x1b[?25l', '\x1b[?25h'


class LiveView(Watcher):
    """
    Watches a replay: progress, codes, response, and the path as it grows.

    On a terminal, the view stays in place and is redrawn ten times a second. Otherwise (a file, a
    pipe) one line is written for each turn, and the path at the end. This is a context manager.
    """

    def __init__(
        self, stream: TextIO, *, title: str, total: int | None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """
        Show the view on ``stream``.

        Parameters
        ----------
        stream
            Output stream.
        title
            Name of the source.
        total
            Number of frames to expect, if known.
        clock
            Monotonic clock in seconds.

        """
        self._stream = stream
        self._title = escaped(title)
        self._total = total
        self._doing = ''
        self._clock = clock
        self._terminal = stream.isatty()
        self._braille = (stream.encoding or '').lower().replace('-', '').startswith('utf8')
        self._began = clock()
        self._due = self._began
        self._lines = 0
        self._newest: tuple[Update, TrajectoryEstimator] | None = None

    def __enter__(self) -> LiveView:
        if self._terminal:
            self._write(_HIDE_CURSOR)
        return self

    def __exit__(self, *_: object) -> None:
        if self._newest is not None:
            if self._terminal:
                self._draw(*self._newest)
            else:
                self._write_path(self._newest[1])
        if self._terminal:
            self._write(_SHOW_CURSOR)

    def over(self, frames: Iterable[Entry], doing: str) -> Iterator[Entry]:
        """Yield the frames of a pass, named ``doing``, and show the progress."""
        self._began = self._clock()
        self._doing = f', {doing}' if doing else ''
        if doing and not self._terminal:
            self._write(f'{self._title}{self._doing}\n')
        for number, frame in enumerate(frames, 1):
            yield frame
            # A pass that only learns the camera has no other results to show.
            if self._terminal and self._newest is None and self._clock() >= self._due:
                self._show([self._progress(number)])

    def add(self, frame: StampedFrame, update: Update, estimator: TrajectoryEstimator) -> None:
        """Take the result of a pair."""
        self._newest = update, estimator
        if not self._terminal:
            if update.step.movement in (Movement.LEFT, Movement.RIGHT):
                self._write(f'{self._title}: {_state(update)}, {_measured(update)}\n')
        elif self._clock() >= self._due:
            self._draw(update, estimator)

    def _draw(self, update: Update, estimator: TrajectoryEstimator) -> None:
        columns, rows = shutil.get_terminal_size()
        lines = [self._progress(estimator.counters.frames), _state(update), _measured(update)]
        # The view must not be higher than the terminal: it could not be redrawn in place.
        room = min(_PATH_ROWS, rows - len(lines) - 2)
        if room > 0:
            lines += path_lines(
                _corners(estimator), columns=min(_PATH_COLUMNS, columns - 1), rows=room,
                braille=self._braille)
        self._show(lines)

    def _show(self, lines: list[str]) -> None:
        columns, _ = shutil.get_terminal_size()
        back = f'\x1b[{self._lines}F' if self._lines else ''
        text = '\n'.join(line[:columns - 1] for line in lines)
        self._write(f'{back}\x1b[J{text}\n')
        self._lines = len(lines)
        self._due = self._clock() + _PERIOD_S

    def _write(self, text: str) -> None:
        """Write to the stream; a reader that has closed it does not stop the work."""
        with suppress(OSError):
            self._stream.write(text)
            self._stream.flush()

    def _progress(self, frames: int) -> str:
        rate = frames / max(self._clock() - self._began, 1e-9)
        name = self._title + self._doing
        if not self._total:
            return f'{name}  {frames} frames, {rate:.0f} frames/s'
        done = min(frames / self._total, 1.0)
        bar = '#' * round(done * _BAR)
        return (
            f'{name}  [{bar:<{_BAR}}] {100 * done:.0f} %, {frames} of {self._total}'
            f' frames, {rate:.0f} frames/s')

    def _write_path(self, estimator: TrajectoryEstimator) -> None:
        lines = path_lines(
            _corners(estimator), columns=_PATH_COLUMNS, rows=_PATH_ROWS, braille=self._braille)
        self._write(''.join(f'{line}\n' for line in lines if line))


def _corners(estimator: TrajectoryEstimator) -> tuple[Corner, ...]:
    return estimator.path.points(_KEPT_CORNERS)


def _state(update: Update) -> str:
    movement, direction = update.step.movement, update.step.direction
    return (
        f'pair {update.pair}  movement {int(movement)} {movement.label}'
        f'  direction {int(direction)} {direction.label}  {update.status.value}')


def _measured(update: Update) -> str:
    if update.shift is None:
        return 'no shift'
    return f'shift {update.shift.dx:+.1f} px  response {update.shift.response:.3f}'
