# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The renderer against the pinhole model."""

from dataclasses import replace

import cv2
import numpy as np
from phase_traj_ros.synthetic import Camera, KITTI_CAMERA, named_drive, Pose, render, Scene
from phase_traj_ros.synthetic.camera import (
    BODY_TO_PICTURE,
    EQUIDISTANT,
    EQUISOLID,
    fisheye_radius,
    rotation,
    STEREOGRAPHIC,
)
from phase_traj_ros.synthetic.scene.scene import Panel, Panels
import pytest

SMALL = Camera.with_field_of_view(320, 120, 80.0)
#: Far brighter, or darker, than everything else in an image.
(WHITE, BLACK) = (1000.0, 0.0)


def wall(start, end, base, top, gain, reach=300.0):
    return Panel(start, end, base, top, texture=0, gain=gain, reach=reach)


def scene_of(scene: Scene, *panels: Panel) -> Scene:
    return replace(scene, panels=Panels.of(panels))


def project(camera, pose, point):
    """Return (column, row) of a point (x, y, z) in the world."""
    offset = np.array(point) - (pose.x, pose.y, camera.above_ground)
    body = rotation(pose.yaw, pose.pitch, pose.roll).T @ offset
    (x, y, z) = camera.matrix() @ BODY_TO_PICTURE @ body
    return (x / z, y / z)


def box(picture):
    """Return the first and last columns and rows that are white, ignoring the lens blur."""
    (rows, columns) = np.nonzero(picture >= 230)
    return (columns.min(), columns.max(), rows.min(), rows.max())


@pytest.mark.parametrize('pose', [
    Pose(0, 0, 0), Pose(3, -2, 0.2), Pose(0, 1, -0.25), Pose(0, 0, 0, 0.03, 0),
    Pose(0, 0, 0.1, -0.04, 0), Pose(-2, 1, 0.05, 0.02, 0)])
def test_corners_of_a_wall_are_where_a_pinhole_camera_sees_them(demo_scene, pose):
    # Across the view at yaw 0; behind it, black all round, so that nothing else is white.
    (near, far) = ((20.0, 4.0), (20.0, -3.0))
    scene = scene_of(
        demo_scene, wall(near, far, 0.5, 4.0, WHITE),
        wall((60.0, 90.0), (60.0, -90.0), 0.0, 40.0, BLACK))
    picture = render(scene, KITTI_CAMERA, pose)
    corners = np.array([
        project(KITTI_CAMERA, pose, (*end, height)) for end in (near, far)
        for height in (0.5, 4.0)])
    (left, right, top, bottom) = box(picture[:250])
    # The centre of a pixel decides whether it is white; a tilted image is also interpolated.
    slack = 1.1 if pose.pitch == 0 else 2.0
    assert left == pytest.approx(corners[:, 0].min(), abs=slack)
    assert right == pytest.approx(corners[:, 0].max(), abs=slack)
    assert top == pytest.approx(corners[:, 1].min(), abs=slack)
    assert bottom == pytest.approx(min(corners[:, 1].max(), 249), abs=slack)


def test_a_rolled_camera_sees_the_wall_rolled_the_other_way(demo_scene):
    scene = scene_of(
        demo_scene, wall((20.0, 4.0), (20.0, -3.0), 0.5, 4.0, WHITE),
        wall((60.0, 90.0), (60.0, -90.0), 0.0, 40.0, BLACK))
    pose = Pose(0, 0, 0, 0.0, 0.05)
    picture = render(scene, KITTI_CAMERA, pose)
    inside = project(KITTI_CAMERA, pose, (20.0, 3.8, 3.8))
    outside = project(KITTI_CAMERA, pose, (20.0, 3.8, 4.2))
    for ((column, row), white) in ((inside, True), (outside, False)):
        assert (picture[round(row), round(column)] >= 250) == white
    # Right side down: the left end of the wall is lower in the picture than the right one.
    columns = [round(project(KITTI_CAMERA, pose, (20.0, y, 4.0))[0]) for y in (3.5, -2.5)]
    (left, right) = ((picture[:, column] >= 250).argmax() for column in columns)
    assert left > right + 3


