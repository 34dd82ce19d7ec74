"""Effects that an arm may carry beside its geometry: one file each, and one line here."""

from workbench.effects.backlash import Backlash
from workbench.effects.base_drift import BaseDrift
from workbench.effects.bearing_compliance import BearingCompliance
from workbench.effects.clearance_tilt import ClearanceTilt
from workbench.effects.effect import AbstractEffect, Insertion, Loads, check_ranges, drifting, with_insertions
from workbench.effects.encoder_scale import EncoderScale
from workbench.effects.gravity_sag import GravitySag
from workbench.effects.joint_compliance import JointCompliance
from workbench.effects.joint_coupling import JointCoupling
from workbench.effects.joint_harmonic import JointHarmonic
from workbench.effects.link_flexure import LinkFlexure
from workbench.effects.local_joint_error import LocalJointError
from workbench.effects.thermal_growth import ThermalGrowth

EFFECTS: dict[str, type[AbstractEffect]] = {
    str(kind.name): kind
    for kind in (
        JointCompliance,
        Backlash,
        ClearanceTilt,
        BearingCompliance,
        JointHarmonic,
        EncoderScale,
        JointCoupling,
        ThermalGrowth,
        BaseDrift,
        LinkFlexure,
        GravitySag,
        LocalJointError,
    )
}
"""The catalogue by the names of files."""

__all__ = ["EFFECTS", "AbstractEffect", "Insertion", "Loads", "check_ranges", "drifting", "with_insertions"]
