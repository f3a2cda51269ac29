# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The parameter file of the node, read without ROS."""

from dataclasses import replace
from pathlib import Path

from phase_traj_ros.core import EstimatorSettings
from phase_traj_ros.errors import ParameterError
from phase_traj_ros.io.params_file import find_params_file, parse_assignment, read_parameters
from phase_traj_ros.parameter_spec import REMOVED
from phase_traj_ros.parameters import Parameters, specs
import pytest

CONFIG = Path(__file__).resolve().parents[2] / 'config'


@pytest.fixture
def file(tmp_path):
    """Return a function that writes a parameter file."""
    def write(text):
        path = tmp_path / 'params.yaml'
        path.write_text(text)
        return path
    return write


def test_paper_yaml_is_the_papers_rule():
    parameters = read_parameters(CONFIG / 'paper.yaml')
    assert parameters == Parameters(code_source='shift', threshold=16.0)
    assert parameters.settings == replace(
        EstimatorSettings(), max_runs=100_000, max_speeds=10_000, max_corners=999)


@pytest.mark.parametrize(('values', 'codes_from', 'drawn_from'), [
    ({}, 'auto', 'heading'),
    ({'threshold': 9.0}, 'shift', 'codes'),
    ({'code_source': 'shift'}, 'shift', 'codes'),
    ({'code_source': 'heading', 'threshold': 9.0}, 'heading', 'codes'),
    ({'path_from': 'codes'}, 'auto', 'codes'),
    ({'threshold': 9.0, 'path_from': 'heading'}, 'shift', 'heading'),
])
def test_a_threshold_asks_for_the_papers_rule(values, codes_from, drawn_from):
    settings = Parameters(**values).settings
    assert (settings.code_source.value, settings.drawn_from.value) == (codes_from, drawn_from)


@pytest.mark.parametrize(
    'node', ['/**', 'phase_traj', '/phase_traj', '/front/phase_traj', '/**/phase_traj'])
@pytest.mark.parametrize('number', ['20.0', '2e1', '2.e+1', '.2E2'])
def test_matching_sections(file, node, number):
    path = file(f'{node}:\n  ros__parameters:\n    threshold: {number}\n')
    assert read_parameters(path).threshold == 20.0


def test_namespaces_may_be_nested(file):
    path = file('front:\n  phase_traj:\n    ros__parameters:\n      threshold: 20.0\n')
    assert read_parameters(path).threshold == 20.0


def test_later_sections_win_and_other_nodes_do_not_count(file):
    path = file("""
/**:
  ros__parameters: {threshold: 20.0, frame_id: map, use_sim_time: true, autostart: false}
phase_traj:
  ros__parameters:
    threshold: 30.0
    qos_overrides:
      /image:
        subscription: {reliability: reliable}
camera:
  ros__parameters: {threshold: 99.0, exposure: 3}
""")
    parameters = read_parameters(path)
    assert (parameters.threshold, parameters.frame_id) == (30.0, 'map')


@pytest.mark.parametrize(('text', 'message'), [
    ('', 'not a ROS parameter file'),
    ('just text', 'not a ROS parameter file'),
    ('threshold: 20.0', 'not a ROS parameter file'),
    ('a: [', 'is not YAML'),
    ('/**:\n  ros__parameters: {threshold: 2026-11-28}', 'give a double'),
    ('&all\n/**: *all\n', 'an alias'),
    ('[' * 5000, 'maximum recursion'),
    ('camera:\n  ros__parameters: {exposure: 3}', 'for /camera, not for phase_traj: put'),
    ('/**:\n  ros__parameters: 3', 'holds no parameters'),
    ('/**:\n  ros_parameters: {threshold: 3.0}', "write 'ros__parameters', with two"),
    ('/**:\n  ros__parameters: {treshold: 3.0}', "did you mean 'threshold'"),
    ('/**:\n  ros__parameters: {threshold: 3}', 'such as 3.0'),
    ('/**:\n  ros__parameters: {threshold: -3.0}', '0 to 10000'),
    ('/**:\n  ros__parameters: {threshold: .nan}', '0 to 10000'),
    ('/**:\n  ros__parameters: {shift: {decimation: 0}}', '1 to 16'),
    ('/**:\n  ros__parameters: {shift.decimation: true}', 'give an integer'),
    ('/**:\n  ros__parameters: {frame_id: [a]}', 'string'),
])
def test_errors_are_reported_in_one_line(file, text, message):
    with pytest.raises(ParameterError, match=message) as caught:
        read_parameters(file(text))
    assert '\n' not in str(caught.value)
    assert str(caught.value).count('params.yaml') == 1


def test_a_file_that_cannot_be_read(tmp_path):
    with pytest.raises(ParameterError, match='No such file'):
        read_parameters(tmp_path / 'none.yaml')
    (tmp_path / 'binary.yaml').write_bytes(b'\xff\xfb\x00\x80')
    with pytest.raises(ParameterError, match='is not YAML'):
        read_parameters(tmp_path / 'binary.yaml')