@pytest.mark.parametrize('degrees', [-4.0, -1.0, 0.5, 3.0])
def test_yaw_shifts_the_centre_of_the_picture_by_f_tan(demo_scene, degrees):
    scene = scene_of(
        demo_scene, wall((100.0, 0.0), (100.0, -1.0), 0.0, 12.0, WHITE),
        wall((110.0, 90.0), (110.0, -90.0), 0.0, 40.0, BLACK))
    yaw = np.radians(degrees)
    turned = box(render(scene, KITTI_CAMERA, Pose(0, 0, yaw))[:180])[0]
    straight = box(render(scene, KITTI_CAMERA, Pose(0, 0, 0))[:180])[0]
    # The camera turns left, what it sees moves right.
    assert turned - straight == pytest.approx(KITTI_CAMERA.focal * np.tan(yaw), abs=1.0)


def test_forward_motion_expands_the_picture_about_the_horizon(demo_scene):
    scene = scene_of(
        demo_scene, wall((30.0, 5.0), (30.0, -5.0), 0.0, 5.0, WHITE),
        wall((110.0, 90.0), (110.0, -90.0), 0.0, 40.0, BLACK))
    (far, near) = (
        box(render(scene, KITTI_CAMERA, Pose(x, 0, 0))[:185]) for x in (0.0, 10.0))
    (cx, cy) = (KITTI_CAMERA.cx, KITTI_CAMERA.cy)
    for (before, after, centre) in zip(far[:3], near[:3], (cx, cx, cy)):
        assert after - centre == pytest.approx(1.5 * (before - centre), abs=2.5)


def test_the_nearer_wall_hides_and_a_low_one_does_not_hide_what_is_above(demo_scene):
    high = wall((30.0, 20.0), (30.0, -20.0), 0.0, 12.0, WHITE)
    low = wall((10.0, 20.0), (10.0, -20.0), 0.0, 1.2, BLACK)
    column = render(scene_of(demo_scene, low, high), SMALL, Pose(0, 0, 0))[:, 160]
    top_of_low = round(SMALL.cy + SMALL.focal * (SMALL.above_ground - 1.2) / 10)
    foot_of_low = round(SMALL.cy + SMALL.focal * SMALL.above_ground / 10)
    foot_of_high = round(SMALL.cy + SMALL.focal * SMALL.above_ground / 30)
    assert foot_of_high > top_of_low
    assert (column[20:top_of_low - 1] >= 250).all()
    assert (column[top_of_low + 2:foot_of_low - 2] < 30).all()


def test_a_crown_hides_only_what_is_behind_it(demo_scene):
    behind = wall((30.0, 20.0), (30.0, -20.0), 0.0, 12.0, WHITE)
    floating = wall((10.0, 20.0), (10.0, -20.0), 2.0, 3.0, BLACK)
    column = render(scene_of(demo_scene, floating, behind), SMALL, Pose(0, 0, 0))[:, 160]
    (top, bottom) = (
        round(SMALL.cy - SMALL.focal * (z - SMALL.above_ground) / 10) for z in (3.0, 2.0))
    assert (column[top + 2:bottom - 2] < 30).all()
    assert (column[bottom + 2:round(SMALL.cy)] >= 250).all()
    assert (column[10:top - 2] >= 250).all()


def test_nothing_is_drawn_behind_the_camera_or_out_of_reach(demo_scene):
    empty = render(scene_of(demo_scene), SMALL, Pose(0, 0, 0))
    for panel in (
            wall((-5.0, 5.0), (-5.0, -5.0), 0.0, 5.0, WHITE),
            wall((100.0, 5.0), (100.0, -5.0), 0.0, 5.0, WHITE, reach=90.0)):
        np.testing.assert_array_equal(
            render(scene_of(demo_scene, panel), SMALL, Pose(0, 0, 0)), empty)


def test_a_wall_that_passes_the_camera_is_cut_at_its_plane(demo_scene):
    beside = wall((-50.0, 6.0), (50.0, 6.0), 0.0, 12.0, WHITE)
    picture = render(scene_of(demo_scene, beside), SMALL, Pose(0, 0, 0))
    assert (picture[30:60, :60] >= 250).all()
    assert not (picture[:60, 170:] >= 250).any()


def test_the_sky_is_infinitely_far_away(demo_scene):
    empty = scene_of(demo_scene)
    (here, there) = (render(empty, SMALL, Pose(x, x, 0.3))[:50] for x in (0.0, 50.0))
    np.testing.assert_array_equal(here, there)
    assert (here != render(empty, SMALL, Pose(0, 0, 0.5))[:50]).any()


def test_the_sky_closes_after_a_whole_turn(demo_scene):
    empty = scene_of(demo_scene)
    pictures = [
        render(empty, SMALL, Pose(0, 0, 1.0 + turns * 2 * np.pi))[:50].astype(int)
        for turns in (-2, 0, 3)]
    assert max(np.abs(picture - pictures[1]).max() for picture in pictures) <= 1


