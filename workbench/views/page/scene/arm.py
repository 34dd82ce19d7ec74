"""An arm in the scene: its bodies, each moving with its own frame."""

import numpy as np
import viser
from jaxtyping import Float

from workbench.arm.chain import NO_SHIFT
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.views.appearance.bodies import body_frames, generated_bodies, make_bodies
from workbench.views.page.scene.nodes import add_solid, unsettle

SHELL = 1.09
"""How much thicker a ghost is, so that it encloses the arm that it is compared with."""


class Arm:
    """A drawn arm.

    Args:
        server: Where.
        name: Name of its node, such as `/arm`.
        robot: Geometry with which its bodies are made.
        ghost: Colour of a translucent arm; None for the solid one in its own colours.
        opacity: Of a translucent arm.
        swell: How much thicker than usual a translucent arm is.
        is_plain: Whether it is drawn from its geometry even where its file has meshes, which costs less.
        has_foot: Whether the body that does not move is drawn as well.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        name: str,
        robot: Robot,
        *,
        ghost: tuple[int, int, int] | None = None,
        opacity: float = 0.3,
        swell: float = SHELL,
        is_plain: bool = False,
        has_foot: bool = True,
    ):
        self._root = server.scene.add_frame(name, show_axes=False)
        self._nodes = []
        make = generated_bodies if is_plain else make_bodies
        for i, body in enumerate(make(robot, swell=1.0 if ghost is None else swell)):
            self._nodes.append(server.scene.add_frame(f"{name}/body{i}", show_axes=False))
            unsettle(self._nodes[i])
            if i == 0 and not has_foot:
                continue
            if ghost is not None and body.solid is not None:
                add_solid(server, f"{name}/body{i}/ghost", body.solid, ghost, opacity=opacity)
            elif ghost is None:
                for j, part in enumerate(body.parts):
                    add_solid(server, f"{name}/body{i}/part{j}", part.solid, part.colour)

    def stand(
        self, robot: Robot, q: Float[np.ndarray, " n"], *, shift: Float[np.ndarray, "_ _"] = NO_SHIFT
    ) -> None:
        """Move every body to where it is on this robot at these joint positions, bent as its chain is."""
        frames = body_frames(robot, q, shift=shift)
        turns = se3.matrix_to_quaternion(frames[:, :3, :3])
        for node, frame, wxyz in zip(self._nodes, frames, turns, strict=True):
            node.position, node.wxyz = frame[:3, 3], wxyz

    @property
    def visible(self) -> bool:
        """Whether it is shown."""
        return self._root.visible

    @visible.setter
    def visible(self, value: bool) -> None:
        self._root.visible = value

    def remove(self) -> None:
        """Take it out of the scene."""
        self._root.remove()
