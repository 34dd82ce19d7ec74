"""Kinematic calibration of serial robot arms.

    import workbench as wb
    from workbench.pipeline import identify

    arm = wb.load_robot("ur10")
    run = identify(arm, wb.read_measurements("measured.csv"))
    wb.write_toml(run.best.calibrated, "calibrated.toml")

Names are imported when they are first used, so that importing the package costs nothing.
"""

from importlib import import_module

_HOMES = {
    "workbench.errors": ("WorkbenchError",),
    "workbench.robots": ("Robot", "load_robot"),
    "workbench.robots.toml": ("write_toml",),
    "workbench.robots.urdf": ("read_urdf", "write_urdf"),
    "workbench.measure.dataset": ("Dataset",),
    "workbench.measure.readers": ("read_measurements",),
    "workbench.measure.writer": ("write_measurements",),
    "workbench.fabricate.as_measured": ("load_plate",),
    "workbench.model.forward": ("tool_poses", "sensitivity", "sensitivity_blocks", "link_frames"),
    "workbench.model.inverse": ("solve", "follow"),
    "workbench.pipeline": (
        "Identification",
        "choose_poses",
        "evaluate",
        "measure_plate",
        "measure_poses",
    ),
}
_HOME = {name: home for home, names in _HOMES.items() for name in names}

__all__ = sorted(_HOME)


def __getattr__(name: str):
    if name not in _HOME:
        raise AttributeError(f"module 'workbench' has no attribute '{name}'")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return __all__
