"""How to apply a calibration: the numbers that a controller accepts, and the remaining error."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from rich.console import Group, RenderableType
from rich.text import Text

from workbench.arm.frame import Frame
from workbench.arm.robot import JointKind, Robot
from workbench.base.wording import capital, in_mm
from workbench.identification.controller_parameters import (
    ControllerNumbers,
    ControllerPart,
    PoseErrors,
    controller_numbers,
)
from workbench.identification.report.results_json import controller_json
from workbench.identification.result import Identification
from workbench.report.numbers import short, signed
from workbench.report.tables import folded, line, new_table, unbroken

MAX_OPTIMISED_ROWS = 500
"""Maximum number of measured joint positions for which the numbers are optimised."""
TEXT = ("joint offsets only", "joint offsets and tool", "joint offsets, tool and base")
VARIANTS = (
    (ControllerPart.OFFSETS,),
    (ControllerPart.OFFSETS, ControllerPart.TOOL),
    (ControllerPart.OFFSETS, ControllerPart.TOOL, ControllerPart.BASE),
)


@dataclass(frozen=True, eq=False)
class Use:
    """Numbers for controllers that accept increasingly many of them.

    Args:
        variants: Joint offsets only; with the tool; with tool and base.
        linear: Which joints are prismatic.
        session: Session whose base and tool were used; empty if there is one only.
    """

    variants: tuple[ControllerNumbers, ...]
    linear: tuple[bool, ...]
    session: str

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
        return f"enter {TEXT[len(chosen.parts) - 1]}: {_change(chosen)}"

    @property
    def table(self) -> list[tuple[str, list[str]]]:
        """For each variant and for no numbers: what is entered, and the four remaining errors."""
        first = self.variants[0]
        lines = [("nothing (best base and tool)", _errors(first.before))]
        for text, variant in zip(TEXT, self.variants, strict=True):
            lines.append((text if variant.is_better else f"{text}: not advised", _errors(variant.after)))
        return [*lines, (self.reference, ["0"] * 4)]

    @property
    def reference(self) -> str:
        """What the errors are measured against."""
        return (
            "the calibrated model, as far as it was measured" if self.full.notes else "the calibrated model"
        )

    @property
    def offsets(self) -> list[tuple[str, str, str]]:
        """Joint, and its offset in the full variant and when only offsets are entered."""

        def cell(variant: ControllerNumbers, joint: int, slides: bool) -> str:
            return _offset(variant.offsets[joint], slides) if variant.is_better else "–"

        return [
            (f"joint {k + 1}", cell(self.full, k, slides), cell(self.variants[0], k, slides))
            for k, slides in enumerate(self.linear)
        ]

    @property
    def frames(self) -> list[tuple[str, list[str]]]:
        """Tool and base of the advised variant: x, y, z in mm, roll, pitch, yaw in degrees."""
        if (chosen := self.advised) is None:
            return []
        frames = {ControllerPart.TOOL: chosen.robot.tool, ControllerPart.BASE: chosen.robot.base}
        return [(str(part), _frame(frame)) for part, frame in frames.items() if part in chosen.parts]

    def summary(self) -> RenderableType:
        """What to enter into a controller, and what that leaves, as tables for the terminal."""
        errors = ("mean\n[mm]", "max\n[mm]", "mean\n[°]", "max\n[°]")
        left = new_table(f"Remaining error relative to {self.reference}", folded("entered"), *errors)
        for text, values in self.table:
            left.add_row(text, *values)
        added = new_table(
            "Joint offsets, added to each reading", unbroken("joint"), "with tool and base", "offsets only"
        )
        for row in self.offsets:
            added.add_row(*row)
        parts = ("x", "y", "z", "roll", "pitch", "yaw")
        placed = new_table("Tool and base with them: xyz [mm], roll pitch yaw [°]", unbroken("frame"), *parts)
        for name, values in self.frames:
            placed.add_row(name, *values)
        head: list[RenderableType] = [left]
        if any(v.is_better for v in (self.full, self.variants[0])):
            head.append(added)
        if self.frames:
            head.append(placed)
        lines = [
            Text(capital(self.advice)),
            Text(f"compared at {self.full.rows} joint positions", style="dim"),
        ]
        lines += [line("note", note) for note in (self.advised or self.full).notes]
        if self.full.held:
            lines.append(line("redundant, left unchanged", ", ".join(self.full.held)))
        return Group(*head, *lines)

    def json(self) -> list[dict[str, Any]]:
        """The numbers in SI, as plain data."""
        return [controller_json(v) for v in self.variants]


def controller_use(result: Identification) -> Use:
    """Numbers for the controller from the best fit, over the joint positions that were measured."""
    q = np.concatenate([result.data.q[result.train_rows], result.held_out_data.q])
    chosen = np.unique(np.linspace(0, len(q) - 1, min(len(q), MAX_OPTIMISED_ROWS)).round().astype(int))
    return use_of(result.robot, result.nominal_robot, q=q[chosen], session=result.data.sessions[0])


def use_of(
    calibrated: Robot, nominal: Robot, *, q: Float[np.ndarray, "rows n"] | None = None, session: str = ""
) -> Use:
    """Numbers for controllers that accept offsets only, the tool too, and the base too.

    Args:
        calibrated: The arm as identified.
        nominal: The arm as the controller computes it.
        q: Joint positions to compare at [rad or m]; uniform samples within the limits if None.
        session: Session whose base and tool are used, where the calibrated arm has several; the first if
            empty.
    """
    session = session or next(iter(calibrated.sessions), "")
    variants = tuple(
        controller_numbers(calibrated, nominal, q=q, parts=parts, session=session) for parts in VARIANTS
    )
    linear = tuple(j.kind is JointKind.PRISMATIC for j in nominal.moving)
    return Use(variants, linear, session if calibrated.sessions else "")


def _change(numbers: ControllerNumbers) -> str:
    return f"{in_mm(numbers.before.position_mean)} → {in_mm(numbers.after.position_mean)} on average"


def _errors(errors: PoseErrors) -> list[str]:
    position, rotation = errors[:2], errors[2:]
    return [*(short(1e3 * e) for e in position), *(short(float(np.rad2deg(e))) for e in rotation)]


def _offset(value: float, slides: bool) -> str:
    return f"{signed(1e3 * value, 4)} mm" if slides else f"{signed(float(np.rad2deg(value)), 5)}°"


def _frame(frame: Frame) -> list[str]:
    return [*(signed(1e3 * v, 3) for v in frame.xyz), *(signed(float(np.rad2deg(v)), 4) for v in frame.rpy)]
