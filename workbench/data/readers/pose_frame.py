"""The column `pose_frame`: in which frame a file's poses are, where that is not what such files usually mean.

Measurements are in the measuring frame and trajectories in the robot's base. A trajectory that is written
with its poses says so, so that it can be read as measurements too.
"""

from workbench.data.readers.fields import Fields

BASE = "robot-base"
"""The robot's base frame."""
MEASURING = "measuring"
"""The frame that the base of a robot file stands in."""


def in_base(fields: Fields, *, usual: str = MEASURING) -> bool:
    """Whether the poses are in the robot's base.

    Args:
        fields: Columns in SI.
        usual: What a file without the column means.

    Raises:
        FileError: The column says something else, or different things.
    """
    named = fields.values.get("pose_frame")
    if named is None:
        return usual == BASE
    for row, name in enumerate(named):
        if name not in (BASE, MEASURING) or name != named[0]:
            raise fields.error(
                f"pose_frame must be {BASE} or {MEASURING}, the same in all rows, got '{name}'",
                row,
                "pose_frame",
            )
    return bool(named[0] == BASE)
