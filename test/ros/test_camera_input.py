# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The calibration that the node listens to."""

from types import SimpleNamespace

from phase_traj_ros.ros.inputs.camera import CameraInput
import pytest


@pytest.mark.parametrize(('images', 'rectified', 'warns'), [
    ('/front/image_raw', False, False), ('/front/image_rect', False, True),
    ('/front/image_rect_color', False, True), ('/front/image_rect', True, False)])
def test_rectified_images_that_are_taken_for_raw_ones_are_warned_of(images, rectified, warns):
    said = []
    node = SimpleNamespace(
        resolve_topic_name=lambda name, *, only_expand=False: (
            images if name == 'image' else f'/{name}'),
        get_logger=lambda: SimpleNamespace(warning=said.append))
    entities = SimpleNamespace(
        create_subscription=lambda kind, topic, *_: SimpleNamespace(topic_name=topic))
    camera = CameraInput(node, entities, rectified=rectified, on_camera=lambda _: None)
    assert camera.topic == '/front/camera_info'
    assert [images in each for each in said] == [True] * warns
