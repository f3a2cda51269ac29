# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Print the tables of docs/reference/parameters.md from the declarations of the parameters.

Run it with the Python of ``.venv``, and copy its output into the page: a test compares them.
"""

from phase_traj_ros.parameter_spec import Group, Spec
from phase_traj_ros.parameters import specs

HEAD = (
    '| parameter | type | default | allowed | unit | read-only | what |\n'
    '|---|---|---|---|---|---|---|')


def table(group: Group) -> str:
    """Return the section of one group."""
    rows = (_row(spec) for spec in specs() if spec.group is group)
    return '\n'.join((f'## {group.value}', '', HEAD, *rows))


def _row(spec: Spec) -> str:
    read_only = 'yes' if spec.read_only else 'no'
    return (
        f'| `{spec.name}` | {spec.type} | {spec.default} | {spec.allowed} | {spec.unit} |'
        f' {read_only} | {spec.description} |')


if __name__ == '__main__':
    print('\n\n'.join(map(table, Group)))
