# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What the node saves of a drive, and when."""

import gc
import json
from threading import Event, Timer

from coded import complete, send
from live import stop
import numpy as np
from phase_traj_ros.io.sources.base import StampedFrame
from phase_traj_ros.ros.nodes.node import PhaseTrajNode
import pytest
import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import SingleThreadedExecutor
from rolled import TEXTURE
from std_srvs.srv import Trigger
from test_node import rolled


def test_saving_without_a_folder_is_refused_with_a_reason(live):
    live.start()
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


def test_a_drive_that_has_no_place_goes_elsewhere_or_is_said(live, run, tmp_path):
    kept = tmp_path / 'kept'
    node = run('-p', f'output_dir:={kept}')
    send(node, rolled([0, 0, 30]), [0, 0.1, 0.2])
    live.until(lambda: complete(node, 2))
    assert live.call(Trigger, 'phase_traj/save', Trigger.Request()).success
    changed = kept / 'phase_traj_1' / 'chain_code.json'
    changed.write_text(changed.read_text() + '\n')
    send(node, rolled([30, 0]), [0.3, 0.4])
    live.until(lambda: complete(node, 4))
    answer = live.call(Trigger, 'phase_traj/save', Trigger.Request())
    assert not answer.success and 'was changed since' in answer.message
    answer = live.call(Trigger, 'phase_traj/reset', Trigger.Request())
    assert answer.success
    elsewhere = kept / 'phase_traj_2'
    assert answer.message == f'restarted after 5 frames; written to {elsewhere}'
    assert json.loads((elsewhere / 'chain_code.json').read_text())['frames'] == 5
    assert json.loads(changed.read_text())['frames'] == 3
    send(node, rolled([0, 0, 0]), [1, 1.1, 1.2])
    live.until(lambda: complete(node, 6))
    kept.rename(tmp_path / 'moved')
    kept.write_text('')
    answer = live.call(Trigger, 'phase_traj/reset', Trigger.Request())
    assert not answer.success
    assert answer.message.startswith(
        'restarted after 3 frames; the drive is not saved: cannot write')
    send(node, rolled([0, 0, 0]), [2, 2.1, 2.2])
    live.until(lambda: complete(node, 8))
    said = live.logs().count('the drive is not saved')
    assert stop(node['process']) == 2
    assert live.logs().count('the drive is not saved') == said + 1


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


@pytest.fixture(params=['reset', 'save'])
def busy(domain, tmp_path, request):
    """Return a node that is writing a drive, its executor, the answer, and what ends it."""
    rclpy.init(args=['--ros-args', '-p', f'output_dir:={tmp_path}'])
    node, executor, written = PhaseTrajNode(), SingleThreadedExecutor(), Event()
    executor.add_node(node)
    shown = [node, executor]
    try:
        for index in range(3):
            node._work._on_frame(StampedFrame(
                TEXTURE, 10**18 + index * 10**8, 'mono8', 'camera'))
        writer = node._work._saving._writer
        writer.submit(written.wait)
        client = node.create_client(
            Trigger, f'~/{request.param}', callback_group=ReentrantCallbackGroup())
        assert client.wait_for_service(10.0)
        answer = client.call_async(Trigger.Request())
        for _ in range(200):
            if writer._work_queue.qsize():
                break
            executor.spin_once(timeout_sec=0.05)
        shown += [answer, written]
        yield shown
    finally:
        written.set()
        executor.shutdown()
        node.destroy_node()
        rclpy.shutdown()
        # Its participant would stay in the domain, for the next test in this process.
        shown.clear()
        node = executor = client = answer = writer = None
        gc.collect()


def test_images_are_taken_while_a_drive_is_written(busy):
    node, executor, answer, written = busy
    # Like the images, in the usual group of callbacks.
    taken = []
    node.create_timer(0.01, lambda: taken.append(True))
    for _ in range(200):
        if taken:
            break
        executor.spin_once(timeout_sec=0.05)
    assert taken and not answer.done()
    written.set()
    executor.spin_until_future_complete(answer, 10.0)
    assert answer.result().success


def test_a_service_that_has_gone_does_not_answer(busy):
    node, executor, answer, written = busy
    released = Timer(0.2, written.set)
    released.start()
    node._drop_work()
    released.join()
    for _ in range(5):
        executor.spin_once(timeout_sec=0.05)
    assert not answer.done()
