"""figaroh: `BaseCalibration` on a URDF, with the cost function that its documentation shows.

Its searches difference `calc_updated_fkm` numerically. The pin rows are the regressor that it uses to choose
parameters: `calculate_kinematics_model` as it calls it, and pin's own functions bare.
"""

import csv
import logging
import warnings

import numpy as np
import pinocchio as pin
import task
import yaml
from figaroh.calibration.base_calibration import BaseCalibration
from figaroh.calibration.calibration_tools import (
    calc_updated_fkm,
    calculate_kinematics_model,
    measurement_jacobian,
)
from figaroh.tools.robot import Robot

ROWS, PIN_ROWS = 50, 5000
METHODS = {
    "structural": "solve_optimisation, parameters by its default choice",
    "excitation": "solve_optimisation, parameters chosen on the measured poses",
}
POSE = ["x1", "y1", "z1", "phix1", "phiy1", "phiz1"]


class Calibration(BaseCalibration):
    """A full-pose calibration, whitened; base and tool unknown."""

    def load_param(self, config_file, setting_type="calibration"):
        super().load_param(config_file, setting_type)
        self.calib_config.update(known_baseframe=False, known_tipframe=False)

    def cost_function(self, var):
        predicted = calc_updated_fkm(self.model, self.data, var, self.q_measured, self.calib_config)
        residual = self._compute_logmap_residuals(self.PEE_measured, predicted)
        return self.apply_measurement_weighting(
            residual, pos_weight=1 / task.SIGMA_POSITION, orient_weight=1 / task.SIGMA_ROTATION
        )


def configure(folder, arm, q, poses, method):
    """Write the measurements and the configuration file."""
    with open(folder / f"{arm}.csv", "w", newline="") as file:
        table = csv.writer(file)
        table.writerow(POSE + [f"joint{i + 1}" for i in range(task.JOINTS)])
        for row, pose in zip(q, poses, strict=True):
            table.writerow([*pose[:3, 3], *pin.rpy.matrixToRpy(pose[:3, :3]), *row])
    calibration = {
        "parameters": {"calibration_level": "full_params", "estimation": {"method": method}},
        "kinematics": {"base_frame": "universe", "tool_frame": "tool"},
        "measurements": {
            "markers": [{"measurable_dof": [True] * 6}],
            "poses": {"base_pose": [0.0] * 6, "tool_pose": [0.0] * 6},
        },
        "data": {"source_file": str(folder / f"{arm}.csv"), "number_of_samples": len(q)},
    }
    config = {"robot": {"name": "aria"}, "tasks": {"calibration": {"enabled": True, **calibration}}}
    (folder / f"{arm}-{method}.yaml").write_text(yaml.safe_dump(config))
    return str(folder / f"{arm}-{method}.yaml")


def predicted(calibration, x, q):
    """Held-out poses."""
    config = dict(calibration.calib_config, NbSample=len(q))
    flat = calc_updated_fkm(calibration.model, calibration.data, x, q, config).reshape(6, -1)
    return [task.four(pin.rpy.rpyToMatrix(*row[3:]), row[:3]).tolist() for row in flat.T]


def body(arrays, folder, repeats):
    logging.disable(logging.WARNING)
    warnings.simplefilter("ignore")
    robot = Robot(str(folder / "arm.urdf"), package_dirs=str(folder))
    paths = []
    for method in METHODS:
        searches, wholes = {}, {}
        for arm in task.ARMS:
            config = configure(folder, arm, arrays["q"], arrays[arm], method)

            def ready(config=config):
                calibration = Calibration(robot, config)
                calibration.initialize()
                return calibration

            calibration = ready()
            seconds, (answer, _) = task.repeat(lambda c: c.solve_optimisation(), repeats, ready)
            searches[arm] = entry(calibration, answer, arrays, seconds)
            seconds, answer = task.repeat(
                lambda make=ready: make().solve(enable_logging=False), max(1, repeats // 2)
            )
            wholes[arm] = entry(calibration, answer, arrays, seconds)
        count = len(answer.x)
        paths.append(task.path(f"search, {method}", METHODS[method], count, searches))
        paths.append(task.path(f"whole, {method}", "initialize and solve", count, wholes))
    return {"package": "figaroh", "paths": paths, "rates": rates(calibration, answer.x, arrays["q"], repeats)}


def entry(calibration, answer, arrays, seconds):
    """One arm's part of a path."""
    held_out = predicted(calibration, answer.x, arrays["q_held_out"])
    return {"seconds": seconds, "predicted": held_out, "evaluations": int(answer.nfev)}


def rates(calibration, x, q, repeats):
    """Poses with Jacobian per second: central differences, its regressor call, pin alone."""
    model, data, config = calibration.model, calibration.data, calibration.calib_config
    some = q[:ROWS]
    many = list(np.tile(q, (PIN_ROWS // len(q) + 1, 1))[:PIN_ROWS])
    frame, local = config["IDX_TOOL"], pin.LOCAL

    def wrapped():
        for row in many:
            calculate_kinematics_model(row, model, data, config)

    def bare():
        for row in many:
            pin.forwardKinematics(model, data, row)
            pin.updateFramePlacements(model, data)
            pin.computeFrameKinematicRegressor(model, data, frame, local)

    differences = task.repeat(lambda: measurement_jacobian(model, data, x, some, config), repeats)[0]
    return [
        task.rate("measurement_jacobian", "central differences of its forward model", len(some), differences),
        task.rate(
            "calculate_kinematics_model",
            "pin's regressor of all placements",
            PIN_ROWS,
            task.repeat(wrapped, repeats)[0],
        ),
        task.rate(
            "pin alone", "computeFrameKinematicRegressor in a loop", PIN_ROWS, task.repeat(bare, repeats)[0]
        ),
    ]


if __name__ == "__main__":
    task.worker(body)
