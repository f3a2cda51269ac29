# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Folders of pictures: order, stamps, bit depth and errors."""

import cv2
from hypothesis import given, strategies as st
import numpy as np
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.errors import SourceError
from phase_traj_ros.io import open_source, Selection
from phase_traj_ros.io.images.decoding import PICTURE_SUFFIXES
from phase_traj_ros.io.outputs.outputs import output_directory
from phase_traj_ros.io.sources.folder import natural_key
from phase_traj_ros.io.sources.times_file import read_times
import pytest

TENTH = 100_000_000


def fill(folder, names, shape=(5, 7)):
    """Write pictures of those names, whose grey value is their place in the list."""
    folder.mkdir(parents=True, exist_ok=True)
    for value, name in enumerate(names):
        # Written under a name in lower case, which OpenCV requires.
        suffix = name[name.rindex('.'):].lower()
        channels = (3,) if suffix == '.ppm' else ()
        done, data = cv2.imencode(suffix, np.full((*shape, *channels), 3 * value, np.uint8))
        assert done
        (folder / name).write_bytes(data.tobytes())
    return folder


def read(folder, **options):
    """Return the stamps, and the positions in the list given to fill."""
    with open_source(folder, **options) as source:
        frames = list(source)
    # JPEG and WebP are off by a little.
    return [frame.stamp_ns for frame in frames], [
        round(frame.image.mean() / 3) for frame in frames]


def test_natural_order(tmp_path):
    names = ['1.png', '2.png', '10.png', 'A1b2.png', 'a1B10.png', 'a02.png']
    folder = fill(tmp_path / 'x', names)
    stamps, order = read(folder)
    assert order == list(range(6))
    assert stamps == [index * TENTH for index in range(6)]


@given(st.lists(st.text(st.sampled_from('aB019_.²'), min_size=1, max_size=8)))
def test_natural_key_orders_any_names(names):
    ordered = sorted(names, key=natural_key)
    assert sorted(names, key=natural_key, reverse=True) == ordered[::-1]
    numbers = [name for name in ordered if name.isascii() and name.isdigit()]
    assert [int(name) for name in numbers] == sorted(int(name) for name in numbers)


def test_all_kinds_of_pictures_and_nothing_else(tmp_path):
    names = [f'{index}{kind.upper() if index % 2 else kind}'
             for index, kind in enumerate(PICTURE_SUFFIXES)]
    folder = fill(tmp_path / 'x', names)
    (folder / 'notes.txt').write_text('hello')
    (folder / '.5.png').write_text('what an editor leaves')
    (folder / 'folder.png').mkdir()
    assert read(folder)[1] == list(range(len(names)))


def test_16_bits_are_kept(tmp_path):
    image = np.arange(35, dtype=np.uint16).reshape(5, 7) * 1000
    cv2.imwrite(str(tmp_path / '0.png'), image)
    cv2.imwrite(str(tmp_path / '1.tif'), image)
    with open_source(tmp_path) as source:
        frames = list(source)
    assert len(frames) == 2
    for frame in frames:
        np.testing.assert_array_equal(frame.image, image)
        assert frame.image.dtype == np.uint16


def test_colour_becomes_grey(tmp_path, picture):
    cv2.imwrite(str(tmp_path / '0.png'), picture())
    with open_source(tmp_path) as source:
        (frame,) = source
    grey = cv2.cvtColor(picture(), cv2.COLOR_BGR2GRAY)
    assert np.abs(frame.image.astype(int) - grey).max() <= 1


def test_rate(tmp_path):
    folder = fill(tmp_path / 'x', ['0.png', '1.png', '2.png', '3.png'])
    assert read(folder)[0] == [0, TENTH, 2 * TENTH, 3 * TENTH]
    assert read(folder, fps=3)[0] == [0, 333_333_333, 666_666_667, 1_000_000_000]
    with open_source(folder) as source:
        assert '10 frames per second assumed' in source.description
    with open_source(folder, fps=3) as source:
        assert '3 frames per second' in source.description
        assert 'assumed' not in source.description


@pytest.mark.parametrize('place', ['.', '..'])
def test_times_line_by_line(tmp_path, place):
    folder = fill(tmp_path / 'x', ['a.png', 'b.png', 'c.png'])
    # In KITTI's format and others; exact where a float would not be.
    (folder / place / 'times.txt').write_text(
        '0.000000e+00\n 1.036224e-01 \n1700000000.123456789\n\n')
    assert read(folder)[0] == [0, 103_622_400, 1_700_000_000_123_456_789]
    assert read(folder, fps=10)[0] == [0, TENTH, 2 * TENTH]
    with open_source(folder) as source:
        assert 'times.txt' in source.description


