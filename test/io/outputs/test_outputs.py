# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""One owner of the outputs of a run: all or nothing, and nothing of anyone else."""

import json
import os
from pathlib import Path
import signal
import subprocess
import sys

from phase_traj_ros.errors import OutputError
from phase_traj_ros.io.outputs import commit
from phase_traj_ros.io.outputs.manifest import Manifest
from phase_traj_ros.io.outputs.outputs import (
    output_directory,
    output_file,
    Outputs,
    remove_abandoned,
    STAGING,
)
import pytest


def put(folder, names, text='new', **options):
    with output_directory(folder, names=names, **options) as staging:
        for name in names:
            (staging / name).write_text(text)


def tree(folder):
    """Return the contents of all files below a folder, but for the manifests."""
    return {
        path.relative_to(folder).as_posix(): path.read_text()
        for path in sorted(folder.rglob('*')) if path.is_file() and path.name != 'manifest.json'}


def listed(folder):
    return set(json.loads((folder / 'manifest.json').read_text())['files'])


def everything(folder):
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob('*'))


def test_files_appear_when_all_are_written(tmp_path):
    target = tmp_path / 'a' / 'b'
    with output_directory(target) as staging:
        (staging / 'one').write_text('1')
        (staging / 'two').write_text('2')
        assert not (target / 'one').exists()
    assert tree(target) == {'one': '1', 'two': '2'}
    assert listed(target) == {'one', 'two'}


