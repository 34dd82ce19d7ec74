"""Files of drivers, controllers and simulators."""

from workbench.parts import Parts

PARTS = Parts(
    exports=(
        "workbench.extras.controllers.kinematics_yaml:FRANKA",
        "workbench.extras.controllers.mjcf:Mjcf",
        "workbench.extras.controllers.ur_calibration:UrCalibration",
        "workbench.extras.controllers.kinematics_yaml:UR",
        "workbench.extras.controllers.into:Urdf",
        "workbench.extras.controllers.kinematics_yaml:XARM",
    )
)
