# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What can go wrong with cameras and networks, injected over real DDS."""

from array import array
import json
import math

import cv2
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Vector3Stamped
from live import image, LOSSLESS, SHIFT, stop
import numpy as np
from phase_traj_ros.parameters import specs
from phase_traj_ros.ros.outputs.messages import to_time
from phase_traj_ros.ros.playback.live_run import lossless_overrides
import pytest
import rclpy
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import String, UInt8
from std_srvs.srv import Trigger
from test_node import rolled, SECOND, START, texture


@pytest.fixture
def run(live):
    """Return a function that starts the node and listens to its codes."""
    def start(*arguments, kind=Image, topic='image', lossless=True):
        listened = listen(live)
        overrides = lossless_overrides(live.node.resolve_topic_name(topic)) if lossless else []
        listened['process'] = live.start(*SHIFT, *arguments, *overrides, lossless=False)
        live.call(Trigger, 'phase_traj/reset', Trigger.Request())
        listened['camera'] = live.camera(topic, kind=kind)
        return listened
    return start


@pytest.fixture(scope='module')
def shared_node(shared_live):
    """Start the node that tests share, and listen to its codes."""
    listened = listen(shared_live)
    shared_live.start(*SHIFT)
    listened['camera'] = shared_live.camera()
    return listened


@pytest.fixture
def tuned(shared_live, shared_node):
    """Return a function that resets the shared node, with parameters for one test."""
    changed = {}

    def tune(parameters):
        changed.update(parameters)
        for name, value in parameters.items():
            answer = shared_live.set_parameter(name, value)
            assert answer.successful, answer.reason
        shared_live.call(Trigger, 'phase_traj/reset', Trigger.Request())
        for name in ('movement', 'status', 'shift'):
            shared_node[name].clear()
        return shared_node

    yield tune
    defaults = {each.name: each.default for each in specs()}
    for name in changed:
        assert shared_live.set_parameter(name, defaults[name]).successful


def listen(live):
    return {
        name: live.listen(message, f'phase_traj/{name}')
        for name, message in (('movement', UInt8), ('status', String), ('shift', Vector3Stamped))}


def send(run, frames, stamps):
    for frame, stamp in zip(frames, stamps):
        run['camera'].publish(image(frame, round(START + stamp * SECOND)))


def complete(run, pairs):
    """Tell whether all that belongs to so many pairs has come; topics overtake each other."""
    return all(len(run[name]) == pairs for name in ('movement', 'status', 'shift'))


def codes(run):
    return [each.data for each in run['movement']], [each.data for each in run['status']]


def test_a_gap_is_no_movement_and_keeps_the_direction(shared_live, tuned):
    node = tuned({'max_gap': 0.5})
    send(node, rolled([0, 0, 30, 60, 90, 90]), [0, 0.1, 0.2, 5.0, 5.1, 5.2])
    shared_live.until(lambda: complete(node, 5))
    assert codes(node) == ([1, 0, 3, 0, 1], ['ok', 'ok', 'gap', 'ok', 'ok'])
    assert math.isnan(node['shift'][2].vector.x)


def test_repeated_stamps_are_dropped(shared_live, tuned):
    node = tuned({})
    send(node, rolled([0, 0, 30, 30, 60]), [0, 0.1, 0.1, 0.1, 0.2])
    shared_live.until(lambda: complete(node, 2))
    assert codes(node)[0] == [1, 0]
    assert node['shift'][1].vector.x == pytest.approx(60, abs=0.2)
    send(node, rolled([60] * 15), [0.2] * 15)
    shared_live.until(lambda: 'repeats one image, or one stamp' in shared_live.logs())


@pytest.mark.parametrize('bad', [0.49, 3600.0, -START / SECOND, -3600.0])
def test_a_stamp_out_of_order_costs_its_image_only(live, run, bad):
    node = run()
    positions = [0, 0, 0, 0, 0, 0, 90, 30, 30, 30]
    stamps = [0, 0.1, 0.2, 0.3, 0.4, 0.5, bad, 0.7, 0.8, 0.9]
    send(node, rolled(positions), stamps)
    live.until(lambda: complete(node, 8))
    assert codes(node) == ([1, 1, 1, 1, 1, 0, 1, 1], ['ok'] * 8)
    live.until(lambda: 'dropped 1 image so far: its stamp is late, or far' in live.logs())


