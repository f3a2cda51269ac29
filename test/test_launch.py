# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The launch files and what they show, where launch is installed."""

from pathlib import Path

from phase_traj_ros.io.messages.topics import DEBUG_IMAGE, pair_topics, whole_topics
from phase_traj_ros.parameters import Parameters
import pytest
import yaml

ROOT = Path(__file__).resolve().parents[1]


def test_arguments_are_those_of_the_docs():
    pytest.importorskip('launch_ros')
    sources = pytest.importorskip('launch.launch_description_sources')
    description = sources.get_launch_description_from_python_launch_file(
        str(ROOT / 'launch' / 'phase_traj.launch.py'))
    page = (ROOT / 'docs' / 'reference' / 'launch.md').read_text()
    table = page.split('| launch argument |')[1].split('\n\n')[0]
    documented = [
        line.split('|')[1].strip(' `') for line in table.splitlines() if line.startswith('| `')]
    assert [argument.name for argument in description.get_launch_arguments()] == documented


def test_rviz_shows_topics_of_the_node():
    config = yaml.safe_load((ROOT / 'config' / 'phase_traj.rviz').read_text())
    displays = config['Visualization Manager']['Displays']
    shown = {each['Topic']['Value'].removeprefix('/phase_traj/')
             for each in displays if 'Topic' in each}
    parameters = Parameters(camera_height=1.5)
    published = {topic.name for topic in (
        *pair_topics(parameters), *whole_topics(parameters), DEBUG_IMAGE)}
    assert {'path', 'pose', 'odom', 'debug_image'} <= shown <= published
    kinds = {each['Class'].rpartition('/')[2]: each for each in displays}
    assert kinds['Odometry']['Covariance']['Value'] and 'TF' in kinds
    # The launch file remaps each of them to the node's names.
    [remapped] = [line for line in (ROOT / 'launch' / 'phase_traj.launch.py').read_text(
        ).splitlines() if line.startswith('SHOWN = ')]
    assert all(repr(topic) in remapped for topic in shown)
