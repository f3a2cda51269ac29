# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Results are written completely or not at all."""

from phase_traj_ros.errors import OutputError
from phase_traj_ros.io.atomic import output_directory, output_file, writing_to
import pytest


def test_files_appear_when_all_are_written(tmp_path):
    target = tmp_path / 'a' / 'b'
    with output_directory(target) as staging:
        (staging / 'one').write_text('1')
        (staging / 'two').write_text('2')
        assert not (target / 'one').exists()
    assert {path.name: path.read_text() for path in target.iterdir()} == {'one': '1', 'two': '2'}


def test_nothing_is_left_of_a_failure(tmp_path):
    def fail():
        with output_directory(tmp_path / 'a' / 'b') as staging:
            (staging / 'one').write_text('1')
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    assert list(tmp_path.iterdir()) == []


def test_a_failure_leaves_what_was_there(tmp_path):
    (tmp_path / 'one').write_text('old')

    def fail():
        with output_directory(tmp_path) as staging:
            (staging / 'one').write_text('new')
            raise ValueError('stop')

    with pytest.raises(ValueError, match='stop'):
        fail()
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [('one', 'old')]


def test_a_full_disk_is_reported(tmp_path):
    def fail():
        with output_directory(tmp_path / 'a'):
            raise OSError(28, 'No space left on device')

    with pytest.raises(OutputError, match='No space left'):
        fail()
    assert list(tmp_path.iterdir()) == []


def test_one_file(tmp_path):
    target = tmp_path / 'new' / 'picture.png'
    with output_file(target) as path:
        assert path.suffix == '.png'
        path.write_text('x')
    assert [each.name for each in target.parent.iterdir()] == ['picture.png']
    with pytest.raises(OutputError, match='is a directory'), output_file(tmp_path / 'new'):
        pass


def test_a_failure_leaves_what_another_program_has_written_meanwhile(tmp_path):
    def fail():
        with output_directory(tmp_path / 'out' / 'a') as staging:
            (staging / 'one').write_text('1')
            with output_directory(tmp_path / 'out' / 'b') as other:
                (other / 'two').write_text('2')
            raise ValueError('stop')

    with pytest.raises(ValueError, match='stop'):
        fail()
    assert [path.relative_to(tmp_path).as_posix() for path in sorted(tmp_path.rglob('*'))] == [
        'out', 'out/b', 'out/b/two']


def test_two_programs_in_the_same_new_folder(tmp_path):
    def fail():
        with output_directory(tmp_path / 'out'):
            with output_file(tmp_path / 'out' / 'other.gif') as path:
                path.write_text('x')
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    assert [path.name for path in (tmp_path / 'out').iterdir()] == ['other.gif']


def test_obsolete_files_are_removed_with_the_new_results(tmp_path):
    for name in ('report', 'turns', 'mine'):
        (tmp_path / name).write_text('old')

    def write(error=None):
        with output_directory(tmp_path, obsolete=('report', 'turns', 'none')) as staging:
            (staging / 'turns').write_text('new')
            if error is not None:
                raise error

    with pytest.raises(OutputError, match='No space left'):
        write(OSError(28, 'No space left on device'))
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == dict.fromkeys(
        ('report', 'turns', 'mine'), 'old')
    write()
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {
        'turns': 'new', 'mine': 'old'}


def test_the_output_that_cannot_be_written_is_named(tmp_path):
    def fail():
        with (output_directory(tmp_path / 'results'), output_file(tmp_path / 'drive.gif'),
              writing_to(tmp_path / 'results')):
            raise OSError(28, 'No space left on device')

    with pytest.raises(OutputError, match=r'cannot write to \S*results: No space left'):
        fail()
    with (pytest.raises(OutputError, match=r'cannot write to \S*drive\.gif: No space left'),
          output_file(tmp_path / 'drive.gif')):
        raise OSError(28, 'No space left on device')
    assert list(tmp_path.iterdir()) == []
