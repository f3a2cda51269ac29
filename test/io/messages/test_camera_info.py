# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Calibrations from CameraInfo messages of rclpy, and of rosbags for ROS 2 and ROS 1."""

import numpy as np
from phase_traj_ros.core.camera.model import CameraModel, Distortion
from phase_traj_ros.errors import CalibrationError, PhaseTrajError
from phase_traj_ros.io import EVERYTHING, FrameSource
from phase_traj_ros.io.messages.camera_info import camera_from_info, camera_info_fields
from phase_traj_ros.topics import camera_info_topic
import pytest

K = (700.0, 0.0, 652.5, 0.0, 710.0, 350.0, 0.0, 0.0, 1.0)
P = (600.0, 0.0, 640.0, -72.0, 0.0, 605.0, 360.0, 0.0, 0.0, 0.0, 1.0, 0.0)
D = (-0.3, 0.1, 0.001, -0.002, 0.01)


@pytest.fixture(params=['rclpy', 'ROS2_JAZZY', 'ROS1_NOETIC'])
def info(request):
    """Return a maker of messages, of each kind in turn."""
    if request.param == 'rclpy':
        return rclpy_info
    typesys = pytest.importorskip('rosbags.typesys')
    types = typesys.get_typestore(typesys.Stores[request.param]).types

    def make(**fields):
        return rosbags_info(types, upper=request.param.startswith('ROS1'), **fields)
    return make


def rclpy_info(*, roi=(0, 0, 0, 0), **fields):
    messages = pytest.importorskip('sensor_msgs.msg')
    x, y, width, height = roi
    region = messages.RegionOfInterest(x_offset=x, y_offset=y, width=width, height=height)
    values = {'k': K, 'p': P, 'd': D, 'width': 1280, 'height': 720,
              'distortion_model': 'plumb_bob', **fields}
    return messages.CameraInfo(roi=region, **values)


def rosbags_info(
    types, *, upper, roi=(0, 0, 0, 0), k=K, p=P, d=D, width=1280, height=720,
    distortion_model='plumb_bob', binning_x=0, binning_y=0,
):
    x, y, roi_width, roi_height = roi
    time = types['builtin_interfaces/msg/Time'](sec=1, nanosec=2)
    header = types['std_msgs/msg/Header'](
        stamp=time, frame_id='camera', **({'seq': 0} if upper else {}))
    region = types['sensor_msgs/msg/RegionOfInterest'](
        x_offset=x, y_offset=y, width=roi_width, height=roi_height, do_rectify=False)
    matrices = {'d': d, 'k': k, 'r': np.eye(3).ravel(), 'p': p}
    return types['sensor_msgs/msg/CameraInfo'](
        header=header, height=height, width=width, distortion_model=distortion_model,
        binning_x=binning_x, binning_y=binning_y, roi=region,
        **{name.upper() if upper else name: np.array(value, np.float64)
           for name, value in matrices.items()})


def test_raw_images(info):
    assert camera_from_info(info(), rectified=False) == CameraModel(
        width=1280, height=720, fx=700.0, fy=710.0, cx=652.5, cy=350.0,
        distortion=Distortion.BROWN, coefficients=D)


def test_rectified_images(info):
    assert camera_from_info(info(), rectified=True) == CameraModel(
        width=1280, height=720, fx=600.0, fy=605.0, cx=640.0, cy=360.0)
    # Unused values may be unknown.
    message = info(k=(0.0,) * 9, distortion_model='acme')
    assert camera_from_info(message, rectified=True).fx == 600.0


@pytest.mark.parametrize(('name', 'coefficients', 'expected'), [
    ('plumb_bob', D[:4], Distortion.BROWN),
    ('plumb_bob', (*D, 0.1, 0.2, 0.3), Distortion.BROWN),
    ('rational_polynomial', (*D, 0.1, 0.2, 0.3), Distortion.BROWN),
    ('rational_polynomial', (*D, 0.1, 0.2, 0.3, *[0.001] * 6), Distortion.BROWN),
    ('equidistant', D[:4], Distortion.FISHEYE),
    ('fisheye', D[:4], Distortion.FISHEYE),
    # Zeros are the ideal lens of a model; that of equidistant is not a pinhole.
    ('equidistant', (0.0,) * 4, Distortion.FISHEYE),
    ('plumb_bob', (0.0,) * 5, Distortion.NONE),
    ('rational_polynomial', (0.0,) * 8, Distortion.NONE),
    ('plumb_bob', (), Distortion.NONE),
    ('', (), Distortion.NONE),
    ('', (0.0,) * 5, Distortion.NONE),
])
def test_distortion_models(info, name, coefficients, expected):
    camera = camera_from_info(info(distortion_model=name, d=coefficients), rectified=False)
    assert camera.distortion is expected
    assert camera.coefficients == (() if expected is Distortion.NONE else coefficients)


@pytest.mark.parametrize('rectified', [False, True])
def test_part_of_the_sensor(info, rectified):
    roi = (100, 40, 640, 480)
    whole, part = (
        camera_from_info(info(roi=each), rectified=rectified) for each in ((0, 0, 0, 0), roi))
    assert (part.width, part.height) == (640, 480)
    assert (part.fx, part.fy) == (whole.fx, whole.fy)
    assert (part.cx, part.cy) == (whole.cx - 100, whole.cy - 40)
    assert part.coefficients == whole.coefficients
    explicit = camera_from_info(info(roi=(0, 0, 1280, 720)), rectified=rectified)
    assert explicit == whole


