# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What is said where images are on another topic."""

from phase_traj_ros.ros.graph import COMPRESSED, elsewhere, RAW
import pytest


@pytest.mark.parametrize(('topic', 'kind', 'topics', 'said'), [
    ('/image', RAW, {}, 'no node publishes images'),
    ('/image', RAW, {'/image/compressed': COMPRESSED, '/other': RAW},
     'images are on /image/compressed: remap image, as in -r image:=/image, with'
     ' image_transport compressed'),
    ('/image/compressed', COMPRESSED, {'/image': RAW},
     'images are on /image: remap image, as in -r image:=/image, with image_transport raw'),
    ('/image', RAW, {'/cam/image_raw': RAW, '/cam/image_raw/compressed': COMPRESSED},
     'images are on /cam/image_raw: remap image, as in -r image:=/cam/image_raw, with'
     ' image_transport raw'),
    ('/image', RAW, {'/cam/image/compressed': COMPRESSED},
     'images are on /cam/image/compressed: remap image, as in -r image:=/cam/image, with'
     ' image_transport compressed'),
])
def test_where_images_are_is_said_with_what_to_write(topic, kind, topics, said):
    assert elsewhere(topic, kind, topics) == said
