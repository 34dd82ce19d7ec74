"""Robot descriptions: one file per convention or format, and the library of built-in arms."""

from workbench.robots.library import built_in_robots, load_robot
from workbench.robots.robot import Frame, Joint, JointKind, Robot, SessionFrames

__all__ = ["Frame", "Joint", "JointKind", "Robot", "SessionFrames", "built_in_robots", "load_robot"]
