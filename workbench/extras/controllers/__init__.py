"""Files of drivers, controllers and simulators, and generated programs."""

from workbench.parts import Parts

PARTS = Parts(
    exports=(
        "workbench.extras.controllers.kinematics_yaml:FRANKA",
        "workbench.extras.controllers.mjcf:Mjcf",
        "workbench.extras.controllers.kinematics_yaml:OPENARM",
        "workbench.extras.controllers.program:PythonModule",
        "workbench.extras.controllers.ur_calibration:UrCalibration",
        "workbench.extras.controllers.kinematics_yaml:UR",
        "workbench.extras.controllers.into:Urdf",
        "workbench.extras.controllers.kinematics_yaml:XARM",
    )
)
