"""Sources of pictures for a session: a watched folder, or an OpenCV camera.

Joints of a picture are where the live source says that the arm stands; without one, those of its row in a
table of the folder, as soon as it is there.
"""

import contextlib
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import final

import numpy as np

from workbench.base.errors import FileError, WorkbenchError
from workbench.data.readers.read import read_fields
from workbench.extras.camera.corner_detection import BoardFinder
from workbench.extras.camera.folder import TABLES, small_jpeg
from workbench.extras.camera.opencv import opencv
from workbench.extras.camera.picture_files import ENDINGS, Picture, blur, read_picture
from workbench.extras.camera.pixel_table import plain_names
from workbench.extras.camera.session_commands import Capture, Shot, TakeShot
from workbench.session.commands.messages import Tell
from workbench.session.state import Session
from workbench.session.view import AbstractView
from workbench.session.worker import Worker

DEVICE = "device:"
PAUSE = 0.2
"""Time between two looks at a folder or device [s]."""
STILL = 0.5
"""Corners of two pictures in turn that differ by less stand still [px]."""
SILENT = 25
"""Looks at a device in turn without a picture, from which on it is gone."""
MOVED = 20.0
"""Corners must have moved so far since the last picture that was kept [px]."""


@final
class PictureWatcher(AbstractView):
    """One thread for as long as pictures are taken.

    Args:
        worker: Who gets the pictures.
        pause: Time between two looks [s].
    """

    def __init__(self, worker: Worker, *, pause: float = PAUSE):
        self._worker, self._pause = worker, pause
        self._source = ""
        self._stop = threading.Event()

    def draw(self, session: Session) -> None:
        capture = session.part(Capture)
        source = "" if capture is None else capture.source
        if source == self._source:
            return
        self.close()
        self._source, self._stop = source, threading.Event()
        if capture is not None:
            arguments = (capture, self._stop)
            threading.Thread(
                target=self._watch, args=arguments, name="workbench-pictures", daemon=True
            ).start()

    def close(self) -> None:
        self._stop.set()

    def _watch(self, capture: Capture, stop: threading.Event) -> None:
        is_device = capture.source.startswith(DEVICE)
        pictures = _device(capture.source, stop) if is_device else self._folder(capture, stop)
        finder: BoardFinder | None = None
        before, sent = np.zeros((0, 2)), np.zeros((0, 2))
        try:
            for name, picture in pictures:
                if picture is not None:
                    finder = finder or BoardFinder.of(capture.rig.targets, [picture])
                    shot = self._look_at(name, picture, finder, capture)
                    if is_device:
                        uv = np.array(shot.uv).reshape(-1, 2)
                        shot = replace(shot, still=_shift(uv, before) < STILL and _shift(uv, sent) > MOVED)
                        before, sent = uv, uv if shot.still else sent
                    self._worker.submit(TakeShot(shot))
                if stop.wait(0.0 if picture is not None and not is_device else self._pause):
                    return
        except (WorkbenchError, OSError) as error:
            self._worker.submit(Tell(str(error)))

    def _look_at(self, name: str, picture: Picture, finder: BoardFinder, capture: Capture) -> Shot:
        camera, found = capture.rig.cameras[0], finder.find(picture)
        reason, size = found.reason, picture.shape[::-1]
        if size != camera.size:
            wanted = "{} x {}".format(*camera.size)
            reason = f"it has {size[0]} x {size[1]} px, camera '{camera.name}' has {wanted}"
        return Shot(
            name=name,
            camera=camera.name,
            picture=small_jpeg(picture),
            ids=tuple(found.ids.tolist()),
            corners=tuple(found.corners.tolist()),
            uv=tuple((float(u), float(v)) for u, v in found.uv),
            reason=reason,
            blur=min(blur(picture), 99.0),
            q=self._joints(capture, name),
        )

    def _joints(self, capture: Capture, name: str) -> tuple[float, ...] | None:
        session = self._worker.session
        jogged = session.playback.jogged
        if jogged is not None and any(part.real_arm for part in session.parts.values()):
            return tuple(jogged.tolist())
        return None if capture.source.startswith(DEVICE) else table_joints(Path(capture.source), name)

    def _folder(self, capture: Capture, stop: threading.Event) -> Iterator[tuple[str, Picture | None]]:
        """New pictures, and those whose joints have come; None when there is nothing new."""
        folder = Path(capture.source)
        done: dict[Path, tuple[float, float]] = {}
        while not stop.is_set():
            files = sorted(folder.iterdir())
            tables = max((p.stat().st_mtime for p in files if p.suffix.lower() in TABLES), default=0.0)
            now = self._worker.session.part(Capture)
            kept = {shot.name for shot in now.kept} if now is not None else set()
            for path in (p for p in files if p.suffix.lower() in ENDINGS):
                mark = path.stat().st_mtime, 0.0 if path.name in kept else tables
                if mark[0] == done.get(path, (0.0, 0.0))[0] and mark[1] in (0.0, done[path][1]):
                    continue
                with contextlib.suppress(FileError):  # it is being written
                    picture = read_picture(path)
                    done[path] = mark
                    yield path.name, picture
            yield "", None


def table_joints(folder: Path, name: str) -> tuple[float, ...] | None:
    """Joints of a picture in a table of its folder; None where there is no such row yet."""
    wanted = plain_names([name])[0]
    for path in sorted(p for p in folder.iterdir() if p.suffix.lower() in TABLES):
        try:
            fields = read_fields(path, layout="plain")
        except WorkbenchError:  # it is being written
            continue
        if "image" not in fields.values or not (numbers := fields.numbers(r"q(\d+)")):
            continue
        rows = [i for i, n in enumerate(plain_names(fields.values["image"])) if n == wanted]
        if rows:
            return tuple(float(fields.values[f"q{k}"][rows[0]]) for k in numbers)
    return None


def _shift(a: np.ndarray, b: np.ndarray) -> float:
    """Greatest distance of the same corners in two pictures [px]; inf where others are in view."""
    return float(np.abs(a - b).max(initial=0.0)) if len(a) == len(b) else np.inf


def _device(source: str, stop: threading.Event) -> Iterator[tuple[str, Picture | None]]:
    """Frames of a camera."""
    cv2 = opencv()
    number = source.removeprefix(DEVICE)
    camera = cv2.VideoCapture(int(number) if number.isdigit() else number)
    if not camera.isOpened():
        raise WorkbenchError(f"camera {number} can't be opened; give another number, or a folder to watch")
    try:
        count = silent = 0
        while not stop.is_set():
            is_read, frame = camera.read()
            count, silent = count + 1, 0 if is_read else silent + 1
            if silent == SILENT:
                raise WorkbenchError(
                    f"camera {number} stopped delivering pictures; reconnect it and start again"
                )
            yield f"{count}.png", cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY) if is_read else None
    finally:
        camera.release()
