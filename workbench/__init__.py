"""Kinematic calibration of serial robot arms.

    import workbench as wb

    arm = wb.load_robot("ur10")
    fit = wb.identify(arm, wb.read_measurements("measured.csv"))
    wb.write_toml(fit.best.calibrated, "calibrated.toml")

Names are imported when they are first used, so that importing the package costs nothing.
"""

from importlib import import_module

_HOMES = {
    "workbench.base.errors": ("WorkbenchError",),
    "workbench.arm.robot": ("Robot",),
    "workbench.arm.library": ("load_robot",),
    "workbench.arm.robot_toml": ("write_toml",),
    "workbench.arm.urdf": ("read_urdf", "write_urdf"),
    "workbench.arm.kinematics.public": ("tool_poses", "sensitivity", "sensitivity_blocks", "link_frames"),
    "workbench.arm.inverse.solve": ("solve", "follow"),
    "workbench.data.dataset": ("Dataset",),
    "workbench.data.readers": ("read_measurements",),
    "workbench.data.writer": ("write_measurements",),
    "workbench.plate.parts.as_measured": ("load_plate",),
    "workbench.plate.poses.run": ("choose_poses",),
    "workbench.plate.virtual_measuring": ("measure_plate", "measure_poses"),
    "workbench.identification.record": ("Identification",),
    "workbench.identification.evaluate": ("evaluate",),
    "workbench.identification.identify": ("identify",),
    "workbench.diagnosis.diagnose": ("diagnose",),
}
_HOME = {name: home for home, names in _HOMES.items() for name in names}

__all__ = sorted(_HOME)


def __getattr__(name: str):
    if name not in _HOME:
        raise AttributeError(f"module 'workbench' has no attribute '{name}'")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return __all__
