# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The live node, from the outside."""

import math
import signal

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, Vector3Stamped
from live import image, LATCHED, LOSSLESS, SHIFT, stop
from nav_msgs.msg import Path
import numpy as np
from phase_traj_ros.core.codes.text import parse_chain_code
from phase_traj_ros.ros.main import main
from phase_traj_ros.synthetic.degradations import sensor_noise
import pytest
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Image
from std_msgs.msg import Float32, String, UInt8
from std_srvs.srv import Trigger

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND


def texture(shape=(96, 160), seed=0):
    rng = np.random.default_rng(seed)
    coarse = rng.integers(0, 256, (shape[0] // 4, shape[1] // 4), dtype=np.uint8)
    return np.kron(coarse, np.ones((4, 4), np.uint8))


def rolled(positions, frame=None):
    """Return the frame rolled to each of the positions, with the noise of a sensor."""
    frame = texture() if frame is None else frame
    return [
        sensor_noise(np.roll(frame, position, axis=1), sigma=1.0, seed=index)
        for index, position in enumerate(positions)]


# Forward, a left turn over two pairs, forward, a right turn, forward.
DRIVE = [0, 0, 0, 30, 60, 60, 60, 20, 20, 20]
MOVEMENT = [1, 1, 0, 3, 1, 1, 2, 1, 1]
DIRECTION = [1, 1, 0, 0, 0, 1, 1, 1]


def listening(live):
    """Listen to all topics; return the lists by name."""
    kinds = {
        'movement': UInt8, 'direction': UInt8, 'shift': Vector3Stamped, 'response': Float32,
        'pose': PoseStamped}
    received = {name: live.listen(kind, f'phase_traj/{name}') for name, kind in kinds.items()}
    received['chain_code'] = live.listen(String, 'phase_traj/chain_code', LATCHED)
    received['path'] = live.listen(Path, 'phase_traj/path', LATCHED)
    return received


def restart(live, topics):
    """Reset the node, and forget what has come from it so far."""
    topics['chain_code'].clear()
    topics['path'].clear()
    # A node can only answer a client it knows, and it knows the older subscriptions, too.
    assert live.call(Trigger, 'phase_traj/reset', Trigger.Request()).success
    live.until(lambda: topics['chain_code'] and topics['path'] and topics['chain_code'][-1].data
               .startswith('frames 0;') and not topics['path'][-1].poses)
    for messages in topics.values():
        messages.clear()


@pytest.fixture
def topics(live):
    """Listen to all topics; return the lists by name."""
    return listening(live)


@pytest.fixture
def connected(live, topics):
    """Start the node; return its process and a camera, when both know each other."""
    process = live.start(*SHIFT)
    restart(live, topics)
    return process, live.camera()


@pytest.fixture(scope='module')
def lasting(shared_live):
    """Start a node that tests share; return all that is heard of it, and a camera."""
    heard = listening(shared_live)
    shared_live.start(*SHIFT)
    restart(shared_live, heard)
    return heard, shared_live.camera()


@pytest.fixture
def again(shared_live, lasting):
    """Reset the node that tests share; return what is heard of it from now on, and its camera."""
    heard, camera = lasting
    restart(shared_live, heard)
    return heard, camera


def publish(camera, frames, *, start=START, encoding='mono8', period=SECOND // 10):
    for index, frame in enumerate(frames):
        camera.publish(image(frame, start + index * period, encoding))


def complete(topics, pairs):
    """Tell whether all that belongs to so many pairs has come; topics overtake each other."""
    return all(
        len(topics[name]) == pairs for name in ('movement', 'shift', 'response', 'pose'))


def stamps(messages):
    return [
        each.header.stamp.sec * SECOND + each.header.stamp.nanosec for each in messages]


def test_every_topic(live, topics, connected):
    publish(connected[1], rolled(DRIVE))
    live.until(lambda: complete(topics, 9) and len(topics['direction']) == 8)
    assert [each.data for each in topics['movement']] == MOVEMENT
    assert [each.data for each in topics['direction']] == DIRECTION
    assert [round(each.vector.x) for each in topics['shift']] == [0, 0, 30, 30, 0, 0, -40, 0, 0]
    assert {each.vector.z for each in topics['shift']} == {0.0}
    assert {each.header.frame_id for each in topics['shift']} == {'camera'}
    assert len(topics['response']) == 9
    assert topics['response'][0].data == pytest.approx(1, abs=0.1)
    expected = [START + (index + 1) * SECOND // 10 for index in range(9)]
    assert stamps(topics['shift']) == stamps(topics['pose']) == expected
    live.until(lambda: topics['path'] and stamps(topics['path'])[-1] == expected[-1])
    path = topics['path'][-1]
    assert path.header.frame_id == topics['pose'][0].header.frame_id == 'phase_traj'
    assert [(each.pose.position.x, each.pose.position.y) for each in path.poses] == [
        (0, 0), (2, 0), (2, 3), (5, 3)]
    assert [
        round(math.degrees(2 * math.atan2(each.pose.orientation.z, each.pose.orientation.w)))
        for each in path.poses] == [0, 90, 0, 0]
    live.until(lambda: topics['chain_code'][-1].data.startswith('frames 10;'))
    text = parse_chain_code(topics['chain_code'][-1].data)
    assert text.movement.runs == ((1, 2), (0, 1), (3, 1), (1, 2), (2, 1), (1, 2))
    assert stop(connected[0]) == 0


def test_who_comes_late_gets_the_chain_code_and_the_path(shared_live, again):
    topics, camera = again
    publish(camera, rolled(DRIVE))
    shared_live.until(lambda: topics['path'] and len(topics['path'][-1].poses) == 4)
    shared_live.until(lambda: topics['chain_code'][-1].data.startswith('frames 10;'))
    texts = shared_live.listen(String, 'phase_traj/chain_code', LATCHED)
    paths = shared_live.listen(Path, 'phase_traj/path', LATCHED)
    shared_live.until(lambda: texts and paths and complete(topics, 9))
    assert texts[0].data == topics['chain_code'][-1].data
    assert len(paths[0].poses) == 4


def test_who_comes_late_gets_a_path_that_nobody_took(live):
    process = live.start(*SHIFT)
    movement = live.listen(UInt8, 'phase_traj/movement')
    assert live.call(Trigger, 'phase_traj/reset', Trigger.Request()).success
    publish(live.camera(), rolled(DRIVE))
    live.until(lambda: len(movement) == 9)
    paths = live.listen(Path, 'phase_traj/path', LATCHED)
    live.until(lambda: paths and len(paths[-1].poses) == 4)
    assert stop(process) == 0


def test_reset_starts_anew(shared_live, again):
    topics, camera = again
    publish(camera, rolled(DRIVE))
    shared_live.until(lambda: complete(topics, 9))
    answer = shared_live.call(Trigger, 'phase_traj/reset', Trigger.Request())
    assert (answer.success, answer.message) == (True, 'restarted after 10 frames')
    shared_live.until(lambda: topics['chain_code'][-1].data.startswith('frames 0;'))
    shared_live.until(lambda: not topics['path'][-1].poses)
    publish(camera, rolled(DRIVE), start=START + 100 * SECOND)
    shared_live.until(lambda: complete(topics, 18))
    assert [each.data for each in topics['movement']] == MOVEMENT * 2


def test_time_going_back_starts_anew_and_is_reported(shared_live, again):
    topics, camera = again
    publish(camera, rolled(DRIVE), start=START + 10 * SECOND)
    publish(camera, rolled(DRIVE))
    shared_live.until(lambda: complete(topics, 18))
    assert [each.data for each in topics['movement']] == MOVEMENT * 2
    shared_live.until_said('time went back by 10.900 s, from 1700000010.900 to 1700000000.000')


ENCODERS = {
    'mono8': lambda grey: grey,
    'mono16': lambda grey: grey.astype('<u2') * 257,
    'rgb8': lambda grey: np.dstack([grey] * 3),
    'bgr8': lambda grey: np.dstack([grey] * 3),
    'rgba8': lambda grey: np.dstack([grey] * 4),
    'bgra8': lambda grey: np.dstack([grey] * 4),
    'bayer_rggb8': lambda grey: grey,
    'bayer_bggr8': lambda grey: grey,
    'bayer_gbrg8': lambda grey: grey,
    'bayer_grbg8': lambda grey: grey,
    'yuv422': lambda grey: np.dstack([np.full_like(grey, 128), grey]),
    'yuv422_yuy2': lambda grey: np.dstack([grey, np.full_like(grey, 128)]),
    'nv12': lambda grey: np.vstack([grey, np.full_like(grey[::2], 128)]),
    '32FC1': lambda grey: grey.astype('<f4') / 10 + 273,
}


def test_every_encoding(shared_live, again):
    topics, camera = again
    sent = 0
    for number, (encoding, encode) in enumerate(ENCODERS.items()):
        frames = [np.ascontiguousarray(encode(each)) for each in rolled([0, 0, 24, 24])]
        publish(camera, frames, encoding=encoding, start=START + number * 100 * SECOND)
        sent += 4
    shared_live.until(lambda: complete(topics, sent - 1))
    assert 'skipped' not in shared_live.logs()
    for number, encoding in enumerate(ENCODERS):
        shifts = topics['shift'][4 * number:4 * number + 3]
        assert [each.vector.x for each in shifts] == pytest.approx([0, 24, 0], abs=0.1), encoding


def test_padded_rows_and_big_endian(shared_live, again):
    topics, camera = again
    frames = rolled([0, 30, 30, 0])
    for index, frame in enumerate(frames):
        padded = np.full((96, 200), 255, '>u2')
        padded[:, :160] = frame.astype(np.uint16) * 200
        message = image(
            padded.tobytes(), START + index * SECOND, 'mono16', shape=(96, 160), step=400,
            is_bigendian=True)
        camera.publish(message)
    shared_live.until(lambda: complete(topics, 3))
    assert [each.vector.x for each in topics['shift']] == pytest.approx([30, 0, -30], abs=0.1)


def test_bad_images_are_reported_and_skipped(live, topics, connected):
    process, camera = connected
    good = rolled([0, 0, 25])
    camera.publish(image(good[0], START))
    bad = [
        image(b'', START + 1, shape=(0, 0), step=0),
        image(b'12', START + 2, shape=(96, 160), step=160),
        image(good[0].tobytes(), START + 3, 'jpeg2000', shape=(96, 160), step=160),
        image(good[0].tobytes(), START + 4, shape=(96, 160), step=100),
        image(bytes(16), START + 5, shape=(4, 4), step=4),
    ]
    for message in bad * 20:
        camera.publish(message)
    camera.publish(image(good[1], START + SECOND))
    camera.publish(image(good[2], START + 2 * SECOND))
    live.until(lambda: complete(topics, 2), process=process)
    assert [each.vector.x for each in topics['shift']] == pytest.approx([0, 25], abs=0.1)
    assert 1 <= live.logs().count('skipped an image on /image') <= 3
    assert 'Traceback' not in live.logs()


def test_a_frame_of_another_size_is_no_measurement(shared_live, again):
    topics, camera = again
    publish(camera, rolled([0, 0]))
    publish(camera, rolled([0, 20], texture((64, 128))), start=START + SECOND)
    shared_live.until(lambda: complete(topics, 3))
    assert [each.data for each in topics['movement']] == [1, 3, 0]
    assert math.isnan(topics['shift'][1].vector.x)
    assert topics['response'][1].data == 0.0


def test_a_camera_without_stamps_still_makes_pairs(live, topics, connected):
    # The first zero may be a time, the second is not: the receive times start anew.
    for pairs, frame in zip((0, 0, 1, 2, 3), rolled([0, 0, 0, 30, 30])):
        connected[1].publish(image(frame, 0))
        live.spin(0.05)
        # What is taken within 2 ms is one exposure: who answers has taken the image before.
        assert live.set_parameter('max_gap', 0.0).successful
        live.until(lambda pairs=pairs: complete(topics, pairs))
    assert [each.data for each in topics['movement']] == [1, 0, 1]


def test_parameters_change_live_or_are_refused_with_a_reason(live, topics, connected):
    camera = connected[1]
    publish(camera, rolled([0, 0, 30]))
    live.until(lambda: complete(topics, 2))
    assert live.set_parameter('threshold', 40.0).successful
    for name, value, reason in (
            ('threshold', -3.0, 'threshold'),
            ('threshold', math.nan, 'threshold'), ('threshold', math.inf, 'threshold'),
            ('threshold', 20, 'type'), ('shift.decimation', 0, 'shift.decimation'),
            ('speed', 1.0, 'read-only'), ('treshold', 20.0, 'declared')):
        result = live.set_parameter(name, value)
        assert not result.successful, (name, value)
        assert reason in result.reason
    publish(camera, rolled([0, 0]), start=START + SECOND)
    live.until(lambda: complete(topics, 4))
    assert [each.data for each in topics['movement']] == [1, 0, 1, 1]
    assert topics['pose'][-1].pose.position.x == 1.0


@pytest.mark.parametrize(('argument', 'message'), [
    ('threshold:=20', "'threshold' is 20: give a double, such as 20.0"),
    ('threshold:=-1.0', "'threshold' is -1.0: give 0 to 10000"),
    ('code_source:=round', "'code_source' is 'round': give one of auto, shift, heading"),
    ('shift.decimation:=0', "'shift.decimation' is 0: give 1 to 16"),
])
def test_a_wrong_start_says_what_is_wrong(capfd, argument, message):
    assert main(['--ros-args', '-p', argument]) == 2
    assert message in capfd.readouterr().err


@pytest.mark.parametrize(('arguments', 'message'), [
    (('--params-file', '/does/not/exist'), "there is no parameter file '/does/not/exist'"),
    (('-r', 'x'), "the remap rule 'x' is not valid: write '-r FROM:=TO'"),
    (('-p', 'threshold'), "rule 'threshold' is not valid: write '-p NAME:=VALUE'")])
def test_ros_arguments_that_make_no_sense(capfd, arguments, message):
    assert main(['--ros-args', *arguments]) == 2
    assert message in capfd.readouterr().err


def test_a_misspelt_parameter_is_reported(live):
    live.start('-p', 'treshold:=20.0')
    live.until_said("no parameter 'treshold'")


def test_names_can_be_remapped(live):
    live.start(
        '-r', '__ns:=/front', '-r', 'image:=/camera/image_raw', lossless=False)
    camera = live.camera('/camera/image_raw', qos_profile_sensor_data)
    shifts = live.listen(Vector3Stamped, '/front/phase_traj/shift')
    live.call(Trigger, '/front/phase_traj/reset', Trigger.Request())
    sent = 0

    def shown():
        # Sensor data may be lost, and more comes.
        nonlocal sent
        [frame] = rolled([10 * sent])
        camera.publish(image(frame, START + sent * SECOND))
        sent += 1
        return len(shifts) >= 5

    live.until(shown)


def test_a_signal_in_mid_callback_ends_the_node_in_order(live):
    # Twelve large frames at once keep the node in its callback, one after the other; the answer to
    # one of the first three shows that it is there, with the rest of them still to come.
    frames = [
        image(each, START + index * SECOND)
        for index, each in enumerate(rolled(range(0, 120, 10), texture((752, 2480))))]
    camera = live.node.create_publisher(Image, 'image', LOSSLESS)
    shifts = live.listen(Vector3Stamped, 'phase_traj/shift')
    for attempt, number in enumerate([signal.SIGINT, signal.SIGTERM, signal.SIGHUP] * 2):
        process = live.start(*SHIFT)
        live.until(lambda: camera.get_subscription_count() == 1, process=process)
        live.call(Trigger, 'phase_traj/reset', Trigger.Request())
        shifts.clear()
        for frame in frames:
            camera.publish(frame)
        live.until(lambda wanted=1 + attempt % 3: len(shifts) >= wanted, process=process)
        assert len(shifts) < 11, 'the node was too fast to be caught in its callback'
        assert stop(process, number) == 0, live.logs()
        log = process.log.read_text()
        assert 'Traceback' not in log and 'rror' not in log, log
        live.until(lambda: camera.get_subscription_count() == 0)


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_while_idle_ends_the_node_in_order(live, number):
    process = live.start()
    live.until_said('listening to /image')
    assert stop(process, number) == 0
    assert 'Traceback' not in live.logs()


def test_pairs_can_be_synchronised_with_the_images(live, topics, connected):
    pairs = live.listen(DiagnosticArray, 'phase_traj/pair')
    live.until(lambda: live.node.count_publishers('phase_traj/pair') == 1)
    answer = live.call(Trigger, 'phase_traj/reset', Trigger.Request())
    assert answer.success
    publish(connected[1], rolled(DRIVE))
    live.until(lambda: complete(topics, 9) and len(pairs) == 9)
    assert stamps(pairs) == stamps(topics['shift'])
    told = [{each.key: each.value for each in pair.status[0].values} for pair in pairs]
    assert [int(each['movement']) for each in told] == MOVEMENT
    assert [int(each['direction']) for each in told if each['direction']] == DIRECTION
    assert [float(each['dx']) for each in told] == [each.vector.x for each in topics['shift']]
    assert [float(each['response']) for each in told] == [
        pytest.approx(each.data, rel=1e-6) for each in topics['response']]
    assert [pair.status[0].message for pair in pairs] == [
        'turning' if code == 3 else 'ok' for code in MOVEMENT]
