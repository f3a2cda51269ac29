# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What can go wrong between the cameras and the node, and what is told of it."""

from coded import complete, send
from diagnostic_msgs.msg import DiagnosticArray
from live import image, LOSSLESS
import numpy as np
import rclpy
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import CompressedImage, Image
from test_node import rolled, SECOND, START, texture


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
    for stage in ('receive', 'convert', 'measure', 'code', 'publish'):
        assert float(images[f'{stage} (us)']) >= 0
    assert float(images['measure (us)']) > 0
    assert (measurement['frames'], measurement['repeated']) == ('4', '1')
    assert (measurement['gaps'], measurement['unmeasured']) == ('1', '1')
    levels = {level for each in reports for level in [statuses(each)['images'].level]}
    assert b'\x02' in levels, 'a bad image has to show as an error'


def test_a_late_subscriber_is_told_of_the_last_second_only(live, run):
    node = run()
    send(node, rolled([0, 10, 20, 30]), np.arange(4) * 0.1)
    live.until(lambda: complete(node, 3))
    # More than the period of the reports.
    live.spin(1.5)
    reports = live.listen(DiagnosticArray, '/diagnostics', 10)
    live.until(lambda: reports)
    assert statuses(reports[0])['measurement'].message == 'nothing to measure'


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
    live.until_said(
        'publishes sensor_msgs/msg/CompressedImage',
        '/nowhere has 0 publishers; images are on /front/image_raw: remap')
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
    live.until_said('publishers: /other, /test', process=node['process'])

    def images():
        return statuses(reports[-1])['images']

    # All arrive; those that overtake each other are late, and dropped for their stamps.
    live.until(lambda: reports and values(images())['images'] == '150')
    assert values(images())['lost'] == '0'
    assert images().message == '2 publishers: /other, /test'
    other.destroy_node()


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