def test_nearer_times_win(tmp_path):
    folder = fill(tmp_path / 'x', ['0.png', '1.png'])
    (tmp_path / 'times.txt').write_text('5\n6\n7\n')
    (folder / 'times.txt').write_text('1\n2\n')
    assert read(folder)[0] == [10 ** 9, 2 * 10 ** 9]


def test_times_beside_the_working_directory(tmp_path, monkeypatch):
    folder = fill(tmp_path / 'x', ['0.png', '1.png'])
    (tmp_path / 'times.txt').write_text('1\n2\n')
    monkeypatch.chdir(folder)
    assert read('.')[0] == [10 ** 9, 2 * 10 ** 9]


def test_files_beside_a_link_come_before_those_beside_its_target(tmp_path):
    folder = fill(tmp_path / 'there' / 'image_0', ['0.png', '1.png'])
    mine = tmp_path / 'mine'
    mine.mkdir()
    (mine / 'image_0').symlink_to(folder)
    (folder.parent / 'times.txt').write_text('1\n2\n')
    (folder.parent / 'calib.txt').write_text(KITTI_CALIBRATION)
    for path in (mine, mine / 'image_0'):
        assert read(path)[0] == [10 ** 9, 2 * 10 ** 9]
        assert open_source(path).camera(rectified=True).fx == 7.0
    (mine / 'times.txt').write_text('3\n4\n')
    (mine / 'calib.txt').write_text(KITTI_CALIBRATION.replace('7.0e+00', '9.0e+00'))
    for path in (mine, mine / 'image_0'):
        assert read(path)[0] == [3 * 10 ** 9, 4 * 10 ** 9]
        assert open_source(path).camera(rectified=True).fx == 9.0


def test_a_link_to_nothing_is_a_frame_that_cannot_be_read(tmp_path):
    folder = fill(tmp_path / 'x', ['0.png', '2.png'])
    (folder / '1.png').symlink_to(tmp_path / 'removed')
    assert [type(entry).__name__ for entry in open_source(folder).entries()] == [
        'StampedFrame', 'UnreadableFrame', 'StampedFrame']
    sequence = fill(tmp_path / 'y' / 'image_0', ['0.png', '1.png']).parent
    (sequence / 'cover.png').symlink_to(tmp_path / 'removed')
    assert len(read(sequence)[0]) == 2


def test_a_link_with_the_name_of_a_camera_has_its_calibration(tmp_path):
    folder = fill(tmp_path / 'left', ['0.png', '1.png'])
    (tmp_path / 'image_1').symlink_to(folder)
    (tmp_path / 'calib.txt').write_text(KITTI_CALIBRATION)
    assert open_source(tmp_path / 'image_1').camera(rectified=True).fx == 8.0
    assert open_source(folder).camera(rectified=True) is None


def test_times_by_number(tmp_path):
    """A clip cut out of a sequence, with the times of the whole sequence."""
    folder = fill(tmp_path / 'x', ['000002.png', '000003.png', '000005.png'])
    (tmp_path / 'times.txt').write_text(''.join(f'{index}.5\n' for index in range(9)))
    assert read(folder)[0] == [2_500_000_000, 3_500_000_000, 5_500_000_000]


@pytest.mark.parametrize(('names', 'lines'), [
    (['000002.png', '000003.png', '000005.png'], 5),
    (['a.png', 'b.png'], 3),
    (['1.png', 'b.png'], 3),
    (['1.png', '2.png'], 1),
    (['1.png', '2.png'], 0),
    (['-1.png', '2.png'], 5),
])
def test_times_that_do_not_fit(tmp_path, names, lines):
    folder = fill(tmp_path / 'x', names)
    (tmp_path / 'times.txt').write_text('1.0\n' * lines)
    with pytest.raises(SourceError, match=f'{lines} lines for {len(names)} images.*fps'):
        open_source(folder)
    assert len(read(folder, fps=5)[0]) == len(names)


@pytest.mark.parametrize('line', [
    'hello', 'nan', 'inf', '-inf', '1e999999999', '1e-', '1,5', '', '9' * 40, 'sNaN',
    '1e99999999999999999999999'])
def test_invalid_times(tmp_path, line):
    path = tmp_path / 'times.txt'
    path.write_text(f'1.0\n{line}\n2.0\n')
    with pytest.raises(SourceError, match=r'line 2: .* is not a time in seconds'):
        read_times(path)


