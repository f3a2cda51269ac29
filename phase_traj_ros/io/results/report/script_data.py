# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What the script of the report draws."""

from collections.abc import Sequence
import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core import Axes, Direction, Freeman, Movement, normalised, to_axes
from phase_traj_ros.core.codes.freeman import to_four
from phase_traj_ros.io.replay.overview import LOW_RESPONSE, Overview
from phase_traj_ros.io.replay.run import Replay
from phase_traj_ros.io.results.report.page import data_uri
from phase_traj_ros.io.results.thumbnails import Thumbnail

MOVEMENT_COLOURS: Final = {
    Movement.LEFT: '--left', Movement.FORWARD: '--forward', Movement.RIGHT: '--right',
    Movement.NO_CHANGE: '--rest'}
"""Names of the palette colours, by code."""


def script_data(
    result: Replay, shown: Overview, thumbnails: Sequence[Thumbnail],
) -> dict[str, Any]:
    """Return the data for the script; series of codes are strings of one digit per pair."""
    names = sorted({update.status.value for update in result.updates})
    places = {name: place for place, name in enumerate(names)}
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
        'movements': [code.label for code in MOVEMENT_COLOURS],
        'movement_colours': list(MOVEMENT_COLOURS.values()),
        # The drawing is independent of the unit; normalised values need few digits.
        'path': np.round(normalised(to_axes(shown.path, Axes.FIGURE)), 4).tolist(),
        'statuses': names,
        'status': [places[update.status.value] for update in result.updates],
        'threshold': result.parameters.settings.threshold_set,
        **_directions(result.codes.directions),
        'low_response': LOW_RESPONSE,
        'turns': [{
            'number': turn.number,
            'side': turn.side.label,
            'pair': turn.pair, 'end': turn.end_pair,
            'start': round(turn.start_s, 4), 'stop': round(turn.end_s, 4),
        } for turn in shown.turns],
        'thumbnails': [
            {'frame': each.frame, 'src': data_uri(each.jpeg, '.jpg')} for each in thumbnails],
    }


def _directions(codes: type[Direction] | type[Freeman]) -> dict[str, list[str]]:
    """Return names and colours by code; a diagonal has the colour of an adjacent direction."""
    each = sorted(codes)
    four = [to_four(code) if isinstance(code, Freeman) else code for code in each]
    return {
        'directions': [code.label for code in each],
        'direction_colours': [f'--{code.label}' for code in four],
    }


def _numbers(values: NDArray[np.float64], digits: int) -> list[float | None]:
    return [round(value, digits) if math.isfinite(value) else None for value in values.tolist()]
