"""The controller as an instrument: its hidden model, tool tips and user frames by its pendant."""

from workbench.parts import Parts

PARTS = Parts(
    commands={
        "extract": "workbench.extras.pendant.commands:extract",
        "frame": "workbench.extras.pendant.commands:frame",
        "new": "workbench.extras.pendant.commands:new",
        "tcp": "workbench.extras.pendant.commands:tcp",
    },
    root={
        "Extraction": "workbench.extras.pendant.extract:Extraction",
        "ToolTip": "workbench.extras.pendant.touching.tool_tip:ToolTip",
        "UserFrame": "workbench.extras.pendant.touching.user_frame:UserFrame",
        "extract": "workbench.extras.pendant.extract:extract",
        "find_convention": "workbench.extras.pendant.own_robot.find_convention:find_convention",
        "frame": "workbench.extras.pendant.touching.user_frame:frame",
        "table_readings": "workbench.extras.pendant.own_robot.table_meanings:table_readings",
        "tcp": "workbench.extras.pendant.touching.tool_tip:tcp",
    },
    robot_checks=("workbench.extras.pendant.own_robot.find_convention:robot_that_gives",),
    panels=("workbench.extras.pendant.own_robot.panel:OwnRobotPanel",),
)