def test_times_with_a_byte_order_mark(tmp_path):
    path = tmp_path / 'times.txt'
    path.write_text('1.0\n2.0\n', encoding='utf-8-sig')
    assert read_times(path) == [10**9, 2 * 10**9]


def test_times_in_a_binary_file(tmp_path):
    path = tmp_path / 'times.txt'
    path.write_bytes(b'\xff\xfe\x00')
    with pytest.raises(SourceError, match='cannot be read'):
        read_times(path)


@given(st.lists(st.integers(-10 ** 15, 9 * 10 ** 18), min_size=1))
def test_times_are_exact(tmp_path_factory, stamps):
    path = tmp_path_factory.mktemp('times') / 'times.txt'
    path.write_text('\n'.join(
        f'{"-" if stamp < 0 else ""}{abs(stamp) // 10 ** 9}.{abs(stamp) % 10 ** 9:09}'
        for stamp in stamps))
    assert read_times(path) == stamps


@pytest.mark.parametrize(('cameras', 'expected'), [
    (['image_0', 'image_1', 'image_2'], 'image_0'),
    (['image_1', 'image_2', 'image_3'], 'image_2'),
    (['image_1', 'image_3'], 'image_1'),
    (['image_3'], 'image_3'),
])
def test_kitti_sequence(tmp_path, cameras, expected):
    for camera in cameras:
        fill(tmp_path / camera, ['000000.png', '000001.png'])
    (tmp_path / 'times.txt').write_text('0.5\n1.5\n')
    with open_source(tmp_path) as source:
        assert expected in source.description
        assert [frame.stamp_ns for frame in source] == [500_000_000, 1_500_000_000]


def test_own_pictures_come_before_those_of_kitti(tmp_path):
    fill(tmp_path / 'image_0', ['0.png', '1.png'])
    fill(tmp_path, ['5.png'])
    assert len(read(tmp_path)[0]) == 1


def test_empty_kitti_camera_is_passed_over(tmp_path):
    (tmp_path / 'image_0').mkdir()
    fill(tmp_path / 'image_2', ['0.png', '1.png'])
    assert len(read(tmp_path)[0]) == 2


KITTI_CALIBRATION = """\
P0: 7.0e+00 0.0 3.5 0.0 0.0 7.5 2.5 0.0 0.0 0.0 1.0 0.0
P1: 8.0 0.0 3.5 -4.0 0.0 8.5 2.5 0.0 0.0 0.0 1.0 0.0
P2: 9.0 0.0 3.25 0.5 0.0 9.5 2.25 0.1 0.0 0.0 1.0 0.01
P3: 10.0 0.0 3.5 0.0 0.0 10.5 2.5 0.0 0.0 0.0 1.0 0.0
Tr: 0.0 -1.0 0.0 0.0 0.0 0.0 -1.0 -0.1 1.0 0.0 0.0 -0.3
"""


@pytest.mark.parametrize(('camera', 'fx', 'cx'), [
    ('image_0', 7.0, 3.5), ('image_1', 8.0, 3.5), ('image_2', 9.0, 3.25), ('image_3', 10.0, 3.5)])
@pytest.mark.parametrize('rectified', [False, True])
def test_kitti_calibration(tmp_path, monkeypatch, camera, fx, cx, rectified):
    folder = fill(tmp_path / camera, ['000000.png', '000001.png'])
    (tmp_path / 'calib.txt').write_text(KITTI_CALIBRATION)
    expected = CameraModel(width=7, height=5, fx=fx, fy=fx + 0.5, cx=cx, cy=cx - 1.0)
    monkeypatch.chdir(folder)
    for path in (tmp_path, folder, '.'):
        with open_source(path) as source:
            assert source.camera(rectified=rectified) == expected


def test_kitti_calibration_beside_a_first_picture_that_is_broken(tmp_path):
    folder = fill(tmp_path / 'image_0', ['000000.png', '000001.png'])
    (tmp_path / 'calib.txt').write_text(KITTI_CALIBRATION)
    (folder / '000000.png').write_bytes(b'')
    with open_source(tmp_path) as source:
        assert source.camera(rectified=True).fx == 7.0
    (folder / '000001.png').write_bytes(b'')
    with open_source(tmp_path) as source, pytest.raises(SourceError, match='none of the pict'):
        source.camera(rectified=True)


def test_folders_without_a_calibration(tmp_path):
    fill(tmp_path / 'image_0', ['0.png'])
    with open_source(tmp_path) as source:
        assert source.camera(rectified=False) is None
    # It applies to the cameras of KITTI only.
    fill(tmp_path / 'mine', ['0.png'])
    (tmp_path / 'calib.txt').write_text(KITTI_CALIBRATION)
    with open_source(tmp_path / 'mine') as source:
        assert source.camera(rectified=True) is None


