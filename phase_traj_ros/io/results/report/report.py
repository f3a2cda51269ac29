# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes the report of a replay as a self-contained HTML file."""

from collections import Counter
from collections.abc import Iterator, Sequence
from html import escape
import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core import (
    Axes,
    CodeSeries,
    CodeSource,
    Freeman,
    Movement,
    normalised,
    to_axes,
)
from phase_traj_ros.core.codes.freeman import to_four
from phase_traj_ros.io.replay.overview import LOW_RESPONSE, Overview, overview, TurnMark
from phase_traj_ros.io.replay.run import Replay
from phase_traj_ros.io.results.chain_code import versions
from phase_traj_ros.io.results.pictures import Thumbnail
from phase_traj_ros.io.results.report import page
from phase_traj_ros.parameter_spec import Spec
from phase_traj_ros.parameters import Parameters, specs

_MOVEMENT_COLOURS = {
    Movement.LEFT: '--left', Movement.FORWARD: '--forward', Movement.RIGHT: '--right',
    Movement.NO_CHANGE: '--rest'}


def write_report(
    result: Replay, path: Path, *, title: str, picture: Path,
    thumbnails: Sequence[Thumbnail] = (), left_out: bytes | None = None,
) -> None:
    """
    Write the report, headed by ``title``.

    ``picture`` is the PNG file to embed. ``thumbnails`` are frames to show at the cursor.
    ``left_out`` is a JPEG picture of the areas that were left out as fixed to the camera; None if
    there are none.
    """
    shown = overview(result)
    content = page.filled(page.template('report.html'), {
        'turns': _turns(shown.turns),
        'trust': _trust(result, left_out),
        'health': _health(result, shown),
        'settings': _settings(result),
        'codes': _codes(result),
        'picture': page.data_uri(picture.read_bytes(), 'png'),
        'data': page.script_json(_script_data(result, shown, thumbnails)),
        'footer': 'Made by ' + ', '.join(
            f'{name} {version}' for name, version in versions().items()),
    })
    page.write_page(
        path, title=title, source=result.source, facts=_facts(result, shown),
        content=content, script=page.template('report.js'))


def _facts(result: Replay, shown: Overview) -> Iterator[tuple[str, str]]:
    yield 'frames', f'{result.frames}'
    yield 'seconds', f'{shown.seconds[-1]:.1f}'
    yield 'frames per second', f'{1 / shown.interval_s:.3g}'
    yield 'turns', f'{len(shown.turns)}'
    yield 'movement codes', f'{len(result.movement)}'
    yield 'direction codes', f'{len(result.direction)}'
    if result.way.pairs:
        unit = result.parameters.settings.length_unit.value
        yield f'distance, {unit}', str(result.way)
        if result.links is not None:
            yield 'links', f'{len(result.links.series)}'
    settings = result.parameters.settings
    if settings.threshold_set is not None:
        yield 'threshold, px per frame', f'{settings.threshold_set:.4g}'
    else:
        auto = settings.code_source is CodeSource.AUTO
        yield 'codes from', 'the turns' if auto else 'the heading'
    yield 'reliable', 'yes' if result.reliability.reliable else 'no'
    yield 'median response', f'{shown.median_response:.3f}'


def _turns(turns: Sequence[TurnMark]) -> page.Markup:
    if not turns:
        return page.Markup('<p class="note">The codes contain no turn.</p>')
    measured = any(turn.angle_deg is not None for turn in turns)
    head = ['turn', 'side', 'from (s)', 'to (s)', 'frames', *['angle'] * measured, '']
    rows = []
    for index, turn in enumerate(turns):
        angle = '' if turn.angle_deg is None else f'{turn.angle_deg:+.1f}°'
        rows.append([
            page.Markup(f'<button type="button" data-turn="{index}">{turn.number}</button>'),
            turn.side.label, f'{turn.start_s:.2f}', f'{turn.end_s:.2f}',
            f'{turn.pair} to {turn.end_pair + 1}', *[angle] * measured,
            page.Markup(f'<span data-strip="{index}"></span>')])
    return page.table(rows, head=head, numbers=(2, 3), kind='turns')


def _trust(result: Replay, left_out: bytes | None) -> page.Markup:
    """Return the reasons to doubt the result, the cuts, and the areas that are left out."""
    notes = [_warning(reason.sentence) for reason in result.reliability.reasons]
    notes += [_warning(f'{problem}.') for problem in result.problems]
    if result.assumes_camera:
        notes.append(
            '<p>No turn has determined the camera: the distance is for the assumed one.</p>')
    if result.threshold_hint is not None:
        notes.append(_warning(f'{result.threshold_hint.sentence}.'))
    cuts = [update.pair for update in result.updates if update.cut]
    if cuts:
        notes.append(f'<p>New scenes start at the frames {", ".join(map(str, cuts))}.</p>')
    if left_out is not None:
        notes.append(
            '<figure><figcaption>Shaded areas are fixed to the camera and left out</figcaption>'
            f'<img alt="Fixed areas" src="{page.data_uri(left_out, "jpeg")}"></figure>')
    return page.Markup(''.join(notes) or '<p class="note">No reason to doubt the result.</p>')


