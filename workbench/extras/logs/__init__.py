"""ROS bags, MATLAB files, motion capture, logs of controllers, and layouts of public data sets."""

from workbench.parts import Parts

PARTS = Parts(
    layouts=(
        "workbench.extras.logs.ipa_grid:IpaGrid",
        "workbench.extras.logs.matlab:Matlab",
        "workbench.extras.logs.mocap:Mocap",
        "workbench.extras.logs.mukca:Mukca",
        "workbench.extras.logs.ros_bag:RosBag",
        "workbench.extras.logs.rtde:Rtde",
        "workbench.extras.logs.target_deviation:TargetDeviation",
    ),
    joins=("workbench.extras.logs.standstills:ByTime",),
)
