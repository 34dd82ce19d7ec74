"""Hobby arms of servo motors: motor counts against the URDF."""

from workbench.parts import Parts

PARTS = Parts(
    commands={"hobby": "workbench.extras.hobby.commands:hobby"},
    root={
        "MotorMap": "workbench.extras.hobby.motor_map:MotorMap",
        "map_motors": "workbench.extras.hobby.motor_map:map_motors",
    },
    layouts=("workbench.extras.hobby.layouts:Motors",),
)
