"""Chosen poses: a table for the terminal, and plain data for other programs."""

from typing import Any

import numpy as np
from rich import box
from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from workbench.arm.robot import JointKind, Robot
from workbench.plate.poses.choose import PoseSet


def poses_table(robot: Robot, poses: PoseSet) -> RenderableType:
    """The index before and after, and every pose in degrees or millimetres."""
    slides = [joint.kind is JointKind.PRISMATIC for joint in robot.moving]
    title = f"{len(poses.q)} poses for {robot.name}"
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, title=escape(title), title_justify="left")
    table.add_column("pose", justify="right")
    for k, sliding in enumerate(slides):
        table.add_column(escape(f"q{k + 1} [{'mm' if sliding else '°'}]"), justify="right", no_wrap=True)
    for number, q in enumerate(poses.q, start=1):
        cells = [f"{1e3 * v:.1f}" if s else f"{np.rad2deg(v):.1f}" for v, s in zip(q, slides, strict=True)]
        table.add_row(str(number), *cells)
    words = f"index {poses.index}: {poses.before:.4g} for a random start, {poses.after:.4g} for these"
    sentences = [words]
    if poses.bound is not None:
        share = 100.0 * (1.0 - poses.after / poses.bound)
        sentences.append(
            f"no choice of these candidates has more than {poses.bound:.6g} (convex bound): "
            f"at most {share:.2g} % are missing"
        )
    if len(poses.q) > 1:
        longest, mean = np.rad2deg(poses.travels.max()), np.rad2deg(poses.travels.mean())
        of = "turning joints as a rule" if any(slides) else "the joint that travels most"
        sentences.append(f"from pose to pose ({of}): {longest:.0f}° at most, {mean:.0f}° on average")
    return Group(table, Text("\n".join(sentences)))


def poses_json(robot: Robot, poses: PoseSet) -> dict[str, Any]:
    """The same in SI."""
    return {
        "schema": "workbench.poses/1",
        "robot": robot.name,
        "index": {"name": poses.index, "before": poses.before, "after": poses.after},
        "bound": poses.bound,
        "travel": {"max": float(poses.travels.max(initial=0.0)), "sum": float(poses.travels.sum())},
        "outcome": str(poses.outcome),
        "poses": poses.q.tolist(),
    }