def test_a_dropped_frame_does_not_make_a_turn_where_the_period_is_known(shared_live, tuned):
    positions, stamps = [0, 10, 20, 40, 50], [0, 0.1, 0.2, 0.4, 0.5]
    node = tuned({'shift.nominal_period': 0.1})
    send(node, rolled(positions), stamps)
    shared_live.until(lambda: complete(node, 4))
    assert codes(node)[0] == [1, 1, 1, 1]
    assert node['shift'][2].vector.x == pytest.approx(20, abs=0.2)


def test_without_a_period_a_dropped_frame_doubles_the_shift(shared_live, tuned):
    node = tuned({})
    send(node, rolled([0, 10, 20, 40, 50]), [0, 0.1, 0.2, 0.4, 0.5])
    shared_live.until(lambda: complete(node, 4))
    assert codes(node)[0] == [1, 1, 0, 1]


def test_a_camera_upside_down(live, run):
    node = run('-p', 'rotate_180:=true')
    frames = [np.ascontiguousarray(frame[::-1, ::-1]) for frame in rolled([0, 0, 30])]
    send(node, frames, [0, 0.1, 0.2])
    live.until(lambda: complete(node, 2))
    assert [each.vector.x for each in node['shift']] == pytest.approx([0, 30], abs=0.1)
    assert codes(node)[0] == [1, 0]


def test_another_encoding_in_mid_stream(shared_live, tuned):
    node = tuned({})
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
    message.header.stamp = to_time(stamp_ns)
    message.data = array('B', cv2.imencode(extension, frame)[1].tobytes())
    return message


@pytest.mark.parametrize(('extension', 'channels'), [
    ('.png', 1), ('.jpg', 1), ('.png', 3), ('.jpg', 3)])
def test_compressed_images(live, run, extension, channels):
    node = run(
        '-p', 'image_transport:=compressed', '-r', 'image:=/camera/image',
        kind=CompressedImage, topic='/camera/image/compressed')
    for index, frame in enumerate(rolled([0, 0, 32])):
        picture = np.dstack([frame] * channels) if channels > 1 else frame
        node['camera'].publish(compressed(picture, START + index * SECOND, extension))
    live.until(lambda: complete(node, 2))
    assert [each.vector.x for each in node['shift']] == pytest.approx([0, 32], abs=0.1)


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
    assert 'skipped an image on /image/compressed' in live.logs()
    assert 'Traceback' not in live.logs()


def statuses(array_message):
    return {each.name.split(': ')[1]: each for each in array_message.status}


def values(status):
    return {each.key: each.value for each in status.values}


def test_diagnostics_tell_what_happened(live, run):
    reports = live.listen(DiagnosticArray, '/diagnostics', 10)
    node = run('-p', 'max_gap:=1.0')
    send(node, [*rolled([0, 0, 0, 0]), np.zeros((96, 160), np.uint8)], [0, 0.1, 0.1, 5, 5.1])
    node['camera'].publish(image(b'1', START + 6 * SECOND, shape=(96, 160), step=160))
    live.until(lambda: complete(node, 3))

    def told():
        newest = statuses(reports[-1]) if reports else {}
        return newest and values(newest['images'])['images'] == '6'

    live.until(told)
    newest = statuses(reports[-1])
    assert newest['images'].hardware_id == '/image'
    images, measurement = values(newest['images']), values(newest['measurement'])
    assert (images['topic'], images['bad'], images['lost']) == ('/image', '1', '0')
    assert 'needs 15360 bytes' in images['last error']
    assert float(images['p50 (ms)']) > 0
    assert float(images['p99 (ms)']) >= float(images['p50 (ms)'])
    for stage in ('receive', 'convert', 'correlate', 'code', 'publish'):
        assert float(images[f'{stage} (us)']) >= 0
    assert float(images['correlate (us)']) > 0
    assert (measurement['frames'], measurement['repeated']) == ('4', '1')
    assert (measurement['gaps'], measurement['unmeasured']) == ('1', '1')
    levels = {level for each in reports for level in [statuses(each)['images'].level]}
    assert b'\x02' in levels, 'a bad image has to show as an error'