def test_a_file_is_found_by_its_path_and_else_by_its_name_in_config(
        tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('HOME', str(tmp_path / 'home'))
    assert find_params_file('vehicle.yaml') == CONFIG / 'vehicle.yaml'
    for path in (tmp_path / 'vehicle.yaml', tmp_path / 'home' / 'own.yaml'):
        path.parent.mkdir(exist_ok=True)
        path.touch()
    assert find_params_file('vehicle.yaml').resolve() == tmp_path / 'vehicle.yaml'
    assert find_params_file('~/own.yaml') == tmp_path / 'home' / 'own.yaml'
    with pytest.raises(ParameterError, match=r'own: heading\.yaml, paper\.yaml, vehicle\.yaml$'):
        find_params_file('none.yaml')
    with pytest.raises(ParameterError, match='there is no parameter file'):
        find_params_file('x' * 300)


@pytest.mark.parametrize('name', ['paper', 'vehicle', 'heading'])
def test_files_that_come_with_the_package_can_be_read(name):
    read_parameters(CONFIG / f'{name}.yaml')


@pytest.mark.parametrize(('text', 'expected'), [
    ('a:=1', ('a', 1)), ('a:=1.5', ('a', 1.5)), ('a:=true', ('a', True)), ('a:=b', ('a', 'b')),
    ('a:=-.5', ('a', -0.5)), ('a:=+2e1', ('a', 20.0)), ('a:=', ('a', '')),
    ("a:='1'", ('a', '1')), ('a:=b:=c', ('a', 'b:=c')), ('a:=1e1', ('a', 10.0)),
    ('a:=.inf', ('a', float('inf'))), ('a:=010', ('a', 8)), ('a:=08', ('a', 8.0)),
    ('a:=0x1F', ('a', 31)), ('a:=y', ('a', True)), ('a:=Off', ('a', False)),
    # Of other readers of YAML: base 60, a date, a separator, base 2, a merge.
    ('a:=12:30.0', ('a', '12:30.0')), ('a:=2026-11-28', ('a', '2026-11-28')),
    ('a:=2026-13-45', ('a', '2026-13-45')), ('a:=1_0.0', ('a', '1_0.0')),
    ('a:=1_000', ('a', '1_000')), ('a:=0b11', ('a', '0b11')),
    ('a:={<<: {b: 1}}', ('a', {'<<': {'b': 1}}))])
def test_assignments_are_those_of_ros(text, expected):
    assert parse_assignment(text) == expected


@pytest.mark.parametrize('text', ['', 'a', 'a=1', ':=1', 'a:=[1'])
def test_invalid_assignments(text):
    with pytest.raises(ParameterError, match='NAME:=VALUE'):
        parse_assignment(text)


@pytest.mark.timeout(20)
def test_aliases_are_refused(tmp_path):
    # Nine levels of nine are 387 million values.
    levels = ['a0: &a0 [x, x, x, x, x, x, x, x, x]']
    levels += [
        f'a{level}: &a{level} {{{", ".join(f"{key}: *a{level - 1}" for key in "ijklmnopq")}}}'
        for level in range(1, 9)]
    path = tmp_path / 'bomb.yaml'
    path.write_text('/**:\n  ros__parameters:\n' + ''.join(f'    {line}\n' for line in levels))
    with pytest.raises(ParameterError, match='alias'):
        read_parameters(path)
    with pytest.raises(ParameterError, match='does not assign'):
        parse_assignment('threshold:=[&a 1, *a]')


def test_a_file_beyond_all_bounds_is_refused(tmp_path):
    path = tmp_path / 'long.yaml'
    with path.open('wb') as file:
        file.truncate(1 << 30)
    with pytest.raises(ParameterError, match='is not YAML: unacceptable character'):
        read_parameters(path)


def test_a_removed_parameter_says_what_to_do_instead(file):
    for name, advice in REMOVED.items():
        path = file(f'/**:\n  ros__parameters: {{{name}: 1}}\n')
        with pytest.raises(ParameterError) as caught:
            read_parameters(path)
        assert str(caught.value) == f'{path}: the parameter {name!r} was removed: {advice}'
    assert not set(REMOVED) & {spec.name for spec in specs()}


def test_the_papers_rule_has_its_own_group(file):
    path = file('/**:\n  ros__parameters: {shift: {decimation: 2, confirm_frames: 3}}\n')
    unused = read_parameters(path)
    assert unused.notices == (
        'no effect with code_source auto: shift.decimation, shift.confirm_frames (of'
        " the paper's rule, code_source shift)",)
    assert unused.settings == Parameters().settings
    used = unused.with_values({'threshold': 16.0})
    assert used.notices == ()
    settings = used.settings
    assert (settings.view.decimation, settings.confirm_frames) == (2, 3)
