# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What can go wrong with images, injected over real DDS."""

from array import array

from coded import codes, complete, restart, send
import cv2
from live import image, stop
import numpy as np
from phase_traj_ros.ros.outputs.messages import MESSAGES
import pytest
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import CompressedImage, Image
from test_node import rolled, SECOND, START, texture


def test_a_camera_upside_down(shared_live, tuned):
    node = tuned({'rotate_180': True})
    frames = [np.ascontiguousarray(frame[::-1, ::-1]) for frame in rolled([0, 0, 30])]
    send(node, frames, [0, 0.1, 0.2])
    shared_live.until(lambda: complete(node, 2))
    assert [each.vector.x for each in node['shift']] == pytest.approx([0, 30], abs=0.1)
    assert codes(node)[0] == [1, 0]


def test_another_encoding_in_mid_stream(shared_live, tuned):
    node = tuned()
    frames = rolled([0, 0, 30, 30, 60])
    for index, frame in enumerate(frames):
        colour = index >= 2
        node['camera'].publish(image(
            np.dstack([frame] * 3) if colour else frame, START + index * SECOND,
            'bgr8' if colour else 'mono8'))
    shared_live.until(lambda: complete(node, 4))
    assert codes(node) == ([1, 3, 1, 0], ['ok', 'reprimed', 'ok', 'ok'])


def test_what_is_correlated_can_change_while_running(shared_live, tuned):
    node = tuned({'shift.decimation': 1})
    send(node, rolled([0, 0]), [0, 0.1])
    shared_live.until(lambda: complete(node, 1))
    assert shared_live.set_parameter('shift.decimation', 2).successful
    assert not shared_live.set_parameter('shift.decimation', 0).successful
    result = shared_live.set_parameter('shift.decimation', 16)
    assert not result.successful
    assert 'shift.decimation' in result.reason and 'of images of 160x96' in result.reason
    send(node, rolled([0, 24]), [0.2, 0.3])
    shared_live.until(lambda: complete(node, 3))
    assert codes(node) == ([1, 3, 0], ['ok', 'reprimed', 'ok'])
    assert node['shift'][2].vector.x == pytest.approx(24, abs=0.3)


def compressed(frame, stamp_ns, extension='.png', form='mono8; png compressed'):
    message = CompressedImage(format=form)
    message.header.stamp = MESSAGES.time(stamp_ns)
    message.data = array('B', cv2.imencode(extension, frame)[1].tobytes())
    return message


def test_compressed_images(live, run):
    forms = [('.png', 1), ('.jpg', 1), ('.png', 3), ('.jpg', 3)]
    node = run(
        '-p', 'image_transport:=compressed', '-r', 'image:=/camera/image',
        kind=CompressedImage, topic='/camera/image/compressed')
    for number, (extension, channels) in enumerate(forms):
        restart(live, node)
        for index, frame in enumerate(rolled([0, 0, 32])):
            picture = np.dstack([frame] * channels) if channels > 1 else frame
            stamp_ns = START + (10 * number + index) * SECOND
            node['camera'].publish(compressed(picture, stamp_ns, extension))
        live.until(lambda: complete(node, 2))
        shifts = [each.vector.x for each in node['shift']]
        assert shifts == pytest.approx([0, 32], abs=0.1), (extension, channels)


def test_bad_compressed_images_are_skipped(live, run):
    node = run(
        '-p', 'image_transport:=compressed', kind=CompressedImage,
        topic='/image/compressed')
    good = [compressed(frame, START + index * SECOND) for index, frame in
            enumerate(rolled([0, 0, 32]))]
    truncated = compressed(texture(), START + SECOND // 2)
    truncated.data = truncated.data[:300]
    foreign = compressed(texture(), START + SECOND // 2 + 1)
    foreign.data = array('B', b'GIF89a' + bytes(100))
    node['camera'].publish(good[0])
    for message in (truncated, foreign) * 5:
        node['camera'].publish(message)
    for message in good[1:]:
        node['camera'].publish(message)
    live.until(lambda: complete(node, 2), process=node['process'])
    assert [each.vector.x for each in node['shift']] == pytest.approx([0, 32], abs=0.1)
    live.until_said('skipped an image on /image/compressed')
    assert 'Traceback' not in live.logs()


def test_the_debug_image_shows_the_frame(shared_live, tuned):
    pictures = shared_live.listen(Image, 'phase_traj/debug_image', qos_profile_sensor_data)
    node = tuned()
    index = 0

    def feed():
        nonlocal index
        send(node, rolled([index * 5]), [index * 0.1])
        index += 1
        return pictures

    shared_live.until(feed)
    picture = pictures[0]
    assert (picture.encoding, picture.height, picture.width) == ('bgr8', 96, 160)
    assert len(picture.data) == 96 * 160 * 3


def random_image(rng, stamp_ns):
    """Return an image message whose fields need not have anything to do with each other."""
    height, width, step = (int(rng.choice([0, 1, 7, 96, 160, 320, 2**32 - 1])) for _ in range(3))
    encoding = str(rng.choice([
        'mono8', 'mono16', 'rgb8', 'bgra8', 'bayer_rggb8', 'yuv422', 'yuv422_yuy2', '8UC1', '',
        'MONO8', 'h264', 'x' * 300]))
    data = rng.integers(0, 256, int(rng.choice([0, 1, 159, 15360, 46080]))).astype(np.uint8)
    message = image(
        data.tobytes(), 0, encoding, shape=(height, width), step=step,
        is_bigendian=bool(rng.integers(2)))
    message.header.stamp = MESSAGES.time(int(rng.choice(
        [-100 * SECOND, 0, 1, stamp_ns, 2**31 * SECOND - 1])))
    return message


def test_random_images_never_stop_the_node(live, run):
    rng = np.random.default_rng(4)
    node = run()
    for index in range(400):
        node['camera'].publish(random_image(rng, START + index))
    # Later than all of these, so that none is late.
    later = START + 10 * SECOND
    for index, frame in enumerate(rolled([0, 0, 30])):
        node['camera'].publish(image(frame, later + index * SECOND))
    live.until(
        lambda: len(node['shift']) >= 2
        and node['shift'][-1].header.stamp == MESSAGES.time(later + 2 * SECOND),
        process=node['process'])
    assert node['shift'][-1].vector.x == pytest.approx(30, abs=0.2)
    assert 'Traceback' not in live.logs()
    assert stop(node['process']) == 0
