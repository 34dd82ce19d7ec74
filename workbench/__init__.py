"""Kinematic calibration of serial robot arms.

    import workbench as wb

    arm = wb.load_robot("ur10")
    data = wb.read_measurements("ur10.csv")
    fit = wb.identify(arm, data, held_out=0.2)
    fit.robot.save("calibrated.toml")

Names are imported when they are first used, so that importing the package costs nothing.
"""

from importlib import import_module

_HOMES = {
    "workbench.base.errors": ("WorkbenchError",),
    "workbench.arm.robot": ("Robot", "Frame"),
    "workbench.arm.built_in_arms": ("load_robot",),
    "workbench.arm.robot_toml": ("write_toml",),
    "workbench.arm.own_robot.find_convention": ("find_convention",),
    "workbench.arm.own_robot.readings": ("table_readings", "typed_readings"),
    "workbench.arm.urdf": ("read_urdf", "write_urdf"),
    "workbench.arm.kinematics.array_like": ("tool_poses", "sensitivity", "sensitivity_blocks", "link_frames"),
    "workbench.arm.inverse.solve": ("solve", "follow"),
    "workbench.data.dataset": ("Dataset",),
    "workbench.data.readers": ("read_measurements",),
    "workbench.data.camera.rig": ("read_rig",),
    "workbench.data.camera.pixel_table": ("read_pixels",),
    "workbench.data.writer": ("write_measurements",),
    "workbench.plate.plate": ("Plate", "Target"),
    "workbench.plate.region": ("Region",),
    "workbench.plate.parts.as_measured": ("load_plate",),
    "workbench.plate.plate_toml": ("write_plate",),
    "workbench.plate.poses.choose_poses": ("choose_poses",),
    "workbench.plate.simulated_measurement": ("measure_plate", "measure_poses"),
    "workbench.plate.score": ("score_plate as score", "PlateScore"),
    "workbench.plate.design": ("optimise_plate", "try_plate"),
    "workbench.plate.optimiser.result": ("PlateDesign",),
    "workbench.identification.result": ("Identification", "Evaluation"),
    "workbench.identification.evaluate": ("evaluate",),
    "workbench.diagnosis.identify_with_effects": ("identify",),
    "workbench.identification.verification.verify": ("verify", "Verification"),
    "workbench.identification.fleet.fleet": ("compare_fleet", "Fleet"),
    "workbench.identification.problem": ("Noise",),
    "workbench.identification.rezero.moved_joints": ("rezero",),
    "workbench.diagnosis.result": ("Diagnosis",),
    "workbench.diagnosis.diagnose": ("diagnose",),
    "workbench.paths.trajectories": ("compensate_trajectory as compensate",),
    "workbench.views.page.show": ("show",),
}
_HOME = {
    entry.rpartition(" as ")[2]: (home, entry.partition(" as ")[0])
    for home, entries in _HOMES.items()
    for entry in entries
}

__all__ = sorted(_HOME)


def __getattr__(name: str):
    if name not in _HOME:
        raise AttributeError(f"module 'workbench' has no attribute '{name}'")
    home, own = _HOME[name]
    return getattr(import_module(home), own)


def __dir__() -> list[str]:
    return __all__
