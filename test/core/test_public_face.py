# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The public names of phase_traj_ros.core are sufficient to use it."""

from dataclasses import fields, is_dataclass
from typing import get_args, get_type_hints

from phase_traj_ros import core
import pytest


def classes_in(annotation):
    """Yield the classes of this package that an annotation names."""
    for part in get_args(annotation):
        yield from classes_in(part)
    if isinstance(annotation, type) and annotation.__module__.startswith('phase_traj_ros'):
        yield annotation


def needed_for(kind, found):
    """Collect the classes of a dataclass's fields, and those of their fields."""
    hints = get_type_hints(kind)
    for field in fields(kind):
        for each in classes_in(hints[field.name]):
            if each not in found:
                found.add(each)
                if is_dataclass(each):
                    needed_for(each, found)
    return found


@pytest.mark.parametrize('name', ['EstimatorSettings', 'Update', 'Lens'])
def test_whatever_settings_and_results_are_made_of_is_handed_out(name):
    needed = {each.__name__ for each in needed_for(getattr(core, name), set())}
    assert needed
    assert sorted(needed - set(core.__all__)) == []


def test_all_names_all_that_is_public():
    public = {
        name for name, value in vars(core).items()
        if not name.startswith('_') and getattr(value, '__module__', '').startswith(
            'phase_traj_ros.core')}
    assert public - set(core.__all__) == set()
    assert all(hasattr(core, name) for name in core.__all__)
    assert core.__all__ == sorted(core.__all__, key=lambda name: (name[0].islower(), name))
