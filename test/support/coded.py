# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What tests send to a live node by the rule of the paper, and the codes that come back."""

from geometry_msgs.msg import Vector3Stamped
from live import image, SHIFT
from phase_traj_ros.ros.playback.live_run import lossless_overrides
from sensor_msgs.msg import Image
from std_msgs.msg import String, UInt8
from std_srvs.srv import Trigger
from test_node import SECOND, START


KINDS = {'movement': UInt8, 'status': String, 'shift': Vector3Stamped}


def started(live, *arguments, kind=Image, topic='image', lossless=True):
    """Start a node; return its codes as they come, its process, and a camera for it."""
    node = {name: live.listen(message, f'phase_traj/{name}') for name, message in KINDS.items()}
    overrides = lossless_overrides(live.node.resolve_topic_name(topic)) if lossless else []
    node['process'] = live.start(*SHIFT, *arguments, *overrides, lossless=False)
    restart(live, node)
    node['camera'] = live.camera(topic, kind=kind)
    return node


def restart(live, node):
    """Reset the node, and forget the codes so far."""
    live.call(Trigger, 'phase_traj/reset', Trigger.Request())
    for name in KINDS:
        node[name].clear()


def send(node, frames, stamps):
    """Send frames with stamps in seconds."""
    for frame, stamp in zip(frames, stamps):
        node['camera'].publish(image(frame, round(START + stamp * SECOND)))


def complete(node, pairs):
    """Tell whether all that belongs to so many pairs has come; topics overtake each other."""
    return all(len(node[name]) == pairs for name in KINDS)


def codes(node):
    """Return the movement codes and the statuses."""
    return [each.data for each in node['movement']], [each.data for each in node['status']]
