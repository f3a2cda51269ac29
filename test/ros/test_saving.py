# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Where drives are saved."""

from concurrent.futures import ThreadPoolExecutor

from phase_traj_ros.errors import OutputError
from phase_traj_ros.ros.saving import check_writable, new_folder
import pytest


def test_nodes_that_share_a_folder_do_not_share_their_drives(tmp_path):
    names = ['/front/pt', '/rear/pt', '/rear/pt']
    with ThreadPoolExecutor() as pool:
        made = list(pool.map(lambda name: new_folder(tmp_path, name).name, names * 10))
    assert sorted(made) == sorted([
        *(f'front_pt_{number}' for number in range(1, 11)),
        *(f'rear_pt_{number}' for number in range(1, 21))])


def test_a_later_start_keeps_what_is_there(tmp_path):
    assert new_folder(tmp_path, '/pt').name == 'pt_1'
    (tmp_path / 'pt_2').write_text('no folder, and not ours')
    assert new_folder(tmp_path, '/pt').name == 'pt_3'


def test_a_place_that_cannot_be_written_is_said_before_the_drive(tmp_path):
    (tmp_path / 'file').write_text('')
    with pytest.raises(OutputError, match=r'cannot write to .*file/below: Not a directory'):
        check_writable(tmp_path / 'file' / 'below')


def test_a_disk_that_is_gone_is_an_error_and_not_a_used_number(tmp_path):
    parent = tmp_path / 'mounted'
    parent.symlink_to(tmp_path / 'nowhere')
    with pytest.raises(OutputError, match=r'cannot write to .*mounted: '):
        new_folder(parent, '/pt')
