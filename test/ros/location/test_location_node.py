# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The part of the node that locates: its topics, its input, its errors."""

from itertools import pairwise
import math
from pathlib import Path
import sys
from types import SimpleNamespace

from geometry_msgs.msg import TransformStamped
from made_town import drive, PLANE, write_town
from phase_traj_ros.core import Corner, PairStatus, Travel, TravelState
from phase_traj_ros.core.heading.tracker import HeadingStep
from phase_traj_ros.core.path.odometry import Odometry
from phase_traj_ros.errors import MapError, ParameterError
from phase_traj_ros.io.messages.diagnostics import Level
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.ros.entities import Entities
from phase_traj_ros.ros.location import location as module
from phase_traj_ros.ros.location.location import Location
from phase_traj_ros.ros.outputs.messages import MESSAGES
from phase_traj_ros.ros.outputs.transform import MapTransform
import pytest
import rclpy
from sensor_msgs.msg import NavSatFix, NavSatStatus
from told_locator import ToldLocator

DATUM = f'{PLANE.latitude},{PLANE.longitude}'


@pytest.fixture
def node():
    context = rclpy.Context()
    rclpy.init(context=context)
    made = rclpy.create_node('phase_traj', context=context)
    yield made
    made.destroy_node()
    context.try_shutdown()


class Sent(Entities):
    """Makes entities, and keeps what is published."""

    def __init__(self, node):
        super().__init__(node)
        self.messages = {}

    def create_publisher(self, kind, topic, *args, **options):
        super().create_publisher(kind, topic, *args, **options)
        kept = self.messages.setdefault(topic, [])
        return SimpleNamespace(publish=kept.append, get_subscription_count=lambda: 1)


@pytest.fixture
def town(tmp_path):
    return str(write_town(tmp_path / 'town.osm'))


@pytest.fixture
def made(node, town, monkeypatch):
    """Return a function that makes the location, and what it publishes."""
    locators = []

    def locator(*_, **__):
        locators.append(ToldLocator(tuple(drive()[0])))
        return locators[-1]
    monkeypatch.setattr(module, 'MapLocator', locator)
    closed = []

    def make(**values):
        entities = Sent(node)
        location = Location(node, entities, Parameters(
            map_file=town, map_datum=DATUM, **{'camera_height': 1.6, **values}))
        closed.extend([location.close, entities.destroy])
        return location, entities.messages, locators[-1]
    yield make
    for close in closed:
        close()


def updates(poses):
    """Yield what the estimator says of a drive."""
    for number, (before, after) in enumerate(pairwise(poses)):
        yaw = float(after[2] - before[2])
        distance = math.hypot(*(after[:2] - before[:2]))
        yield SimpleNamespace(
            stamp_ns=(number + 1) * 10**8, interval_ns=10**8, status=PairStatus.OK, cut=False,
            heading=HeadingStep(yaw, 10 * yaw, float(after[2]), False, 1e-6),
            travel=Travel(distance, 1e-4, TravelState.MEASURED),
            odometry=Odometry(
                Corner(distance * (number + 1), 0.0, 0.0, 0), 8.0, 0.1, 0.04, 0.001,
                ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 0.01))))


def run(location, poses):
    """Locate a drive; return after all of it is published."""
    for update in updates(poses):
        location.add(update)
    while location._worker.waiting:
        pass
    location.close()
    location._publish_placed()


