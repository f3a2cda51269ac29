# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The summary of a batch as a table, in CSV and HTML."""

from collections.abc import Sequence
import csv
from html import escape
from pathlib import Path
from urllib.parse import quote

import numpy as np
from phase_traj_ros.core import Axes, normalised, to_axes
from phase_traj_ros.io.outputs.outputs import output_directory
from phase_traj_ros.io.results.report.page import Markup, table, write_page
from phase_traj_ros.tasks.batch.job import REPORT
from phase_traj_ros.tasks.batch.outcome import Outcome, Status

CSV_NAME = 'summary.csv'
HTML_NAME = 'summary.html'
SUMMARY_NAMES = (CSV_NAME, HTML_NAME)
_FACTS = (
    'distance', 'distance_unit', 'distance_states',
    'missing_frames', 'dropped_frames', 'skipped_frames', 'repeated_frames', 'camera',
    'mount', 'warnings')
COLUMNS = (
    'source', 'folder', 'status', 'frames', 'turns', 'seconds', 'error', 'reliable', 'reasons',
    *_FACTS)

# Signs that begin a formula.
_FORMULA = ('=', '+', '-', '@', '\t', '\r')
# Side of the square in which a route is drawn.
_SIDE = 40


def write_summary(outcomes: Sequence[Outcome], directory: Path, *, force: bool = False) -> None:
    """
    Write summary.csv and summary.html, one row per source, both or none.

    Raises
    ------
    OutputError
        The files cannot be written, or would replace files of someone else.

    """
    with output_directory(directory, names=SUMMARY_NAMES, adds=True, force=force) as staging:
        with (staging / CSV_NAME).open(
                'w', encoding='utf-8', errors='backslashreplace', newline='') as file:
            writer = csv.writer(file, lineterminator='\n')
            writer.writerow(COLUMNS)
            writer.writerows(map(_as_text, _row(outcome)) for outcome in outcomes)
        _write_html(outcomes, directory, staging / HTML_NAME)


def _row(outcome: Outcome) -> list[str]:
    found = outcome.reliability
    return [
        outcome.source, outcome.folder, outcome.status.value, str(outcome.frames),
        str(outcome.turns), f'{outcome.seconds:.2f}', outcome.error,
        '' if found is None else str(found.reliable).lower(),
        '' if found is None else ' '.join(found.words),
        *(outcome.facts.get(column, '') for column in _FACTS)]


def _as_text(cell: str) -> str:
    """Return a cell that no spreadsheet takes for a formula."""
    return f"'{cell}" if cell.startswith(_FORMULA) else cell


def _write_html(outcomes: Sequence[Outcome], directory: Path, path: Path) -> None:
    done = [outcome for outcome in outcomes if outcome.status is Status.OK]
    facts = {
        'sources': len(outcomes),
        'done': len(done),
        'failed': len(outcomes) - len(done),
        'not reliable': sum(
            outcome.reliability is not None and not outcome.reliability.reliable
            for outcome in done),
        'frames': sum(outcome.frames for outcome in done),
        'turns': sum(outcome.turns for outcome in done),
    }
    rows = table(
        [_cells(outcome, directory) for outcome in outcomes], head=('', *COLUMNS),
        numbers=(4, 5, 6, 10, 13, 14, 15, 16), kind='routes')
    write_page(
        path, title='Trajectories', facts=[(name, str(count)) for name, count in facts.items()],
        content=Markup(f'<main class="card">\n{rows}\n</main>'))


def _cells(outcome: Outcome, directory: Path) -> list[str]:
    cells: list[str] = [_route(outcome), *_row(outcome)]
    # The links are not loaded; the user follows them.
    for page in (REPORT, 'trajectory.png'):
        if outcome.status is Status.OK and (directory / outcome.folder / page).exists():
            address = escape(quote(f'{outcome.folder}/{page}'))
            cells[2] = Markup(f'<a href="{address}">{escape(outcome.folder)}</a>')
            break
    if outcome.status is not Status.OK:
        cells[3] = Markup(f'<span class="warn">{outcome.status.value}</span>')
    if outcome.reliability is not None and not outcome.reliability.reliable:
        cells[8] = Markup(f'<span class="warn">{cells[8]}</span>')
    return cells


def _route(outcome: Outcome) -> Markup:
    """Return a thumbnail of the drawn path, its start heading up."""
    if not outcome.route:
        return Markup('')
    points = normalised(to_axes(np.array(outcome.route, np.float64), Axes.FIGURE))
    points = (points - points.min(axis=0)) * _SIDE
    places = ' '.join(f'{x:.1f},{_SIDE - y:.1f}' for x, y in points)
    end_x, end_y = points[-1]
    return Markup(
        f'<svg viewBox="-4 -4 {_SIDE + 8} {_SIDE + 8}"><polyline points="{places}"/>'
        f'<circle cx="{end_x:.1f}" cy="{_SIDE - end_y:.1f}" r="2"/></svg>')
