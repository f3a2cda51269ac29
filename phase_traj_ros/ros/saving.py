# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes each drive to disk: at its end, on request, and before its codes are lost."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from itertools import count
from pathlib import Path
import tempfile

from phase_traj_ros.errors import ForeignFileError, message_of, OutputError
from phase_traj_ros.io.outputs.commit import writing_to
from phase_traj_ros.io.results.files import Snapshot
from phase_traj_ros.io.user_path import user_path
from phase_traj_ros.ros.entities import Entities
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import Trigger


class Saving:
    """
    Saves each drive to a folder of its own in ``output_dir``.

    A drive lasts until the node is reset or ends, and is saved then; ``~/save`` saves what there
    is so far. The parameter is read-only: other nodes cannot choose a path.
    """

    def __init__(
        self, node: Node, entities: Entities, output_dir: str, take: Callable[[], Snapshot],
    ) -> None:
        """
        Offer ``~/save`` on ``node``; ``take`` returns the state to save.

        Without ``output_dir``, nothing is saved.

        Raises
        ------
        OutputError
            ``output_dir`` cannot be written.

        """
        self._node = node
        self._take = take
        self._folder: Path | None = None
        self._parent = user_path(output_dir) if output_dir else None
        if self._parent is not None:
            check_writable(self._parent)
        # Drawing takes some tenths of a second. Images must not queue up meanwhile.
        self._writer, self._closed = ThreadPoolExecutor(max_workers=1), False
        self.worked = True
        """Whether the drive that ``close`` ended is saved, if there was one."""
        entities.create_service(
            Trigger, '~/save', self._on_save, callback_group=ReentrantCallbackGroup())

    def end_drive(self) -> Future | None:
        """
        Save the drive, if it has frames and files are written; call it before a reset.

        Return whether that worked, and where or why not, in future; None if nothing is saved.
        """
        result = None
        if self._parent is not None and (snapshot := self._take()).corners:
            result = self._save(snapshot, self._parent, elsewhere=True)
        self._folder = None
        return result

    def close(self) -> None:
        """Save the drive and return when everything is written."""
        saved = self.end_drive()
        self._writer.shutdown()
        self._closed = True
        if saved is not None:
            self.worked, _ = saved.result()

    async def answer(self, result: Future) -> tuple[bool, str]:
        """Wait for the ``result`` of a drive that is being saved, and return it."""
        success, message = await result
        if self._closed:
            # The service is gone, and cannot answer any more.
            await Future()
        return success, message

    def _save(self, snapshot: Snapshot, parent: Path, *, elsewhere: bool = False) -> Future:
        """
        Write a state; return whether that worked, and where or why not, in future.

        ``elsewhere`` is whether it goes to a new folder if someone has changed that of the drive.
        """
        result = Future(executor=self._node.executor)
        done = partial(self._finished, result)
        try:
            self._folder = self._folder or new_folder(
                parent, self._node.get_fully_qualified_name())
        except OutputError as error:
            done(False, str(error))
        else:
            self._writer.submit(_write, snapshot, self._folder, done, elsewhere=elsewhere)
        return result

    def _finished(self, result: Future, success: bool, message: str) -> None:
        log = self._node.get_logger()
        if success:
            log.info(f'save: {message}')
        else:
            log.error(f'the drive is not saved: {message}')
        result.set_result((success, message))

    async def _on_save(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        if self._parent is None:
            response.message = 'the parameter output_dir is not set: start the node with one'
            return response
        response.success, response.message = await self.answer(
            self._save(self._take(), self._parent))
        return response


def check_writable(parent: Path) -> None:
    """
    Check that folders can be made in ``parent``, and make it if it is absent.

    Raises
    ------
    OutputError
        Nothing can be written there.

    """
    with writing_to(parent):
        parent.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=parent).close()


def new_folder(parent: Path, node: str) -> Path:
    """
    Make the next of the folders ``NODE_1``, ``NODE_2`` and so on, and return it.

    ``node`` is the full name of the node. The folder is new, whoever else makes folders.

    Raises
    ------
    OutputError
        It cannot be made.

    """
    name = node.strip('/').replace('/', '_')
    with writing_to(parent):
        parent.mkdir(parents=True, exist_ok=True)
        numbers = count(1)
        while True:
            folder = parent / f'{name}_{next(numbers)}'
            with suppress(FileExistsError):
                folder.mkdir()
                return folder


def _write(
    snapshot: Snapshot, folder: Path, done: Callable[[bool, str], None], *, elsewhere: bool,
) -> None:
    try:
        try:
            snapshot.write(folder)
        except ForeignFileError:
            if not elsewhere:
                raise
            folder = new_folder(folder.parent, folder.name.rpartition('_')[0])
            snapshot.write(folder)
    except Exception as error:  # the caller waits for a response in any case
        done(False, message_of(error))
    else:
        done(True, f'written to {folder}')