def test_silence_is_reported_once_with_the_publishers(live):
    live.start('-r', 'image:=/front/image_raw', lossless=False)
    # Best effort does not reach a reliable subscriber.
    live.start(
        '-r', '__node:=strict', '-r', 'image:=/front/image_raw',
        '-p', 'qos_overrides./front/image_raw.subscription.reliability:=reliable',
        lossless=False)
    best_effort = live.camera('/front/image_raw', qos_profile_sensor_data)
    reports = live.listen(DiagnosticArray, '/diagnostics', 10)
    live.until(lambda: live.logs().count('no image for') == 2)
    assert live.logs().count('/front/image_raw has 1 publisher') == 2
    assert live.logs().count(
        'the quality of service of /test does not match: Best effort publisher and') == 1
    live.until(lambda: any(
        statuses(each)['images'].level == b'\x03' for each in reports))
    count = len(reports)
    live.until(lambda: len(reports) > count + 4)
    assert live.logs().count('no image for') == 2
    assert best_effort is not None


def test_silence_on_a_topic_of_another_type_says_so(live):
    live.start(lossless=False)
    live.start('-r', '__node:=other', '-r', 'image:=/nowhere', lossless=False)
    publishers = [
        live.node.create_publisher(CompressedImage, 'image', LOSSLESS),
        live.node.create_publisher(Image, '/front/image_raw', LOSSLESS)]
    live.until(lambda: live.logs().count('no image for') == 2)
    assert 'publishes sensor_msgs/msg/CompressedImage' in live.logs()
    assert '/nowhere has 0 publishers; images are on /front/image_raw: remap' in live.logs()
    assert len(publishers) == 2


