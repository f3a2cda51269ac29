# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Schedules the messages that the node publishes and that a bag written offline contains."""


from phase_traj_ros.core import Movement, Update
from phase_traj_ros.core.codes.freeman import AnyDirection
from phase_traj_ros.io.messages.topics import CHAIN_CODE, LINKS, PATH, Topic, whole_topics
from phase_traj_ros.parameters import Parameters

CHAIN_CODE_PERIOD_NS = 10**9
"""The texts of the codes are published when the newest code changes, else at most this often."""

_PATH_PERIOD_NS = 200_000_000

DIAGNOSTICS_PERIOD_NS = 10**9
"""Period of the diagnostics."""


class Pace:
    """Limits a message to one per period, and sends the first at once, by any clock."""

    def __init__(self, period_ns: int) -> None:
        """Make a pace without content to send."""
        self._period_ns = period_ns
        self._due_ns: int | None = None
        self.pending = False
        """Whether there is content that has not been sent."""

    def changed(self, *, urgent: bool = False) -> None:
        """Record that there is new content; urgent content does not wait for the period to end."""
        self.pending = True
        if urgent:
            self._due_ns = None

    def sent(self, now_ns: int) -> None:
        """Record that all content has been sent."""
        self.pending = False
        self._due_ns = now_ns + self._period_ns

    def is_due(self, now_ns: int) -> bool:
        """Return whether there is content, and it may be sent now."""
        return self.pending and (self._due_ns is None or now_ns >= self._due_ns)


class Schedule:
    """
    Decides when the texts of the codes and the path are published.

    They are published only if they have changed: the texts when the movement or the direction of
    the links changes, else at most once a second; the path at most five times a second. Times
    are in nanoseconds, of any one clock.
    """

    def __init__(self, parameters: Parameters) -> None:
        """Make a schedule without content to send."""
        self._paces = {topic: Pace(CHAIN_CODE_PERIOD_NS) for topic in whole_topics(parameters)}
        self._paces[PATH] = Pace(_PATH_PERIOD_NS)
        self._last_movement: Movement | None = None
        self._last_link: AnyDirection | None = None

    def add(self, update: Update) -> None:
        """Record the result of a pair."""
        movement = update.step.movement
        self._paces[CHAIN_CODE].changed(urgent=movement is not self._last_movement)
        self._paces[PATH].changed()
        self._last_movement = movement
        if update.links and LINKS in self._paces:
            self._paces[LINKS].changed(
                urgent=any(link is not self._last_link for link in update.links))
            self._last_link = update.links[-1]

    def restart(self) -> None:
        """Record a restart: all topics are published at once."""
        self._last_movement = self._last_link = None
        for pace in self._paces.values():
            pace.changed(urgent=True)

    @property
    def pending(self) -> bool:
        """Return whether there is content that has not been sent."""
        return any(pace.pending for pace in self._paces.values())

    def take(self, now_ns: int, *, rest: bool = False) -> tuple[Topic, ...]:
        """Return the topics to publish now; at the end, with ``rest``, all with new content."""
        topics = tuple(topic for topic, pace in self._paces.items()
                       if (pace.pending if rest else pace.is_due(now_ns)))
        for topic in topics:
            self._paces[topic].sent(now_ns)
        return topics
