# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Adds judged pairs to the heading, the codes, the distance and the path."""

from collections import deque
from dataclasses import replace

from phase_traj_ros.core.camera.in_use import CameraInUse
from phase_traj_ros.core.camera.lens import Lens
from phase_traj_ros.core.coding import Coder
from phase_traj_ros.core.distance_meter import DistanceMeter
from phase_traj_ros.core.heading.turns import Turn
from phase_traj_ros.core.heading.visual_compass import HeadingUpdate, VisualCompass
from phase_traj_ros.core.judge import Verdict
from phase_traj_ros.core.measuring import Comparison, KnownMotion
from phase_traj_ros.core.path.trajectory import Corner
from phase_traj_ros.core.reliability.monitor import ReliabilityMonitor
from phase_traj_ros.core.reliability.reason import Evidence, Reason
from phase_traj_ros.core.reliability.verdict import Reliability
from phase_traj_ros.core.road.travel import Travel
from phase_traj_ros.core.route import Route
from phase_traj_ros.core.settings import EstimatorSettings
from phase_traj_ros.core.status import PairStatus
from phase_traj_ros.core.update import Counters, Update


class Integration:
    """
    Accumulates the pairs of a drive.

    Foreseen frames and repeated pictures are added, too; the next measured pair covers their time.
    """

    def __init__(self, settings: EstimatorSettings) -> None:
        """Start without frames, and without a visual compass."""
        self._settings = settings
        self.heading: VisualCompass | None = None
        """The visual compass; None if no lens is known."""
        self.distance_meter = DistanceMeter(settings)
        self.counters = Counters()
        self.trusted: Update | None = None
        """The newest measured update if it is trusted: frames are foreseen from it."""
        # The lens that was reported, and the one that measured the previous pair.
        self._reported_lens: Lens | None = None
        self._measuring_lens: Lens | None = None
        self.reset()

    @property
    def motion(self) -> KnownMotion:
        """Return the motion in the newest pair."""
        return KnownMotion(
            self.distance_meter.heights_per_second,
            0.0 if self.heading is None else self.heading.tracker.rate)

    @property
    def reliability(self) -> Reliability:
        """Return the reliability of the last minute and of the drive."""
        return self._monitor.verdict(camera_reason=self._camera_reason)

    def repeat_stamp(self, count: int) -> None:
        """Count frames that are not used because their stamp equals the previous one."""
        self.counters.repeated += count
        self._monitor.add_unused(Reason.FROZEN, count)

    def skip(self) -> None:
        """Count a frame that cannot be used."""
        self.counters.skipped += 1
        self._monitor.add_unused(Reason.FRAMES_LOST)

    def reconfigure(self, settings: EstimatorSettings) -> None:
        """Continue with other settings."""
        self._settings = settings
        self.trusted = None
        self.distance_meter.reconfigure(settings)
        self.coder.reconfigure(settings)

    def reset(self) -> None:
        """Restart with the next frame: no codes, no path, direction forward."""
        self.coder = Coder(self._settings)
        self.route = Route(self._settings)
        self.turns: deque[Turn] = deque(maxlen=self._settings.max_runs)
        """The turns that have ended, oldest first."""
        if self.heading is not None:
            self.heading.restart()
        self.distance_meter.reset()
        self.frames = 0
        """Number of frames since the last reset."""
        self._monitor = ReliabilityMonitor()
        self.trusted = None
        # Number of the newest measured frame, and the update of the newest frame, relative to it,
        # if foreseen.
        self._measured_frame = 0
        self._foreseen: Update | None = None

    def count_frame(self) -> None:
        """Count a frame; its pair is added next."""
        self.frames += 1
        self.counters.frames += 1

    def start(self, stamp_ns: int) -> None:
        """Start with the first frame."""
        self._measured_frame = self.frames
        self.route.start(stamp_ns)
        if self.heading is not None:
            self.heading.start(stamp_ns)

    def begin_scene(self) -> None:
        """Separate the pair that is added next from those before a cut in the video."""
        self.distance_meter.reset()
        if self.heading is not None:
            self.heading.cut()

    def add(
        self, pair: Comparison, verdict: Verdict, stamp_ns: int, interval_ns: int, *,
        interval_deviation: float,
    ) -> Update:
        """
        Add a judged pair; ``interval_deviation`` is the standard deviation of its interval, in s.

        The update is relative to the newest frame, also if that was foreseen.
        """
        interval = interval_ns * 1e-9
        self._follow_lens()
        travel = None if self.heading is None else self.distance_meter.update(
            pair.travel, verdict.status, stamp_ns, interval_ns)
        # Before the pair is learned from: its distance is that of the camera before.
        camera_known = self._knows_camera(travel)
        heading = self._add_heading(verdict, stamp_ns, interval)
        self.counters.count(verdict.status)
        step = self.coder.code(verdict.status, pair.dx, heading, interval)
        status = verdict.status.coded(step)
        turned = None if heading is None else heading.step
        odometry, links = self.route.add(
            step, turned, travel, stamp_ns, interval_ns, interval_deviation=interval_deviation)
        cut = pair.cut and self._settings.guards
        self._monitor.add(
            verdict.evidence, stamp_ns, interval_ns,
            seen=verdict.status in (PairStatus.OK, PairStatus.STILL),
            stands=verdict.status is PairStatus.STILL, travel=travel,
            near=0.0 if pair.yaw is None or pair.yaw.motion is None else pair.yaw.motion.near,
            metric=self._settings.metric, camera_known=camera_known,
            contradicted=self._settings.guards and heading is not None and heading.contradicts,
            cut=pair.cut, frames=self.frames - self._measured_frame,
            missed=turned.missed if turned is not None and self._settings.by_heading else 0.0)
        whole = Update(
            self.frames - 2, stamp_ns, interval_ns, pair.shift, step, status,
            self._tip, turned, () if heading is None else heading.turns, self._camera_change(),
            cut, odometry, travel, links,
            self.route.way.speed,
            None if travel is None or not travel.known else travel.variance / interval ** 2)
        foreseen, self._foreseen, self._measured_frame = self._foreseen, None, self.frames
        self.trusted = whole if verdict.evidence is Evidence.TRUSTED else None
        return whole.after(foreseen)

    def foresee(self, stamp_ns: int, waited_ns: int, interval_ns: int) -> Update:
        """Add a frame that is not measured; the next pair covers its time."""
        newest, heading = self.trusted, self.heading
        assert newest is not None and newest.shift is not None and heading is not None
        ahead = heading.foresee(waited_ns * 1e-9)
        status = PairStatus.STILL if newest.status is PairStatus.STILL else PairStatus.OK
        self.counters.count(status)
        step = self.coder.code(status, 0.0, ahead, interval_ns * 1e-9)
        dx = heading.camera.shift_by(ahead.step.yaw * heading.camera.tilt)
        share = waited_ns / newest.interval_ns
        travel = newest.travel and newest.travel.part(share * newest.travel.distance, share)
        odometry = self.route.foresee(step, ahead.step, travel, stamp_ns, waited_ns)
        before, self._foreseen = self._foreseen, replace(
            newest, pair=self.frames - 2, stamp_ns=stamp_ns, interval_ns=waited_ns,
            shift=replace(newest.shift, dx=dx, dy=0.0), step=step, status=status.coded(step),
            tip=self._tip, heading=ahead.step, turns=(), camera=self._camera_change(), cut=False,
            odometry=odometry, travel=travel, links=())
        return self._foreseen.after(before)

    def repeat(self, stamp_ns: int, interval_ns: int) -> Update:
        """Add a frame that repeats a picture; the next pair covers its time."""
        status = PairStatus.REPEATED
        self.counters.count(status)
        self._monitor.add(Evidence.REPEATED, stamp_ns, interval_ns)
        heading = None
        if self.heading is not None:
            # The heading stays that of the previous frame, which may be foreseen.
            heading = self.heading.tracker.foresee(0.0, 0.0)
            if self._foreseen is not None and self._foreseen.heading is not None:
                heading = replace(heading, heading=self._foreseen.heading.heading)
        step = self.coder.code(status, None, None, interval_ns * 1e-9)
        return Update(
            self.frames - 2, stamp_ns, interval_ns, None, step, status, self._tip, heading,
            camera=self._camera_change())

    def _add_heading(
        self, verdict: Verdict, stamp_ns: int, interval: float,
    ) -> HeadingUpdate | None:
        """Add the yaw of the pair to the heading, if the heading is measured."""
        if self.heading is None:
            return None
        speed = self.distance_meter.heights_per_second
        update = self.heading.add(
            verdict.yaw, stamp_ns, interval,
            distance=None if speed is None else abs(speed) * interval,
            frames=self.frames - self._measured_frame)
        self.turns.extend(update.turns)
        return update

    def _follow_lens(self) -> None:
        """Correct the height of the camera if another lens has measured this pair."""
        if self.heading is None or self.heading.camera.lens is self._measuring_lens:
            return
        camera, before = self.heading.camera, self._measuring_lens
        self._measuring_lens = camera.lens
        if before is not None:
            self.distance_meter.change_lens(before, camera.lens, camera.width)

    def _knows_camera(self, travel: Travel | None) -> bool:
        """Return whether the camera is known well enough for a distance, or need not be."""
        if travel is None or not travel.by_road or self._settings.camera_height == 0.0:
            return True
        assert self.heading is not None and self.heading.camera.in_use is not None
        return self.heading.camera.in_use.settled

    @property
    def _camera_reason(self) -> Reason | None:
        """Return why the camera is not known well enough for the turns so far; None if it is."""
        if not self._settings.by_heading or self.heading is None:
            return None
        if self.heading.camera.contradicted:
            return Reason.CAMERA_CONTRADICTED
        return Reason.CAMERA_NOT_KNOWN if self.heading.lacks_camera else None

    @property
    def _tip(self) -> Corner:
        tip = self.route.drawn.tip
        assert tip is not None
        return tip

    def _camera_change(self) -> CameraInUse | None:
        """Return the camera if it has changed since the last report."""
        if self.heading is None or self.heading.camera.lens is self._reported_lens:
            return None
        self._reported_lens = self.heading.camera.lens
        return self.heading.camera.in_use
