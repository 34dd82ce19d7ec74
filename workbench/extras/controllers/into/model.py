"""What a model file says: frames given relative to one another, and the joints between its bodies."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from workbench.arm.joint import JointKind
from workbench.base import se3
from workbench.base.errors import FileError
from workbench.base.types import Matrix4, Vector3
from workbench.extras.controllers.into.xml_bytes import FILE, Edit

ROOT = ""


@dataclass(frozen=True, eq=False)
class GivenFrame:
    """A frame as the file gives it.

    Args:
        reference: The frame that it is given in.
        body: The body that it is fixed to.
        read: Its pose, read when it is needed, since off the arm it may be an expression.
        write: Edits that give it another pose.
    """

    reference: str
    body: str
    read: Callable[[], Matrix4]
    write: Callable[[Matrix4], list[Edit]]


@dataclass(frozen=True, eq=False)
class Edge:
    """A joint of the file, or what fixes a body to another.

    Args:
        name: Of the joint.
        parent: Body before it.
        child: Body behind it.
        kind: How it moves; None for what no joint of an arm does.
        frame: The frame of its axis.
        axis: Point and direction in that frame.
    """

    name: str
    parent: str
    child: str
    kind: JointKind | None
    frame: str
    axis: Callable[[], tuple[Vector3, Vector3]]

    @property
    def moves(self) -> bool:
        return self.kind is not JointKind.FIXED


@dataclass(frozen=True, eq=False)
class Model:
    """A file: frames by name, and joints in its order."""

    frames: dict[str, GivenFrame]
    edges: list[Edge]
    _poses: dict[str, Matrix4] = field(default_factory=dict)

    def at_zero(self, frame: str, inside: tuple[str, ...] = ()) -> Matrix4:
        """A frame in the root with all joints at 0."""
        if frame in inside:
            raise FileError(f"the frame '{frame}' is given relative to itself", path=FILE)
        if frame not in self.frames:
            if inside and frame != ROOT and frame not in {e.parent for e in self.edges}:
                raise FileError(f"has no frame '{frame}', which '{inside[-1]}' is relative to", path=FILE)
            return np.eye(4)
        if frame not in self._poses:
            given = self.frames[frame]
            self._poses[frame] = self.at_zero(given.reference, (*inside, frame)) @ given.read()
        return self._poses[frame]

    def line(self, edge: Edge) -> tuple[Vector3, Vector3]:
        """Point and direction of a joint's axis in the root, with all joints at 0."""
        pose = self.at_zero(edge.frame)
        point, axis = edge.axis()
        if not np.linalg.norm(axis) > 0.0:
            raise FileError(f"joint '{edge.name}' has the axis 0 0 0", path=FILE)
        return se3.apply(pose, point), pose[:3, :3] @ axis / np.linalg.norm(axis)

    @cached_property
    def _into(self) -> dict[str, Edge]:
        return {e.child: e for e in self.edges}

    def _above(self, body: str) -> Iterator[Edge]:
        """Joints from a body up to the root."""
        seen = set[str]()
        while (edge := self._into.get(body)) is not None and body not in seen:
            seen.add(body)
            yield edge
            body = edge.parent

    def _path(self, edge: Edge) -> list[Edge]:
        """Joints that move from the root to this one."""
        return [e for e in (edge, *self._above(edge.parent)) if e.moves][::-1]

    def chain(self, names: Sequence[str]) -> tuple[list[Edge], bool]:
        """The arm's joints from base to flange, and whether they were found by their names."""
        found = {e.name: e for e in self.edges if e.moves}
        missing = [n for n in names if n not in found]
        if missing and len(missing) < len(names):
            raise FileError(f"has no joint '{missing[0]}', which the calibration has", path=FILE)
        if not missing:
            path = self._path(found[names[-1]])[-len(names) :]
            if [e.name for e in path] != list(names):
                raise FileError(
                    f"has other joints in between, or another order than {', '.join(names)}", path=FILE
                )
        else:
            ends = [p for e in self.edges if e.moves and len(p := self._path(e)) == len(names)]
            if len(ends) != 1:
                longest = max((len(self._path(e)) for e in self.edges), default=0)
                size = f"at most {longest} joints in series" if not ends else f"{len(ends)} such arms"
                raise FileError(
                    f"has {size}, and none called {names[0]}; the calibrated arm has {len(names)} joints",
                    path=FILE,
                )
            path = ends[0]
        if odd := next((e for e in path if e.kind is None), None):
            raise FileError(
                f"joint '{odd.name}' is neither revolute nor prismatic with a position of its own", path=FILE
            )
        return path, not missing

    def classes(self, chain: list[Edge]) -> dict[str, int]:
        """Number of the arm's joints before each body; one more for what is fixed to the last body."""
        number = {id(e): k for k, e in enumerate(chain, start=1)}

        def of(body: str) -> int:
            for depth, edge in enumerate(self._above(body)):
                if k := number.get(id(edge), 0):
                    return k + (k == len(chain) and depth > 0)
            return 0

        return {body: of(body) for body in (*self._into, *(f.body for f in self.frames.values()))}
