"""Whole runs as functions: what the commands, the app and notebooks call.

    run = identify(load_robot("ur10"), read_measurements("ur10.csv"))
    run.runs["ols"].held_out.position_mm.mean
    run.runs["ols"].calibrated

The three runs of the paper's toolbox (ARIA 4.1.4) are three short calls:

    actual, rows = measure_poses(aria, 10, index="O", seed=1)        # informative poses of a virtual arm
    actual, rows = measure_plate(aria, load_plate("table2"), seed=1)  # a calibration tool on a virtual arm
    rows = read_measurements("measured.csv")                          # a real arm

each followed by `identify(aria, rows)`.
"""

from workbench.diagnose.record import Diagnosis
from workbench.pipeline.compensation import compensate_trajectory
from workbench.pipeline.diagnosis import diagnose
from workbench.pipeline.evaluation import evaluate
from workbench.pipeline.identification import ALGORITHMS, identify
from workbench.pipeline.loading import loading_experiment
from workbench.pipeline.plates import cluster_region, score_plate, score_plates
from workbench.pipeline.poses import choose_poses, write_poses
from workbench.pipeline.simulation import measure_plate, measure_poses
from workbench.validate.identification import Evaluation, Identification, Run, Validation

__all__ = [
    "ALGORITHMS",
    "Diagnosis",
    "Evaluation",
    "Identification",
    "Run",
    "Validation",
    "choose_poses",
    "cluster_region",
    "compensate_trajectory",
    "diagnose",
    "evaluate",
    "identify",
    "loading_experiment",
    "measure_plate",
    "measure_poses",
    "score_plate",
    "score_plates",
    "write_poses",
]
