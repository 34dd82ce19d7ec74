"""ROS bags, MATLAB files, motion capture, logs of controllers, and layouts of public data sets."""

from workbench.parts import Parts

PARTS = Parts(
    layouts=(
        "workbench.extras.logs.matlab:Matlab",
        "workbench.extras.logs.mocap:Mocap",
        "workbench.extras.logs.tables:Mukca",
        "workbench.extras.logs.ros_bag:RosBag",
        "workbench.extras.logs.tables:IpaGrid",
        "workbench.extras.logs.tables:Polar",
        "workbench.extras.logs.tables:Rtde",
        "workbench.extras.logs.tables:TargetDeviation",
    ),
    joins=("workbench.extras.logs.standstills:ByTime",),
)
