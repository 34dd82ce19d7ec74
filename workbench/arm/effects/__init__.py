"""Effects beyond geometry: one file each, and one line here."""

from workbench.arm.effects.backlash import Backlash
from workbench.arm.effects.base_drift import BaseDrift
from workbench.arm.effects.effect import AbstractEffect, Candidate, Loads, extrapolation_notes
from workbench.arm.effects.encoder_scale import EncoderScale
from workbench.arm.effects.events import FrameStep, ToolStep, WarmUp, ZeroStep
from workbench.arm.effects.gravity_sag import GravitySag
from workbench.arm.effects.joint_compliance import JointCompliance
from workbench.arm.effects.joint_coupling import JointCoupling
from workbench.arm.effects.joint_harmonic import JointHarmonic
from workbench.arm.effects.link_flexure import LinkFlexure
from workbench.arm.effects.local_joint_error import LocalJointError
from workbench.arm.effects.thermal_growth import ThermalGrowth
from workbench.arm.effects.tilting import (
    BearingCompliance,
    ClearanceTilt,
    ExtensionClearance,
    ExtensionCompliance,
)
from workbench.arm.effects.uneven_compliance import UnevenCompliance
from workbench.parts import PartTable

EFFECTS: PartTable[type[AbstractEffect]] = PartTable(
    "effects",
    AbstractEffect,
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
    ExtensionCompliance,
    ExtensionClearance,
    LocalJointError,
    UnevenCompliance,
    FrameStep,
    ToolStep,
    ZeroStep,
    WarmUp,
    classes=True,
)
"""The catalogue by the names of files."""

__all__ = ["EFFECTS", "AbstractEffect", "Candidate", "Loads", "extrapolation_notes"]
