# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes results to disk, on request and pair by pair."""

from collections.abc import Callable
from pathlib import Path
from threading import Thread
import time
from typing import TextIO

from phase_traj_ros.core import TrajectoryEstimator, Update
from phase_traj_ros.errors import OutputError, PhaseTrajError
from phase_traj_ros.io.results.files import ShiftTable
from phase_traj_ros.io.results.snapshot import Snapshot
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.ros.entities import Entities
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import Trigger


class Saving:
    """
    Offers ``~/save``, and with ``record_shifts`` writes a CSV row per pair of frames.

    All files are in ``output_dir``, which is read-only: other nodes cannot choose a path.
    """

    def __init__(
        self, node: Node, entities: Entities, parameters: Parameters,
        estimator: TrajectoryEstimator, source: Callable[[], str],
    ) -> None:
        """
        Offer the service on ``node``; ``source`` returns the name of the image topic.

        Raises
        ------
        OutputError
            ``record_shifts`` is set, and the file cannot be written.

        """
        self._node = node
        self._estimator = estimator
        self._source = source
        self._directory = Path(parameters.output_dir) if parameters.output_dir else None
        self._rows: ShiftRows | None = None
        if parameters.record_shifts:
            if self._directory is None:
                raise OutputError('record_shifts is set, but output_dir is not: set both')
            self._rows = ShiftRows(self._directory)
        entities.create_service(Trigger, '~/save', self._on_save)

    def record(self, update: Update) -> None:
        """Write the row of one pair, if rows are recorded."""
        if self._rows is None:
            return
        try:
            self._rows.add(update)
        except OutputError as error:
            self._rows = None
            self._node.get_logger().error(f'stopped recording shifts: {error}')

    def close(self) -> None:
        """Close the file of rows."""
        if self._rows is not None:
            self._rows.close()

    async def _on_save(
        self, _: Trigger.Request, response: Trigger.Response,
    ) -> Trigger.Response:
        if self._directory is None:
            response.message = 'the parameter output_dir is not set: start the node with one'
            return response
        snapshot = Snapshot.of(self._estimator, source=self._source())
        # Drawing takes some tenths of a second. Images must not queue up meanwhile.
        done: Future = Future(executor=self._node.executor)
        Thread(target=_write, args=(snapshot, self._directory, done), daemon=True).start()
        failure = await done
        response.success = failure is None
        response.message = failure or f'written to {self._directory}'
        self._node.get_logger().info(f'save: {response.message}')
        return response


class ShiftRows:
    """
    A CSV file that grows by one row per pair, named after its creation time.

    Each row is flushed to the operating system at once: a killed process leaves complete rows.
    """

    def __init__(self, directory: Path) -> None:
        """
        Create a file in ``directory``, and the directory if it does not exist.

        Raises
        ------
        OutputError
            The file cannot be written.

        """
        self._path = directory / time.strftime('shifts_%Y%m%dT%H%M%S.csv', time.gmtime())
        try:
            directory.mkdir(parents=True, exist_ok=True)
            self._file: TextIO = self._path.open(
                'x', encoding='utf-8', newline='', buffering=1)
            self._table = ShiftTable(self._file)
        except OSError as error:
            raise self._error(error) from None

    def add(self, update: Update) -> None:
        """
        Add the row of one pair.

        Raises
        ------
        OutputError
            The row cannot be written.

        """
        try:
            self._table.add(update)
        except OSError as error:
            raise self._error(error) from None

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _error(self, error: OSError) -> OutputError:
        return OutputError(f'cannot write {self._path}: {error.strerror or error}')


def _write(snapshot: Snapshot, directory: Path, done: Future) -> None:
    try:
        snapshot.write(directory)
    except PhaseTrajError as error:
        done.set_result(str(error))
    except Exception as error:  # the caller waits for a response in any case
        done.set_result(f'{type(error).__name__}: {error}')
    else:
        done.set_result(None)