def test_what_is_published_of_a_drive(made):
    location, sent, _ = made()
    poses = drive()[:600]
    run(location, poses)

    fixes, odometries = sent['~/fix'], sent['~/odom_map']
    stamps = [each.header.stamp.sec * 10**9 + each.header.stamp.nanosec for each in fixes]
    assert stamps == sorted(stamps) and len(fixes) > 400
    assert fixes[0].status.status == NavSatStatus.STATUS_NO_FIX
    assert math.isnan(fixes[0].latitude)
    assert fixes[-1].status.status == NavSatStatus.STATUS_FIX
    assert len(odometries) == sum(each.status.status >= 0 for each in fixes) > 0
    last, stamp = odometries[-1], stamps[-1]
    assert last.header.frame_id == 'map' and last.child_frame_id == 'base_link'
    # x and y count from the datum, to the east and to the north.
    true = poses[round(stamp / 1e8)]
    assert math.hypot(last.pose.pose.position.x - true[0],
                      last.pose.pose.position.y - true[1]) < 2.0
    east, north = PLANE.to_metres(fixes[-1].latitude, fixes[-1].longitude)
    assert (east, north) == (
        pytest.approx(last.pose.pose.position.x), pytest.approx(last.pose.pose.position.y))
    [roads] = sent['~/roads']
    assert len(roads.markers[0].points) > 100
    location._publish_candidates()
    assert len(sent['~/candidates'][-1].markers) == 3


def test_diagnostics_say_whether_the_place_is_known(made):
    location, _, _ = made()
    before = location.report()
    run(location, drive()[:600])
    after = location.report()

    assert (before.level, before.message) == (Level.OK, 'the place is not known')
    assert (after.level, after.message) == (Level.OK, 'the place is known')
    assert after.values['probability'] == '0.995' and 'latitude' in after.values


def test_a_new_drive_interrupts(made):
    location, _, locator = made()
    for update in list(updates(drive()[:5])):
        location.add(update)
    location.interrupt(10**9)
    while not locator.interruptions:
        pass

    assert locator.interruptions == [(math.inf, math.pi)]


def test_pairs_without_a_distance_are_not_located_and_said(made):
    location, sent, _ = made()
    update, repeated, after = updates(drive()[:4])
    update.travel = None
    repeated.status = PairStatus.REPEATED
    location.add(update)
    location._publish_placed()
    assert sent['~/fix'] == []
    location.add(repeated)
    report = location.report()
    assert report.level == Level.WARN and 'give the camera height' in report.message
    # The height has come.
    location.add(after)
    assert location.report().level == Level.OK


def test_fixes_reach_the_locator(made):
    location, _, locator = made()
    good = NavSatFix(
        latitude=PLANE.latitude, longitude=PLANE.longitude,
        status=NavSatStatus(status=NavSatStatus.STATUS_FIX))
    location._on_fix(NavSatFix(status=NavSatStatus(status=NavSatStatus.STATUS_NO_FIX)))
    location._on_fix(good)
    while not locator.fixes:
        pass

    [fix] = locator.fixes
    assert (fix.x, fix.y) == (pytest.approx(0.0, abs=1e-6), pytest.approx(0.0, abs=1e-6))


def fix_at(stamp_ns):
    """Return a fix at the datum."""
    return NavSatFix(
        latitude=PLANE.latitude, longitude=PLANE.longitude,
        header=MESSAGES.header(stamp_ns, 'gps'),
        status=NavSatStatus(status=NavSatStatus.STATUS_FIX))


def errors_of(location, monkeypatch):
    """Return a list that the errors in the log are appended to."""
    said = []
    monkeypatch.setattr(location, '_node', SimpleNamespace(get_logger=lambda: SimpleNamespace(
        error=lambda line, **_: said.append(line))))
    return said


@pytest.mark.parametrize(('age', 'told'), [
    (6.0, '6.0 s before that of the newest frame'), (-2.0, '2.0 s after that of')])
def test_a_fix_of_another_time_is_refused_and_said(made, monkeypatch, age, told):
    location, _, locator = made()
    said = errors_of(location, monkeypatch)
    drive_by = list(updates(drive()[:100]))
    for update in drive_by:
        location.add(update)
    newest = drive_by[-1].stamp_ns
    for stamp_ns in (newest - round(age * 1e9), newest):
        location._on_fix(fix_at(stamp_ns))
    while not locator.fixes:
        pass

    [fix], [line] = locator.fixes, said
    assert fix.stamp_ns == newest
    assert told in line