def _warning(sentence: str) -> str:
    return f'<p class="warn">{escape(sentence[0].upper() + sentence[1:])}</p>'


def _health(result: Replay, shown: Overview) -> page.Markup:
    longest_s = float(shown.intervals.max())
    pairs, counters = len(result.updates), result.counters
    statuses = Counter(update.status.value for update in result.updates)
    rows = [
        ('time between frames', _milliseconds(shown.interval_s), False),
        ('longest', _milliseconds(longest_s), longest_s > 1.5 * shown.interval_s),
        ('missing frames, by the stamps', str(shown.missing), shown.missing > 0),
        (f'response below {LOW_RESPONSE:g}', _share(shown.low_responses, pairs),
         shown.low_responses > 0)]
    rows += [(name, str(count), count > 0) for name, count in (
        ('repeated frames', counters.repeated),
        ('frames with a stamp out of order', counters.dropped),
        ('unreadable frames', counters.skipped),
        ('restarts by jumps of the stamps', counters.time_resets))]
    rows += [
        (f'pairs with status {status}', _share(count, pairs), False)
        for status, count in statuses.most_common()]
    rows += [
        (f'distances {state.value}', _share(count, pairs), False)
        for state, count in result.way.states.items() if count]
    return page.table([
        (name, page.Markup(f'<span class="{"warn" if bad else ""}">{escape(value)}</span>'))
        for name, value, bad in rows])


def _settings(result: Replay) -> page.Markup:
    parameters, changed = result.parameters, result.parameters.changed
    camera = '' if result.camera is None else f'<p>Camera: {escape(str(result.camera))}.</p>'
    rows = (
        _setting_rows(parameters, changed) if changed
        else '<p>All parameters have their defaults.</p>')
    return page.Markup(
        f'{camera}{rows}<details><summary>All parameters</summary>'
        f'{_setting_rows(parameters, specs())}</details>')


def _setting_rows(parameters: Parameters, listed: Sequence[Spec]) -> page.Markup:
    return page.table([(
        page.Markup(f'<span title="{escape(spec.description)}">{escape(spec.name)}</span>'),
        f'{parameters.value(spec)} {spec.unit}'.strip() or '(empty)') for spec in listed])


def _codes(result: Replay) -> page.Markup:
    listed: list[tuple[str, CodeSeries[Any]]] = [
        ('movement', result.codes.movement), ('direction', result.codes.direction)]
    if result.links is not None:
        unit = result.parameters.settings.length_unit.value
        listed.append((f'links of {result.links.step:g} {unit}', result.links.series))
    return page.Markup(''.join(
        f'<p class="runs">{escape(name)} ({len(series)}):'
        f' {" ".join(f"{int(run.code)}×{run.count}" for run in series.runs)}</p>'
        for name, series in listed))


def _milliseconds(seconds: float) -> str:
    return f'{seconds * 1e3:.1f} ms'


def _share(count: int, total: int) -> str:
    return f'{count} ({100 * count / total:.1f} %)'


def _script_data(
    result: Replay, shown: Overview, thumbnails: Sequence[Thumbnail],
) -> dict[str, Any]:
    """Return what the script draws; series of codes are strings of one digit per pair."""
    statuses = sorted({update.status.value for update in result.updates})
    directions = sorted(result.codes.directions)
    # A diagonal has the colour of an adjacent direction.
    four = [to_four(code) if isinstance(code, Freeman) else code for code in directions]
    return {
        'seconds': _numbers(shown.seconds, 4),
        'dx': _numbers(shown.dx, 2),
        'response': _numbers(shown.response, 4),
        'heading': None if shown.heading_deg is None else _numbers(shown.heading_deg, 2),
        'speed': None if shown.speed is None else _numbers(shown.speed, 3),
        'speed_unit': f'{result.parameters.settings.length_unit.value}/s',
        'distance_state': None if shown.speed is None else [
            '' if update.travel is None else update.travel.state.value
            for update in result.updates],
        'movement': ''.join(str(int(update.step.movement)) for update in result.updates),
        'direction': ''.join(str(int(update.step.direction)) for update in result.updates),
        'movements': [code.label for code in _MOVEMENT_COLOURS],
        'movement_colours': list(_MOVEMENT_COLOURS.values()),
        # The drawing is independent of the unit; normalised values need few digits.
        'path': np.round(normalised(to_axes(shown.path, Axes.FIGURE)), 4).tolist(),
        'statuses': statuses,
        'status': [statuses.index(update.status.value) for update in result.updates],
        'threshold': result.parameters.settings.threshold_set,
        'directions': [code.label for code in directions],
        'direction_colours': [f'--{code.label}' for code in four],
        'low_response': LOW_RESPONSE,
        'turns': [{
            'number': turn.number,
            'side': turn.side.label,
            'pair': turn.pair, 'end': turn.end_pair,
            'start': round(turn.start_s, 4), 'stop': round(turn.end_s, 4),
        } for turn in shown.turns],
        'thumbnails': [
            {'frame': each.frame, 'src': page.data_uri(each.jpeg, 'jpeg')} for each in thumbnails],
    }


def _numbers(values: NDArray[np.float64], digits: int) -> list[float | None]:
    return [round(value, digits) if math.isfinite(value) else None for value in values.tolist()]