def test_the_ground_moves_as_the_pinhole_camera_says(demo_scene):
    # Half a metre forward: what was in the row of 6.5 m is in that of 6 m.
    empty = scene_of(demo_scene)
    (before, after) = (
        render(empty, KITTI_CAMERA, Pose(x, 0.0, 0.0)).astype(np.float64) for x in (0.0, 0.5))

    def row(picture, distance):
        """Return the ground straight ahead at this distance, every 2 cm for 2 m to each side."""
        focal = KITTI_CAMERA.focal
        line = KITTI_CAMERA.cy + focal * KITTI_CAMERA.above_ground / distance
        columns = KITTI_CAMERA.cx + focal * np.arange(-2, 2, 0.02) / distance
        low = int(line)
        values = picture[low] * (low + 1 - line) + picture[low + 1] * (line - low)
        return np.interp(columns, np.arange(KITTI_CAMERA.width), values)

    same = np.corrcoef(row(before, 8.0), row(after, 7.5))[0, 1]
    other = np.corrcoef(row(before, 8.0), row(after, 8.0))[0, 1]
    assert same > 0.8
    assert same > other + 0.4


def test_images_are_the_same_in_every_run(demo_drive, demo_scene):
    again = named_drive('demo').build_scene()
    pose = demo_drive.pose(45)._replace(pitch=0.01, roll=-0.01)
    first = render(demo_scene, demo_drive.camera, pose)
    np.testing.assert_array_equal(first, render(demo_scene, demo_drive.camera, pose))
    np.testing.assert_array_equal(first, render(again, demo_drive.camera, pose))


def test_pictures_look_like_a_street(demo_drive, demo_scene):
    for frame in (0, 60, 120, 200):
        picture = render(demo_scene, demo_drive.camera, demo_drive.pose(frame))
        assert picture.shape == (376, 1241)
        assert picture.dtype == np.uint8
        assert picture.std() > 30
        assert 50 < picture.mean() < 160
        # Neither saturated nor black.
        assert ((picture > 5) & (picture < 250)).mean() > 0.8


@pytest.mark.parametrize('fisheye', [STEREOGRAPHIC, EQUIDISTANT, EQUISOLID])
@pytest.mark.parametrize('pose', [
    Pose(0, 0, 0), Pose(0, 0, 0.7), Pose(0, 0, -0.9, 0.2, 0.1), Pose(0, 0, 0.55, -0.15, 0)])
def test_a_fisheye_sees_a_wall_where_its_lens_puts_it(demo_scene, fisheye, pose):
    camera = Camera.with_field_of_view(320, 240, 130.0, fisheye=fisheye)
    # A small white square, and black all round.
    scene = scene_of(
        demo_scene, wall((20.0, 0.8), (20.0, -0.8), 3.0, 4.6, WHITE),
        *[wall((90.0 * x, 90.0 * y), (90.0 * y, -90.0 * x), 0.0, 400.0, BLACK)
          for (x, y) in ((1, 1), (1, -1), (-1, -1), (-1, 1))])
    (rows, columns) = np.nonzero(render(scene, camera, pose) >= 230)
    # Its middle is straight ahead of where the vehicle began.
    turned = rotation(pose.yaw, pose.pitch, pose.roll).T
    (x, y, z) = BODY_TO_PICTURE @ turned @ (20.0, 0.0, 3.8 - camera.above_ground)
    radius = camera.focal * fisheye_radius(np.arctan2(np.hypot(x, y), z), fisheye)
    column = camera.cx + radius * x / np.hypot(x, y)
    row = camera.cy + radius * y / np.hypot(x, y)
    # Marks on the road are white, too.
    near = np.hypot(columns - column, rows - row) < 14
    assert near.sum() > 40
    assert columns[near].mean() == pytest.approx(column, abs=0.7)
    assert rows[near].mean() == pytest.approx(row, abs=0.7)


def test_a_fisheye_with_hardly_any_view_sees_what_a_pinhole_sees(demo_scene):
    (narrow, plane) = (
        Camera.with_field_of_view(160, 120, 12.0, fisheye=fisheye)
        for fisheye in (EQUIDISTANT, None))
    (one, other) = (
        render(demo_scene, camera, Pose(0, 0, 0.1)).astype(np.float32)
        for camera in (narrow, plane))
    ((dx, dy), response) = cv2.phaseCorrelate(one, other)
    assert (dx, dy) == pytest.approx((0.0, 0.0), abs=0.3)
    assert response > 0.7
