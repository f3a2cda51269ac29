# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Whatever runs write into a folder and however they end, no file of the user is lost."""

from contextlib import suppress
from pathlib import Path
import tempfile

from hypothesis import given, settings, strategies as st
from phase_traj_ros.errors import OutputError
from phase_traj_ros.io.outputs.outputs import output_directory

NAMES = ('chain_code.json', 'report.html', 'trajectory.png')
RUNS = st.builds(
    dict, kind=st.just('run'), names=st.sets(st.sampled_from(NAMES), min_size=1),
    adds=st.booleans(), error=st.sampled_from([None, KeyboardInterrupt, ValueError, OSError]))
EDITS = st.builds(
    dict, kind=st.just('edit'), name=st.sampled_from((*NAMES, 'notes.txt', 'manifest.json')))


def contents(folder):
    return {path.name: path.read_text() for path in folder.iterdir()}


def run(folder, number, *, names, adds, error):
    """Write the files, which have the number of the run as their text, or fail."""
    with output_directory(folder, names=names, adds=adds) as staging:
        for name in names:
            (staging / name).write_text(f'run {number}')
        if error is not None:
            raise error


@settings(deadline=None)
@given(steps=st.lists(RUNS | EDITS, max_size=8))
def test_no_file_of_the_user_is_lost_and_runs_are_whole(steps):
    with tempfile.TemporaryDirectory() as place:
        folder, users = Path(place), {}
        for number, step in enumerate(steps):
            options = dict(step)
            before = contents(folder)
            if options.pop('kind') == 'edit':
                users[step['name']] = f'usr {number}'
                (folder / step['name']).write_text(users[step['name']])
                continue
            done = False
            with suppress(OutputError, KeyboardInterrupt, ValueError):
                run(folder, number, **options)
                done = True
            after = contents(folder)
            assert users.items() <= after.items()
            if done:
                assert all(after[name] == f'run {number}' for name in step['names'])
            else:
                assert after == before