KILLED = """
import os, signal, sys
from pathlib import Path
from phase_traj_ros.io.outputs.outputs import Outputs
with Outputs() as outputs:
    outputs.directory(Path(sys.argv[1]))
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_the_next_run_removes_what_a_killed_one_left(tmp_path):
    with Outputs() as living:
        kept = living.directory(tmp_path).parent
        subprocess.run([sys.executable, '-c', KILLED, str(tmp_path)], check=False)
        (left,) = set(tmp_path.iterdir()) - {kept}
        begun = tmp_path / f'{STAGING}begun'  # Not locked yet.
        begun.mkdir()
        put(tmp_path, ['one'])
        assert kept.exists() and begun.exists() and not left.exists()


def test_what_a_killed_process_of_a_batch_left_is_removed(tmp_path):
    with Outputs() as living:
        kept = living.directory(tmp_path).parent
        subprocess.run([sys.executable, '-c', KILLED, str(tmp_path)], check=False)
        remove_abandoned(tmp_path)
        assert list(tmp_path.iterdir()) == [kept]


@pytest.mark.parametrize('error', [KeyboardInterrupt, ValueError, SystemExit, BrokenPipeError])
def test_nothing_is_left_of_a_failure(tmp_path, error):
    def fail():
        with Outputs() as outputs:
            (outputs.directory(tmp_path / 'a' / 'b') / 'one').write_text('1')
            outputs.file(tmp_path / 'c' / 'd.gif').write_text('2')
            raise error

    with pytest.raises(error):
        fail()
    assert list(tmp_path.iterdir()) == []


def test_a_failure_leaves_what_was_there(tmp_path):
    put(tmp_path, ['one'], 'old')
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}

    def fail():
        with output_directory(tmp_path) as staging:
            (staging / 'one').write_text('new')
            raise ValueError('stop')

    with pytest.raises(ValueError, match='stop'):
        fail()
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_a_full_disk_is_reported(tmp_path):
    def fail():
        with output_directory(tmp_path / 'a'):
            raise OSError(28, 'No space left on device')

    with pytest.raises(OutputError, match='No space left'):
        fail()
    assert list(tmp_path.iterdir()) == []


def test_one_file(tmp_path):
    target = tmp_path / 'new' / 'picture.png'
    for text in 'xy':
        with output_file(target) as path:
            assert path.suffix == '.png'
            path.write_text(text)
    assert [each.name for each in target.parent.iterdir()] == ['picture.png']
    assert target.read_text() == 'y'
    with pytest.raises(OutputError, match='is a directory'), output_file(tmp_path / 'new'):
        pass


def test_a_failure_leaves_what_another_program_has_written_meanwhile(tmp_path):
    def fail():
        with output_directory(tmp_path / 'out' / 'a') as staging:
            (staging / 'one').write_text('1')
            put(tmp_path / 'out' / 'b', ['two'])
            raise ValueError('stop')

    with pytest.raises(ValueError, match='stop'):
        fail()
    assert everything(tmp_path) == ['out', 'out/b', 'out/b/manifest.json', 'out/b/two']


def test_two_programs_in_the_same_new_folder(tmp_path):
    def fail():
        with output_directory(tmp_path / 'out'):
            with output_file(tmp_path / 'out' / 'other.gif') as path:
                path.write_text('x')
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    assert [path.name for path in (tmp_path / 'out').iterdir()] == ['other.gif']


# Row 1: an output is an input, under whatever name, or lies in one.

@pytest.mark.parametrize('name', ['y.mcap', './y.mcap', 'link.mcap', 'twin.mcap', 'way/y.mcap'])
def test_no_output_is_an_input(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    Path('y.mcap').write_text('recording')
    Path('link.mcap').symlink_to('y.mcap')
    os.link('y.mcap', 'twin.mcap')
    Path('way').symlink_to(tmp_path)
    before = everything(tmp_path)
    with pytest.raises(OutputError, match='is an input'), output_file(
            Path(name), inputs=[Path('y.mcap')]):
        pass
    assert everything(tmp_path) == before and Path('y.mcap').read_text() == 'recording'


@pytest.mark.parametrize('inside', ['', 'results', 'a/b/c', '../drive', '../other/x', '../real'])
def test_no_output_lies_in_an_input(tmp_path, inside):
    drive = tmp_path / 'drive'
    drive.mkdir()
    (tmp_path / 'real').mkdir()
    (drive / 'image_0').symlink_to(tmp_path / 'real')
    (tmp_path / 'other').symlink_to(drive)
    before = everything(tmp_path)
    with pytest.raises(OutputError, match='input'), output_directory(
            drive / inside, inputs=[drive]):
        pass
    with pytest.raises(OutputError, match='lies in the input'), output_file(
            drive / inside / 'x.gif', inputs=[drive]):
        pass
    assert everything(tmp_path) == before
    put(tmp_path / 'drive results', ['one'], inputs=[drive])


def test_an_input_in_the_output_folder_is_neither_replaced_nor_removed(tmp_path):
    put(tmp_path, ['camera.yaml', 'chain_code.json'])
    camera = tmp_path / 'camera.yaml'
    with pytest.raises(OutputError, match=r'camera\.yaml is an input'):
        put(tmp_path, ['camera.yaml'], inputs=[camera])
    put(tmp_path, ['trajectory.png'], inputs=[camera])
    assert set(tree(tmp_path)) == {'camera.yaml', 'trajectory.png'}


# Row 2: links are followed, and devices are left alone.

def test_a_link_is_followed_and_stays(tmp_path):
    (tmp_path / 'real').mkdir()
    (tmp_path / 'link').symlink_to('real')
    (tmp_path / 'drive.gif').symlink_to('real/other.gif')
    put(tmp_path / 'link', ['one'])
    for text in 'xy':
        with output_file(tmp_path / 'drive.gif') as path:
            path.write_text(text)
    assert (tmp_path / 'drive.gif').is_symlink() and (tmp_path / 'link').is_symlink()
    assert tree(tmp_path / 'real') == {'one': 'new', 'other.gif': 'y'}


@pytest.mark.parametrize('kind', ['device', 'pipe'])
def test_what_is_no_file_is_refused(tmp_path, kind):
    target = tmp_path / 'null.gif'
    if kind == 'device':
        target.symlink_to('/dev/null')
    else:
        os.mkfifo(target)
    with pytest.raises(OutputError, match='a device or a pipe'), output_file(target):
        pass
    assert everything(tmp_path) == ['null.gif'] and not target.is_file()


# Row 3: only what an earlier run wrote is replaced or removed.

def test_what_is_not_ours_is_neither_replaced_nor_removed(tmp_path):
    (tmp_path / 'report.html').write_text('mine')
    (tmp_path / 'trajectory.png').write_text('mine')
    with pytest.raises(OutputError, match=r'trajectory\.png was not written by an earlier run'):
        put(tmp_path, ['chain_code.json', 'trajectory.png'])
    assert tree(tmp_path) == {'report.html': 'mine', 'trajectory.png': 'mine'}
    put(tmp_path, ['chain_code.json'])
    put(tmp_path, ['chain_code.json', 'shifts.csv'], 'newer')
    put(tmp_path, ['chain_code.json'])
    assert tree(tmp_path) == {
        'report.html': 'mine', 'trajectory.png': 'mine', 'chain_code.json': 'new'}
    put(tmp_path, ['trajectory.png'], force=True)
    assert tree(tmp_path) == {'report.html': 'mine', 'trajectory.png': 'new'}


def test_the_refusal_comes_before_the_work(tmp_path):
    (tmp_path / 'report.html').write_text('mine')
    with Outputs() as outputs, pytest.raises(OutputError):
        outputs.directory(tmp_path, names=['report.html'])


def test_a_result_that_was_changed_since_is_not_ours(tmp_path):
    put(tmp_path, ['camera.yaml', 'chain_code.json'])
    (tmp_path / 'camera.yaml').write_text('new'[::-1])
    put(tmp_path, ['chain_code.json'])
    assert tree(tmp_path) == {'camera.yaml': 'wen', 'chain_code.json': 'new'}
    with pytest.raises(OutputError, match='was changed since'):
        put(tmp_path, ['camera.yaml'])


def test_a_file_that_appears_during_the_work_is_not_replaced(tmp_path):
    def late():
        with output_directory(tmp_path) as staging:
            (staging / 'one').write_text('new')
            (staging / 'two').write_text('new')
            (tmp_path / 'two').write_text('mine')

    with pytest.raises(OutputError, match=r'two was not written'):
        late()
    assert everything(tmp_path) == ['two']


@pytest.mark.parametrize('content', ['{"name": "my app"}', 'not JSON', '[1]', ''])
def test_a_manifest_of_someone_else(tmp_path, content):
    (tmp_path / 'manifest.json').write_text(content)
    with pytest.raises(OutputError, match=r'manifest\.json was not written'):
        put(tmp_path, ['one'])
    assert (tmp_path / 'manifest.json').read_text() == content


def test_what_adds_to_results_leaves_them_and_they_replace_it(tmp_path):
    (tmp_path / 'notes.txt').write_text('mine')
    put(tmp_path, ['chain_code.json', 'shifts.csv'])
    put(tmp_path, ['evaluation.json'], adds=True)
    assert set(tree(tmp_path)) == {
        'chain_code.json', 'shifts.csv', 'evaluation.json', 'notes.txt'}
    put(tmp_path, ['chain_code.json'])
    assert set(tree(tmp_path)) == {'chain_code.json', 'notes.txt'}


def test_a_named_file_in_the_output_folder_belongs_to_the_results(tmp_path):
    with Outputs() as outputs:
        (outputs.directory(tmp_path, names=['one']) / 'one').write_text('1')
        outputs.file(tmp_path / 'codes.mcap').write_text('2')
    assert listed(tmp_path) == {'one', 'codes.mcap'}
    put(tmp_path, ['one'])
    assert tree(tmp_path) == {'one': 'new'}


def test_a_folder_among_the_results(tmp_path):
    def write(text):
        with output_directory(tmp_path / 'out', names=['bag']) as staging:
            (staging / 'bag').mkdir()
            (staging / 'bag' / text).write_text(text)

    write('a')
    write('b')
    assert tree(tmp_path / 'out') == {'bag/b': 'b'}
    (tmp_path / 'out' / 'bag' / 'notes').write_text('mine')
    with pytest.raises(OutputError, match='bag is a folder that no earlier run wrote'):
        write('c')
    assert tree(tmp_path / 'out') == {'bag/b': 'b', 'bag/notes': 'mine'}


# Row 5: all or nothing.

@pytest.mark.parametrize('force', [False, True])
def test_a_folder_in_the_way_is_refused_before_the_work(tmp_path, force):
    (tmp_path / 'trajectory.png').mkdir()
    (tmp_path / 'chain_code.json').write_text('mine')
    with pytest.raises(OutputError):
        put(tmp_path, ['trajectory.png'], force=force)
    assert everything(tmp_path) == ['chain_code.json', 'trajectory.png']


@pytest.mark.parametrize('links', [True, False])
@pytest.mark.parametrize('failing', range(5))
def test_a_set_is_moved_whole_or_not_at_all(tmp_path, monkeypatch, failing, links):
    out = tmp_path / 'out'
    put(out, ['a', 'b', 'stale'], 'old')
    (tmp_path / 'drive.gif').write_text('old')
    before = {path: path.read_bytes() for path in tmp_path.rglob('*') if path.is_file()}
    replace, moved = Path.replace, []

    def failing_replace(path, target):
        if len(moved) == failing and path.parent.name == 'made':
            raise OSError(28, 'No space left on device')
        if path.parent.name == 'made':
            moved.append(target)
        return replace(path, target)

    monkeypatch.setattr(Path, 'replace', failing_replace)
    if not links:
        monkeypatch.setattr(commit, '_linked', lambda *_: False)

    def write():
        with Outputs() as outputs:
            staging = outputs.directory(out)
            for name in 'abc':
                (staging / name).write_text('new')
            outputs.file(tmp_path / 'drive.gif').write_text('new')

    if failing < 4:
        with pytest.raises(OutputError, match='No space left'):
            write()
        assert {path: path.read_bytes() for path in tmp_path.rglob('*') if path.is_file()} == (
            before)
    else:
        write()
        assert tree(tmp_path) == dict.fromkeys(
            ('drive.gif', 'out/a', 'out/b', 'out/c'), 'new')
    assert not list(tmp_path.rglob('.*'))


@pytest.mark.parametrize('number', commit.STOPPING)
def test_a_signal_in_the_commit_waits_for_its_end(tmp_path, monkeypatch, number):
    carry_out = commit._carry_out
    signal.signal(number, lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))

    def interrupted(*arguments):
        signal.raise_signal(number)
        carry_out(*arguments)

    monkeypatch.setattr(commit, '_carry_out', interrupted)
    try:
        with pytest.raises(KeyboardInterrupt):
            put(tmp_path, ['one', 'two'])
    finally:
        signal.signal(
            number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)
    assert tree(tmp_path) == {'one': 'new', 'two': 'new'}
    assert not list(tmp_path.glob('.*'))


def test_a_manifest_says_who_wrote_it(tmp_path):
    put(tmp_path, ['one'])
    content = json.loads((tmp_path / 'manifest.json').read_text())
    assert content['program'] == 'phase_traj_ros' and set(content['files']) == {'one'}
    assert Manifest.of(tmp_path).owns('one') and Manifest.of(tmp_path).owns('manifest.json')
