"""How to apply a calibration: the numbers that a controller accepts, and the remaining error."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.arm.frame import Frame
from workbench.arm.joint_units import sliding
from workbench.arm.robot import Robot
from workbench.base.wording import capital, in_mm
from workbench.identification.controller_parameters import (
    PARTS,
    ControllerNumbers,
    PoseErrors,
    controller_numbers,
)
from workbench.identification.report.results_json import controller_json
from workbench.report.blocks import Block, ResultTable, Sentence, Tone, lines
from workbench.report.numbers import short, signed

TEXT = ("joint offsets only", "joint offsets and tool", "joint offsets, tool and base")
"""Of what a controller accepts: the first of `PARTS`."""


@dataclass(frozen=True, eq=False)
class Use:
    """Numbers for controllers that accept increasingly many of them.

    Args:
        variants: Joint offsets only; with the tool; with tool and base.
    """

    variants: tuple[ControllerNumbers, ...]

    @property
    def full(self) -> ControllerNumbers:
        """The variant with offsets, tool and base."""
        return self.variants[-1]

    @property
    def advised(self) -> ControllerNumbers | None:
        """The variant to enter: the last one that reduces the error and increases it nowhere."""
        return next((v for v in reversed(self.variants) if v.is_better), None)

    @property
    def advice(self) -> str:
        """What to do, and why, in one sentence."""
        if (chosen := self.advised) is None:
            why = next((v.losses[0] for v in reversed(self.variants) if v.losses), "they change nothing")
            return f"don't enter any of these numbers ({why}); correct the joint positions instead"
        before, after = in_mm(chosen.before.position_mean), in_mm(chosen.after.position_mean)
        return f"enter {TEXT[len(chosen.parts) - 1]}: {before} → {after} on average"

    def blocks(self) -> Iterator[Block]:
        """What to enter into a controller, and what that leaves."""
        errors = ("mean\n[mm]", "max\n[mm]", "mean\n[°]", "max\n[°]")
        numbers = [("nothing (best base and tool)", *_errors(self.full.before))]
        for text, variant in zip(TEXT, self.variants, strict=True):
            numbers.append((text if variant.is_better else f"{text}: not advised", *_errors(variant.after)))
        reference = f"the calibrated model{', as far as it was measured' if self.full.notes else ''}"
        numbers.append((reference, *["0"] * len(errors)))
        yield ResultTable(f"Remaining error relative to {reference}", ("entered", *errors), numbers)
        entered = (self.full, self.variants[0])
        if any(variant.is_better for variant in entered):
            headings = ("joint", "with tool and base", "offsets only")
            offsets = [
                (f"joint {k + 1}", *(_offset(v.offsets[k], slides) if v.is_better else "–" for v in entered))
                for k, slides in enumerate(sliding(self.full.robot))
            ]
            yield ResultTable("Joint offsets, added to each reading", headings, offsets)
        if (chosen := self.advised) is not None and len(chosen.parts) > 1:
            placed = [(part, *_frame(getattr(chosen.robot, part))) for part in chosen.parts[1:]]
            axes = ("frame", "x", "y", "z", "roll", "pitch", "yaw")
            yield ResultTable("Tool and base with them: xyz [mm], roll pitch yaw [°]", axes, placed)
        yield Sentence(capital(self.advice))
        yield Sentence(f"compared at {self.full.rows} joint positions", tone=Tone.QUIET)
        yield from lines("note", (self.advised or self.full).notes)
        if self.full.held:
            yield Sentence(", ".join(self.full.held), "redundant, left unchanged")

    def json(self) -> list[dict[str, Any]]:
        """The numbers in SI, as plain data."""
        return [controller_json(v) for v in self.variants]


def use_of(calibrated: Robot, nominal: Robot) -> Use:
    """Numbers for controllers that accept offsets only, the tool too, and the base too, of the first session.

    Args:
        calibrated: The arm as identified.
        nominal: The arm as the controller computes it.
    """
    return Use(tuple(controller_numbers(calibrated, nominal, PARTS[: k + 1]) for k in range(len(PARTS))))


def _errors(errors: PoseErrors) -> list[str]:
    position, rotation = errors[:2], errors[2:]
    return [*(short(1e3 * e) for e in position), *(short(float(np.rad2deg(e))) for e in rotation)]


def _offset(value: float, slides: bool) -> str:
    return f"{signed(1e3 * value, 4)} mm" if slides else f"{signed(float(np.rad2deg(value)), 5)}°"


def _frame(frame: Frame) -> list[str]:
    return [*(signed(1e3 * v, 3) for v in frame.xyz), *(signed(float(np.rad2deg(v)), 4) for v in frame.rpy)]