def test_two_cameras_on_one_topic_are_told_and_lose_nothing(live, run):
    reports = live.listen(DiagnosticArray, '/diagnostics', 10)
    node = run()
    other = rclpy.create_node('other', context=live.context)
    second = other.create_publisher(Image, 'image', LOSSLESS)
    live.until(lambda: second.get_subscription_count() > 0)
    # The numbers of the second publisher are far behind.
    send(node, rolled([0] * 50), np.arange(50) * 0.1)
    for index in range(50):
        second.publish(image(texture(), START + (50 + 2 * index) * SECOND // 10))
        send(node, rolled([0]), [(51 + 2 * index) / 10])
    live.until(lambda: 'publishers: /other, /test' in live.logs(), process=node['process'])

    def images():
        return statuses(reports[-1])['images']

    # All arrive; those that overtake each other are late, and dropped for their stamps.
    live.until(lambda: reports and values(images())['images'] == '150')
    assert values(images())['lost'] == '0'
    assert images().message == '2 publishers: /other, /test'
    other.destroy_node()


def test_saving_without_a_folder_is_refused_with_a_reason(live, run):
    run()
    answer = live.call(Trigger, 'phase_traj/save', Trigger.Request())
    assert not answer.success
    assert 'output_dir is not set' in answer.message


def test_saving_while_running(live, run, tmp_path):
    folder = tmp_path / 'kept' / 'here'
    node = run(
        '-p', f'output_dir:={folder}', '-p', 'hfov_deg:=80.0')
    send(node, rolled([0, 0, 30, 30, 30]), [0, 0.1, 0.2, 0.3, 0.4])
    live.until(lambda: complete(node, 4))
    answer = live.call(Trigger, 'phase_traj/save', Trigger.Request())
    assert answer.success, answer.message
    folder /= 'phase_traj_1'
    assert str(folder) in answer.message
    assert {path.name for path in folder.iterdir()} == {
        'chain_code.json', 'manifest.json', 'trajectory.tum', 'trajectory.png'}
    text = (folder / 'chain_code.json').read_text()
    assert '"movement_runs": [[1, 1], [0, 1], [1, 2]]' in text
    assert '"frames": 5' in text
    poses = np.loadtxt(folder / 'trajectory.tum')
    assert poses[:, 1:3].tolist() == [[0, 0], [1, 0], [1, 3]]
    assert live.set_parameter('output_dir', '/elsewhere').successful is False
    assert stop(node['process']) == 0


def test_no_drive_is_lost_to_a_reset_or_an_exit(live, run, tmp_path):
    node = run('-p', f'output_dir:={tmp_path / "kept"}')
    send(node, rolled([0, 0, 30]), [0, 0.1, 0.2])
    live.until(lambda: complete(node, 2))
    assert live.call(Trigger, 'phase_traj/reset', Trigger.Request()).success
    send(node, rolled([0, 0, 0, 30]), [100, 100.1, 100.2, 100.3])
    # A bag played in a loop.
    send(node, rolled([0] * 5), [0, 0.1, 0.2, 0.3, 0.4])
    live.until(lambda: complete(node, 9))
    assert stop(node['process']) == 0, live.logs()
    kept = {
        folder.name: json.loads((folder / 'chain_code.json').read_text())
        for folder in (tmp_path / 'kept').iterdir()}
    assert {name: code['frames'] for name, code in kept.items()} == {
        'phase_traj_1': 3, 'phase_traj_2': 4, 'phase_traj_3': 5}
    assert kept['phase_traj_2']['movement_runs'] == [[1, 2], [0, 1]]


def test_nothing_is_written_where_nothing_came(live, tmp_path):
    process = live.start('-p', f'output_dir:={tmp_path / "kept"}')
    live.call(Trigger, 'phase_traj/reset', Trigger.Request())
    assert stop(process) == 0
    assert list((tmp_path / 'kept').iterdir()) == []


def test_an_output_folder_that_cannot_be_written_is_said_at_once(live, tmp_path):
    (tmp_path / 'file').write_text('')
    process = live.start('-p', f'output_dir:={tmp_path / "file" / "below"}')
    assert process.wait() == 2
    assert 'cannot write' in live.logs()
    assert 'Traceback' not in live.logs()


def test_the_debug_image_shows_the_frame(live, run):
    pictures = live.listen(Image, 'phase_traj/debug_image', qos_profile_sensor_data)
    node = run()
    index = 0

    def feed():
        nonlocal index
        send(node, rolled([index * 5]), [index * 0.1])
        index += 1
        return pictures

    live.until(feed)
    picture = pictures[0]
    assert (picture.encoding, picture.height, picture.width) == ('bgr8', 96, 160)
    assert len(picture.data) == 96 * 160 * 3


def test_lost_images_are_counted_and_the_newest_are_handled(live, run):
    # Best effort and far more than can be handled: the queue holds five.
    reports = live.listen(DiagnosticArray, '/diagnostics', 10)
    node = run('-r', 'image:=/flood', lossless=False, topic='/flood')
    frame = texture((540, 960))
    sent = 0

    def feed():
        nonlocal sent
        node['camera'].publish(image(np.roll(frame, sent, axis=1), START + sent * SECOND))
        sent += 1

    for _ in range(300):
        feed()

    def counted():
        # The last image may be lost, which only the next one shows.
        feed()
        images = values(statuses(reports[-1])['images']) if reports else {}
        return images and int(images['images']) + int(images['lost']) >= 300

    live.until(counted)
    images = values(statuses(reports[-1])['images'])
    assert int(images['lost']) > 0
    live.until(lambda: node['shift'][-1].header.stamp.sec > START // SECOND + 290)


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
    message.header.stamp = to_time(int(rng.choice([0, 1, stamp_ns, 2**31 * SECOND - 1])))
    return message


def test_random_images_never_stop_the_node(live, run):
    rng = np.random.default_rng(4)
    node = run()
    for index in range(400):
        node['camera'].publish(random_image(rng, START + index))
    for index, frame in enumerate(rolled([0, 0, 30])):
        node['camera'].publish(image(frame, START + index * SECOND))
    live.until(
        lambda: len(node['shift']) >= 2
        and node['shift'][-1].header.stamp == to_time(START + 2 * SECOND),
        process=node['process'])
    assert node['shift'][-1].vector.x == pytest.approx(30, abs=0.2)
    assert 'Traceback' not in live.logs()
    assert stop(node['process']) == 0


VEHICLE = {
    'max_gap': 1.0, 'still_frames': 5, 'shift.min_significance': 6.0,
    'shift.look_past_zero': True, 'shift.confirm_frames': 2, 'shift.release_frames': 4}


def street(seed=0):
    """Return a picture with detail of all sizes, as a street has."""
    rng = np.random.default_rng(seed)
    return sum(
        cv2.resize(rng.normal(0, 1, (120 // size, 320 // size)), (320, 120)) * size
        for size in (1, 2, 4, 8, 20)) * 6 + 120


def seen(picture, rng, noise=2.0):
    """Return a frame of a picture as a sensor sees it."""
    return np.clip(picture + rng.normal(0, noise, picture.shape), 0, 255).astype(np.uint8)


def test_unrelated_images_are_no_measurement(shared_live, tuned):
    rng = np.random.default_rng(0)
    node = tuned(VEHICLE)
    send(node, [seen(street(seed), rng) for seed in range(8)], np.arange(8) * 0.1)
    shared_live.until(lambda: complete(node, 7))
    assert codes(node) == ([3] * 7, ['no_measurement'] * 7)


def test_standing_still_is_not_driving(shared_live, tuned):
    rng = np.random.default_rng(0)
    node = tuned(VEHICLE)
    send(node, [seen(street(), rng, noise=5.0) for _ in range(20)], np.arange(20) * 0.1)
    shared_live.until(lambda: complete(node, 19))
    movement, status = codes(node)
    # It takes some pairs to tell.
    assert status[5:] == ['still'] * 14
    assert movement[5:] == [3] * 14


def test_wrong_pairs_in_mid_turn_do_not_count_a_second_turn(shared_live, tuned):
    rng = np.random.default_rng(0)
    node = tuned(VEHICLE)
    positions = [0, 2, 4, 30, 60, 90, 120, 150, 180, 182, 184, 186, 188, 190]
    frames = [seen(np.roll(street(), position, axis=1), rng) for position in positions]
    # Two images of something else make three pairs in a row wrong.
    frames[5] = seen(np.roll(street(), 62, axis=1), rng)
    frames[6] = seen(np.roll(street(), 64, axis=1), rng)
    send(node, frames, np.arange(len(frames)) * 0.1)
    shared_live.until(lambda: complete(node, len(frames) - 1))
    movement, _ = codes(node)
    assert movement.count(0) == 1
    assert movement.count(2) == 0
    assert movement[-2:] == [1, 1]


def test_a_swerve_of_one_pair_is_no_turn(shared_live, tuned):
    rng = np.random.default_rng(0)
    node = tuned(VEHICLE)
    positions = [0, 2, 4, 30, 32, 34, 36]
    send(node, [seen(np.roll(street(), each, axis=1), rng) for each in positions],
         np.arange(7) * 0.1)
    shared_live.until(lambda: complete(node, 6))
    assert codes(node)[0] == [1, 1, 3, 1, 1, 1]


def test_a_mask_hides_what_never_moves(live, run, tmp_path):
    rng = np.random.default_rng(0)
    mask = np.full((120, 320), 255, np.uint8)
    mask[60:] = 0
    cv2.imwrite(str(tmp_path / 'mask.png'), mask)
    bonnet = street(9)[60:]
    node = run('-p', f'mask_file:={tmp_path / "mask.png"}')
    for index in range(5):
        picture = np.roll(street(), 20 * index, axis=1)
        picture[60:] = bonnet * 1.5
        send(node, [seen(picture, rng)], [index * 0.1])
    live.until(lambda: complete(node, 4))
    assert [each.vector.x for each in node['shift']] == pytest.approx([20] * 4, abs=0.3)


def test_a_mask_that_cannot_be_read_is_said_at_once(live):
    process = live.start('-p', 'mask_file:=/does/not/exist.png')
    assert process.wait() == 2
    assert 'mask_file: /does/not/exist.png cannot be read' in live.logs()


def test_a_threshold_that_does_not_fit_is_hinted_at_once(live, run):
    node = run('-p', 'code_source:=shift')
    places = np.cumsum([0] * 5 + [14] * 30 + [0] * 90)
    send(node, rolled(places), np.arange(len(places)) * 0.1)
    live.until(lambda: complete(node, len(places) - 1))
    live.until(lambda: 'no lasting shift reached the threshold of 16 px' in live.logs())
    assert live.logs().count('no lasting shift') == 1
    assert 'try code_source auto, or a threshold of about 7 px' in live.logs()
