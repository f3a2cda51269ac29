# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The tables of the docs against the running node."""

from pathlib import Path
import re

from live import Live
from made_town import write_town
from phase_traj_ros.core import PairStatus, TravelState
from phase_traj_ros.parameter_spec import Group
from phase_traj_ros.parameters import specs
import pytest

DOCS = Path(__file__).resolve().parents[2] / 'docs'
# What every managed node has, and what belongs to a topic's quality of service.
OF_EVERY_NODE = re.compile(
    'use_sim_time|autostart|start_type_description_service|qos_overrides\\..*')


@pytest.fixture(scope='module')
def node(shared_live: Live, tmp_path_factory):
    """Start the node with all its topics and wait until the graph knows it."""
    live, town = shared_live, tmp_path_factory.mktemp('map') / 'town.osm'
    live.start(
        '-p', 'code_source:=heading', '-p', 'use_speed_topic:=true', '-p', 'code_step:=2.0',
        '-p', f'map_file:={write_town(town)}')
    live.describe_parameters()
    # Answering comes before being listed: the services are announced one by one.
    live.until(lambda: {'~/save', '~/list_parameters'} <= of_node(
        live.node.get_service_names_and_types_by_node('phase_traj', '/')
        if 'phase_traj' in live.node.get_node_names() else []).keys())
    return live


def table(document, heading, columns):
    """Return the rows of the table under a heading, cells without quotes."""
    section = (DOCS / document).read_text().split(heading, 1)[1].split('\n## ', 1)[0]
    rows = [line for line in section.splitlines() if line.startswith('|')][2:]
    cells = [[cell.strip().strip('`') for cell in row.strip('|').split('|')] for row in rows]
    assert cells and all(len(row) == columns for row in cells)
    return cells


def of_node(names_and_types):
    return {
        name.replace('/phase_traj/', '~/').removeprefix('/'): types[0]
        for name, types in names_and_types}


def offered(live, ask, names):
    """Return what a node has; the graph learns of its endpoints one by one."""
    live.until(lambda: set(names) <= of_node(ask('phase_traj', '/')).keys())
    return of_node(ask('phase_traj', '/'))


def test_published_topics(node):
    documented = {
        row[0].removeprefix('/'): row[1]
        for row in table('reference/topics.md', '## Published', 4)}
    common = {'rosout', 'parameter_events', '~/transition_event'}
    published = offered(
        node, node.node.get_publisher_names_and_types_by_node, common | documented.keys())
    for name in common:
        del published[name]
    assert published == documented


def test_subscribed_topics(node):
    documented = {row[0]: row[1] for row in table('reference/topics.md', '## Subscribed', 3)}
    subscribed = offered(node, node.node.get_subscriber_names_and_types_by_node, documented)
    # Only where tf2_msgs is installed.
    subscribed.pop('tf_static', None)
    assert subscribed == documented


def test_services(node):
    documented = {row[0]: row[1] for row in table('reference/topics.md', '## Services', 3)}
    services = offered(node, node.node.get_service_names_and_types_by_node, documented)
    own = {
        name: kind for name, kind in services.items()
        if not kind.startswith(('rcl_interfaces', 'lifecycle_msgs'))}
    own.pop('~/get_type_description', None)
    assert own == documented


def test_parameters(node):
    documented = {}
    for group in Group:
        rows = {row[0]: row for row in table('reference/parameters.md', f'## {group.value}', 7)}
        assert list(rows) == [spec.name for spec in specs() if spec.group is group]
        documented.update(rows)
    described = {
        each.name: each for each in node.describe_parameters()
        if not OF_EVERY_NODE.fullmatch(each.name)}
    assert described.keys() == documented.keys()
    for spec in specs():
        name, kind, default, allowed, unit, read_only, what = documented[spec.name]
        assert (kind, default, allowed, unit, what) == (
            spec.type, str(spec.default), spec.allowed, spec.unit, spec.description)
        descriptor = described[name]
        assert descriptor.read_only == (read_only == 'yes')
        assert descriptor.description.startswith(what)
        assert unit in descriptor.description
        assert descriptor.additional_constraints == allowed
        if allowed.count(' to '):
            ranges = [*descriptor.floating_point_range, *descriptor.integer_range]
            assert [ranges[0].from_value, ranges[0].to_value] == [
                float(limit) for limit in allowed.split(' to ')]


def test_distance_states():
    documented = [row[0] for row in table('reference/topics.md', '## Distance states', 2)]
    assert documented == [state.value for state in TravelState]


def test_statuses():
    documented = [row[0] for row in table('reference/topics.md', '## Statuses', 3)]
    assert documented == [status.value for status in PairStatus]
