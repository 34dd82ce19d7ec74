"""Hobby arms of servo motors: motor counts and LeRobot's files against the URDF, leader against follower."""

from workbench.parts import Parts

PARTS = Parts(
    commands={"hobby": "workbench.extras.hobby.commands:hobby"},
    root={
        "Following": "workbench.extras.hobby.follow:Following",
        "MotorMap": "workbench.extras.hobby.motor_map:MotorMap",
        "compare_leader": "workbench.extras.hobby.follow:compare_leader",
        "map_motors": "workbench.extras.hobby.motor_map:map_motors",
    },
    layouts=("workbench.extras.hobby.layouts:LeRobot", "workbench.extras.hobby.layouts:Motors"),
    exports=("workbench.extras.hobby.lerobot:MotorCalibration",),
)
