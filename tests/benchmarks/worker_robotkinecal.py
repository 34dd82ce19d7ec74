"""robotkinecal: product of exponentials, `SerialRobotKineCal` on an arm read from URDF (its README's way)."""

import numpy as np
import roboticstoolbox as rtb
import task
from robotkinecal import SerialRobotKineCal
from spatialmath import SE3

ROWS = 100


def body(arrays, folder, repeats):
    q = list(arrays["q"])
    robot = rtb.ERobot.URDF(str(folder / "arm.urdf"))
    arms = {}
    for arm in task.ARMS:
        observed = [SE3(pose, check=False) for pose in arrays[arm]]

        def prepare(observed=observed):
            calibration = SerialRobotKineCal(robot, ee_name="tool")
            calibration.set_observations(q, observed)
            return calibration

        last = []

        def work(calibration, last=last):
            last[:] = [calibration]
            return calibration.solve()

        seconds, result = task.repeat(work, repeats, prepare)
        poses = [last[0].forward_kinematics(task.JOINTS + 1, row).A.tolist() for row in arrays["q_held_out"]]
        arms[arm] = {"seconds": seconds, "predicted": poses, "evaluations": result.nb_iterations_executed}
    calibration = SerialRobotKineCal(robot, ee_name="tool")
    calibration.set_observations(q, observed)

    def derivative():
        for row in q[:ROWS]:
            calibration.forward_kinematics(task.JOINTS + 1, row)
            calibration.A_Matrix(np.asarray(row))

    return {
        "package": "robotkinecal",
        "paths": [task.path("solve", "screw axes, 4 a joint and the zero pose", 30, arms)],
        "rates": [
            task.rate(
                "A_Matrix", "forward_kinematics and A_Matrix", ROWS, task.repeat(derivative, repeats)[0]
            )
        ],
    }


if __name__ == "__main__":
    task.worker(body)