@pytest.mark.parametrize(('content', 'message'), [
    (b'', "there is no line 'P0'; correct it, or give focal_px"),
    (b'P1: 1 2 3', "no line 'P0'"),
    (b'P0: 1 2 3', 'the line has 3 numbers, not 12'),
    (b'P0: 7 0 x 0 0 7 2 0 0 0 1 0', "could not convert string to float: 'x'"),
    (b'P0: -7 0 3 0 0 7 2 0 0 0 1 0', 'fx is -7.0: give a number of pixels'),
    (b'P0: 7 0 nan 0 0 7 2 0 0 0 1 0', 'cx is nan'),
    (b'\xff\xfe\x00', "no line 'P0'"),
])
def test_kitti_calibration_that_is_broken(tmp_path, content, message):
    fill(tmp_path / 'image_0', ['0.png'])
    (tmp_path / 'calib.txt').write_bytes(content)
    with open_source(tmp_path) as source:
        with pytest.raises(SourceError, match=f'calib.txt, P0: .*{message}') as caught:
            source.camera(rectified=True)
        assert '\n' not in str(caught.value)
        assert len(list(source)) == 1


@pytest.mark.parametrize('suffix', PICTURE_SUFFIXES)
def test_truncated_picture(tmp_path, suffix):
    fill(tmp_path, ['0.png', f'1{suffix}', '2.png'], shape=(48, 64))
    bad = tmp_path / f'1{suffix}'
    whole = bad.read_bytes()
    # A TIFF may end with a pointer that no reader follows.
    for length in (0, 10, len(whole) // 2, len(whole) - (9 if suffix.startswith('.tif') else 3)):
        bad.write_bytes(whole[:length])
        with open_source(tmp_path) as source:
            frames = iter(source)
            next(frames)
            with pytest.raises(SourceError, match=rf'1{suffix} cannot be used') as caught:
                next(frames)
        assert '\n' not in str(caught.value)


def test_picture_of_floats(tmp_path):
    cv2.imwrite(str(tmp_path / '0.tif'), np.ones((5, 7), np.float32))
    with open_source(tmp_path) as source, pytest.raises(SourceError, match='float32'):
        list(source)


def test_deleted_picture(tmp_path):
    fill(tmp_path, ['0.png', '1.png'])
    with open_source(tmp_path) as source:
        (tmp_path / '1.png').unlink()
        with pytest.raises(SourceError, match=r'1.png cannot be read: No such file'):
            list(source)


def test_only_selected_pictures_are_decoded(tmp_path):
    fill(tmp_path, [f'{index}.png' for index in range(10)])
    for index in (0, 1, 2, 4, 6, 7, 8, 9):
        (tmp_path / f'{index}.png').write_text('no picture')
    selection = Selection(start=0.3, duration=0.3, every=2)
    with open_source(tmp_path, selection=selection) as source:
        assert source.frame_count == 2
        assert [frame.stamp_ns for frame in source] == [3 * TENTH, 5 * TENTH]


@pytest.mark.parametrize('clip', ['00', '06'])
def test_kitti_clip(kitti_root, clip):
    selection = Selection(start=1.0, duration=1.0)
    with open_source(kitti_root / clip, selection=selection) as source:
        frames = list(source)
        assert source.frame_count == len(frames)
        camera = source.camera(rectified=True)
    assert 8 <= len(frames) <= 12
    assert frames[0].image.dtype == np.uint8
    assert frames[0].image.ndim == 2
    gaps = np.diff([frame.stamp_ns for frame in frames]) / 1e9
    assert np.all((gaps > 0.09) & (gaps < 0.12))
    assert camera.shape == frames[0].image.shape
    assert 700 < camera.fx == camera.fy < 720
    with open_source(kitti_root / clip / 'image_0', selection=selection) as source:
        assert [frame.stamp_ns for frame in source] == [frame.stamp_ns for frame in frames]


def test_results_of_an_earlier_run_are_no_frames(tmp_path):
    for name in ('0.png', '1.png'):
        cv2.imwrite(str(tmp_path / name), np.eye(64, dtype=np.uint8))
    with output_directory(tmp_path) as staging:
        cv2.imwrite(str(staging / 'trajectory.png'), np.eye(64, dtype=np.uint8))
    with open_source(tmp_path) as source:
        assert len(list(source)) == 2
