# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How open_source recognises sources, and its errors."""

import os
import re

import cv2
import numpy as np
from phase_traj_ros.errors import MissingDependencyError, ParameterError, SourceError
from phase_traj_ros.io import open_source, Selection
from phase_traj_ros.io.sources.bag import BagSource
from phase_traj_ros.io.sources.folder import FolderSource
from phase_traj_ros.io.sources.pyav_video import PyavSource
from phase_traj_ros.io.sources.video import VideoSource
import pytest


def one_line(error):
    text = str(error.value)
    return '\n' not in text and len(text) < 600


@pytest.fixture
def folder(tmp_path):
    path = tmp_path / 'folder'
    path.mkdir()
    for index in range(4):
        cv2.imwrite(str(path / f'{index}.png'), np.full((4, 6), index, np.uint8))
    return path


@pytest.fixture
def video(tmp_path):
    path = tmp_path / 'video.avi'
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*'MJPG'), 10.0, (64, 48))
    assert writer.isOpened()
    for _ in range(3):
        writer.write(np.zeros((48, 64, 3), np.uint8))
    writer.release()
    return path


def test_recognises(tmp_path, maker, folder, video):
    bag = maker.drive(tmp_path / 'bag')
    assert isinstance(open_source(bag), BagSource)
    assert isinstance(open_source(str(maker.single_file(bag))), BagSource)
    assert isinstance(open_source(folder), FolderSource)
    assert isinstance(open_source(video), (PyavSource, VideoSource))


def test_same_selection_for_all(tmp_path, maker, folder, video):
    bag = maker.drive(tmp_path / 'bag')
    for path in (bag, folder, video):
        with open_source(path, selection=Selection(start=0.05, every=2)) as source:
            stamps = [frame.stamp_ns for frame in source]
        first = 100 * 10 ** 9 if path == bag else 0
        assert [stamp - first for stamp in stamps] == [10 ** 8, 3 * 10 ** 8][:len(stamps)]
        assert len(stamps) == (1 if path == video else 2)


def test_each_iteration_starts_again(tmp_path, maker, folder, video):
    bag = maker.drive(tmp_path / 'bag')
    for path in (bag, folder, video):
        with open_source(path) as source:
            first, second = (
                [(frame.stamp_ns, int(frame.image.sum())) for frame in source] for _ in 'ab')
            assert first == second
            # Two at a time.
            assert len(list(zip(source, source, strict=True))) == len(first)


def test_nothing_selected(tmp_path, maker, folder, video):
    for path in (maker.drive(tmp_path / 'bag'), folder, video):
        with open_source(path, selection=Selection(start=1000)) as source, \
                pytest.raises(SourceError, match=r'is selected \(start 1000 s\)') as caught:
            list(source)
        assert one_line(caught)
    with open_source(folder, selection=Selection(start=0.11, duration=0.05)) as source, \
            pytest.raises(SourceError, match=r'duration 0.05 s\); the last frame read is 0.300 s'):
        list(source)


@pytest.mark.parametrize(('name', 'message'), [
    ('missing', 'does not exist'),
    ('missing.mcap', 'does not exist'),
    ('empty', 'no images .* and no metadata.yaml'),
    ('empty.mcap', 'is empty'),
    ('empty.avi', 'is empty'),
    ('text.txt', 'text file, not a video'),
    ('words.avi', 'text file, not a video'),
    ('noise.mp4', 'cannot be opened as a video'),
    ('noise.mcap', 'cannot be read as a ROS 2 bag .*mcap recover'),
    ('noise.db3', 'cannot be read as a ROS 2 bag .*ros2 bag reindex'),
    ('noise.bag', 'cannot be read as a ROS 1 bag .*rosbag reindex'),
    ('picture.png', 'single image; give the folder'),
    ('NOISE.MCAP', 'rename it to end in .mcap'),
    ('killed', 'ROS 2 bag without metadata.yaml .*ros2 bag reindex .*killed_0.mcap'),
    ('pipe', 'neither a file nor a directory'),
])
def test_refuses(tmp_path, name, message):
    noise = np.random.default_rng(0).integers(0, 256, 5000, dtype=np.uint8).tobytes()
    (tmp_path / 'empty').mkdir()
    (tmp_path / 'empty.mcap').touch()
    (tmp_path / 'empty.avi').touch()
    (tmp_path / 'text.txt').write_text('Grüße\n' * 2000, encoding='utf-8')
    (tmp_path / 'words.avi').write_text('hello\n' * 2000)
    for noisy in ('noise.mp4', 'noise.mcap', 'noise.db3', 'noise.bag', 'NOISE.MCAP'):
        (tmp_path / noisy).write_bytes(noise)
    cv2.imwrite(str(tmp_path / 'picture.png'), np.zeros((4, 4), np.uint8))
    (tmp_path / 'killed').mkdir()
    (tmp_path / 'killed' / 'killed_0.mcap').touch()
    os.mkfifo(tmp_path / 'pipe')
    with pytest.raises((SourceError, MissingDependencyError)) as caught:
        open_source(tmp_path / name)
    if isinstance(caught.value, MissingDependencyError):
        pytest.skip(f'without the rosbags it takes: {caught.value}')
    assert re.search(message, str(caught.value))
    assert one_line(caught)


@pytest.mark.skipif(os.geteuid() == 0, reason='root may read everything')
def test_no_permission(folder, video):
    for path in (folder, video):
        path.chmod(0)
        try:
            with pytest.raises(SourceError, match='cannot be read') as caught:
                open_source(path)
        finally:
            path.chmod(0o700)
        assert one_line(caught)


@pytest.mark.parametrize('fps', [0.0, -1.0, float('nan'), float('inf'), 1e-9, 1e12])
def test_bad_rate(folder, fps):
    with pytest.raises(ParameterError, match='fps must be'):
        open_source(folder, fps=fps)


def test_options_that_do_not_fit(tmp_path, mcap_maker, folder, video):
    with pytest.raises(SourceError, match=r'is a bag: .* leave out fps'):
        open_source(mcap_maker.drive(tmp_path / 'bag'), fps=10)
    with pytest.raises(SourceError, match=r'is a folder, .* leave out topic'):
        open_source(folder, topic='/image')
    with pytest.raises(SourceError, match=r'is a video, .* leave out topic'):
        open_source(video, topic='/image')


def test_bag_without_the_package_for_bags(tmp_path, maker, monkeypatch):
    path = maker.drive(tmp_path / 'bag')
    for name in (
            'rosbags', 'rosbags.typesys', 'rosbags.rosbag1', 'rosbags.rosbag2', 'rosbag2_py'):
        monkeypatch.setitem(__import__('sys').modules, name, None)
    with pytest.raises(MissingDependencyError, match='pip install rosbags') as caught:
        open_source(path)
    assert one_line(caught)