def test_between_two_drives_a_fix_of_any_time_is_no_error(made, monkeypatch):
    location, _, _ = made()
    said = errors_of(location, monkeypatch)
    for update in updates(drive()[:20]):
        location.add(update)
    location.interrupt(update.stamp_ns)
    location._on_fix(fix_at(update.stamp_ns + 3600 * 10**9))
    assert said == []


def test_the_height_for_the_transform_may_come_later(made):
    """It comes from /tf_static; the node then makes the location anew."""
    location, sent, _ = made(camera_height=0.0, publish_map_tf=True)
    run(location, drive()[:600])
    assert sent['~/odom_map'] and '/tf' not in sent


def test_the_height_for_the_distance_may_come_later_too():
    Location.check(Parameters(map_file='town.osm', code_source='heading', hfov_deg=80.0))


@pytest.mark.parametrize(('values', 'error', 'message'), [
    ({'threshold': 16.0}, ParameterError, 'it needs the measured heading and distance'),
    ({'map_datum': 'here'}, ParameterError, 'give LAT,LON in degrees'),
    ({'map_datum': '91,0'}, ParameterError, 'give LAT,LON in degrees'),
    ({'map_datum': '-33.9,18.4'}, MapError, 'from the datum -33.9,18.4: give one on the map'),
    ({'map_file': 'absent.osm'}, MapError, 'No such file'),
    ({'frame_id': 'map', 'publish_map_tf': True}, ParameterError, 'the parent that'),
])
def test_wrong_parameters_are_one_clear_line(node, town, values, error, message):
    with pytest.raises(error, match=message) as told, Entities(node) as entities:
        Location(node, entities, Parameters(
            **{'map_file': town, 'camera_height': 1.6, **values}))
    assert '\n' not in str(told.value)


def test_roads_that_have_been_read_are_not_read_again(node, town, made):
    location, *_ = made()
    Path(town).unlink()
    again = Location(node, Sent(node), Parameters(map_file=town), location.roads)
    again.close()
    assert again.roads is location.roads


class TransformMessage(SimpleNamespace):
    """Stands for a tf2_msgs/TFMessage, which the wheels of ROS do not have."""


def test_the_transform_is_silent_beside_another_owner(monkeypatch):
    monkeypatch.setitem(sys.modules, 'tf2_msgs', SimpleNamespace())
    monkeypatch.setitem(
        sys.modules, 'tf2_msgs.msg', SimpleNamespace(TFMessage=TransformMessage))
    sent, heard, errors = [], [], []
    entities = SimpleNamespace(
        create_publisher=lambda *_: SimpleNamespace(publish=sent.append),
        create_subscription=lambda _, topic, callback, qos: heard.append(topic))
    node = SimpleNamespace(get_logger=lambda: SimpleNamespace(error=errors.append))
    transform = MapTransform(node, entities, 'odom')
    header = MESSAGES.header(7, 'map')
    transform.publish(header, MESSAGES.pose_in_plane(1.0, 2.0, 0.5))

    assert heard == ['/tf', '/tf_static']
    [own] = sent[0].transforms
    assert (own.header.frame_id, own.child_frame_id) == ('map', 'odom')
    transform._on_transforms(sent[0])
    assert not transform.other

    # A parent of another frame is nobody's business.
    elsewhere = TransformStamped(header=header, child_frame_id='camera')
    transform._on_transforms(TransformMessage(transforms=[elsewhere]))
    assert not transform.other
    foreign = TransformStamped(header=MESSAGES.header(8, 'map'), child_frame_id='odom')
    transform._on_transforms(TransformMessage(transforms=[foreign]))
    transform.publish(header, MESSAGES.pose_in_plane(1.0, 2.0, 0.5))
    assert transform.other and len(sent) == len(errors) == 1