@pytest.mark.parametrize('rectified', [False, True])
@pytest.mark.parametrize('roi', [(0, 0, 0, 0), (101, 40, 643, 480)])
def test_binned_images_are_averages_of_the_whole_ones(info, rectified, roi):
    whole, binned = (
        camera_from_info(info(roi=roi, **each), rectified=rectified)
        for each in ({'binning_x': 1}, {'binning_x': 4, 'binning_y': 2}))
    assert (binned.width, binned.height) == (whole.width // 4, whole.height // 2)
    assert (binned.fx, binned.fy) == (whole.fx / 4, whole.fy / 2)
    x, y = np.array([-0.3, 0.0, 0.1]), np.array([0.1, 0.0, -0.2])
    fine, coarse = (each.project(x, y, np.ones(3)) for each in (whole, binned))
    # A pixel of the binned image covers 4 columns and 2 rows, and is where their mean is.
    assert coarse.columns * 4 + 1.5 == pytest.approx(fine.columns)
    assert coarse.rows * 2 + 0.5 == pytest.approx(fine.rows)


@pytest.mark.parametrize(('fields', 'rectified', 'message'), [
    ({'k': (0.0,) * 9}, False, r'not calibrated \(K\[0\] of the camera_info is 0\): calibrate it'),
    ({'p': (0.0,) * 12}, True, r'not calibrated \(P\[0\] .*\): .*give focal_px'),
    ({'k': (0.0, *K[1:])}, False, 'not calibrated'),
    ({'distortion_model': 'acme_lens'}, False,
     "model 'acme_lens' of the camera_info is unknown .*equidistant.*: give focal_px, or rectify"),
    ({'distortion_model': ''}, False, "model '' of the camera_info is unknown"),
    ({'distortion_model': 'acme', 'd': ()}, False, "'acme'"),
    ({'d': D[:3]}, False, '3 distortion coefficients: give 4, 5, 8, 12 or 14'),
    ({'distortion_model': 'equidistant', 'd': ()}, False, '0 distortion .*give 4 coefficients'),
    ({'d': (*D[:4], float('nan'))}, False, 'give finite numbers'),
    ({'k': (-700.0, *K[1:])}, False, 'camera_info cannot be used: fx is -700.0'),
    ({'p': (*P[:5], float('nan'), *P[6:])}, True, 'fy is nan'),
    ({'width': 0, 'height': 0}, False, '0x0 pixels'),
    ({'roi': (700, 0, 640, 480)}, False, r'640x480 pixels at \(700, 0\), extends beyond'),
    ({'roi': (0, 300, 640, 480)}, True, 'beyond the 1280x720 pixels'),
    ({'roi': (5, 5, 0, 0)}, False, '0x0 pixels'),
    ({'binning_x': 2000}, False, '0x720 pixels'),
])
def test_errors(info, fields, rectified, message):
    with pytest.raises(CalibrationError, match=message) as caught:
        camera_from_info(info(**fields), rectified=rectified)
    assert '\n' not in str(caught.value)
    assert isinstance(caught.value, PhaseTrajError)


@pytest.mark.parametrize(('image', 'expected'), [
    ('/camera/image_raw', '/camera/camera_info'),
    ('/camera/image_raw/compressed', '/camera/camera_info'),
    ('/front/left/image_rect/theora', '/front/left/camera_info'),
    ('/camera/depth/image_raw/compressedDepth', '/camera/depth/camera_info'),
    ('/image', '/camera_info'),
    ('image', '/camera_info'),
    ('/compressed', '/camera_info'),
    ('/image/compressed', '/camera_info'),
    ('/camera//image_raw/', '/camera/camera_info'),
])
def test_topic_beside_that_of_the_images(image, expected):
    assert camera_info_topic(image) == expected


def test_sources_have_no_camera_by_default():
    class Source(FrameSource):

        def _candidates(self):
            yield from ()

    source = Source(description='nothing', selection=EVERYTHING, frame_count=None)
    assert source.camera(rectified=False) is None


@pytest.mark.parametrize(('distortion', 'coefficients'), [
    (Distortion.NONE, ()), (Distortion.BROWN, D), (Distortion.BROWN, (*D, 0.1, 0.2, 0.3)),
    (Distortion.FISHEYE, D[:4])])
def test_what_is_published_is_what_is_read(distortion, coefficients):
    messages = pytest.importorskip('sensor_msgs.msg')
    camera = CameraModel(
        width=640, height=480, fx=500.0, fy=510.0, cx=320.5, cy=239.0, distortion=distortion,
        coefficients=coefficients)
    message = messages.CameraInfo(**camera_info_fields(camera))
    assert camera_from_info(message, rectified=False) == camera
    if distortion is Distortion.NONE:
        assert camera_from_info(message, rectified=True) == camera
        return
    with pytest.raises(CalibrationError, match='not calibrated'):
        camera_from_info(message, rectified=True)
    # Both at once, as a driver has it.
    rectified = CameraModel(width=640, height=480, fx=450.0, fy=460.0, cx=310.0, cy=240.0)
    both = messages.CameraInfo(**camera_info_fields(camera, rectified=rectified))
    assert camera_from_info(both, rectified=True) == rectified
    assert camera_from_info(both, rectified=False) == camera
