"""Controller-ready numbers: joint offsets, tool and base, for a controller that accepts nothing else; what to
enter, and the remaining error.

Most controllers compute with the nominal geometry and let their user set a zero offset for every joint, a
tool frame and a base frame. Here they are chosen so that the nominal arm with them comes closest to the
usable part of the calibrated arm (`usable_arm`) over given joint positions (Gauss–Newton on

    Σ_rows ‖Δp‖² + L² ‖Δφ‖²,

Δp and Δφ the pose errors of the nominal arm, L a lever that converts angles to lengths, short where
orientations were not measured). The remaining error, which only the full model can correct, is reported,
and so are numbers that make the error larger anywhere.

Some of these numbers are redundant: a rotation of the base about the first axis is an offset of joint 1, one
of the tool about the last axis an offset of the last joint. They are taken in order (offsets, tool, base);
a number that is redundant given the earlier ones keeps its value and is listed.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from workbench.arm.frame import FRAME_PARTS, Frame
from workbench.arm.joint_units import sliding
from workbench.arm.kinematics.forward import identification_jacobian, tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.usable_arm import (
    LEVER,
    POSITION_SIGMA,
    PoseErrors,
    Usable,
    closest,
    divided,
    sampled,
    unobserved_text,
    usable_arm,
)
from workbench.base import se3
from workbench.base.types import frozen
from workbench.base.wording import capital, in_mm
from workbench.report.blocks import Block, ResultTable, Sentence, Tone, lines
from workbench.report.json import Json, document
from workbench.report.numbers import short, signed

UNSEEN_LEVER = 0.03
"""Lever where orientations were not measured [m]: it only keeps them near where they are."""
WORSE_RATIO, WORSE_AMOUNT = 1.02, 1e-6
"""A mean error is worse if it exceeds another by this factor and this amount [m or rad]."""
NOTICED = POSITION_SIGMA / LEVER
"""That amount for orientations that were not measured [rad]."""
PARTS = OFFSETS, *FRAMES = "offsets", "tool", "base"
"""What a controller accepts, first the joint offsets."""
CONTROLLER = "workbench.controller/1"
TEXT = ("joint offsets only", "joint offsets and tool", "joint offsets, tool and base")
"""Of what a controller accepts: the first of `PARTS`."""
MIN_OWN_SHARE = 1e-8
"""A number is redundant if earlier ones leave less than this share of its effect."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ControllerNumbers:
    """What to enter into a controller, and the remaining error.

    Args:
        parts: What was allowed to change.
        offsets: To be added to every joint reading before the nominal kinematics [rad or m].
        robot: The nominal arm with them, and with tool and base to enter.
        held: Redundant numbers that kept their values, such as `base.yaw`.
        before: Errors of the nominal arm with its best base and tool, where those were identified.
        is_placed: Whether they were, so that `before` is with the best ones.
        after: Errors that remain.
        rows: Number of joint positions compared.
        losses: Where these numbers increase the error: at the tool or the flange, at the measured poses or
            anywhere within the limits; empty where they may be entered.
        notes: What was not observed, one sentence each.
    """

    parts: tuple[str, ...]
    offsets: Float[np.ndarray, " n"]
    robot: Robot
    held: tuple[str, ...]
    before: PoseErrors
    is_placed: bool
    after: PoseErrors
    rows: int
    losses: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def is_better(self) -> bool:
        """Whether entering these numbers helps, and makes nothing worse."""
        means = zip(self.after[::2], self.before[::2], strict=True)
        return any(WORSE_RATIO * after < before for after, before in means) and not self.losses


def controller_numbers(calibrated: Robot, nominal: Robot, parts: Sequence[str] = PARTS) -> ControllerNumbers:
    """The joint offsets, tool and base with which the nominal arm comes closest to the calibrated one.

    The search starts from the nominal arm with the best base and tool, as far as these were identified; parts
    that may not change keep these values, and offsets that may not change are 0.

    Args:
        calibrated: The arm as identified.
        nominal: The arm as the controller computes it.
        parts: What the controller accepts, of `PARTS`.
    """
    usable = usable_arm(calibrated.in_first_session)
    actual, here = usable.robot, Motion(usable.q)
    wanted = usable.wanted(here.q)
    start = nominal.with_frames(base=actual.base, tool=actual.tool)
    weight = np.array([1.0] * 3 + [LEVER if usable.sees_rotation else UNSEEN_LEVER] * 3)

    def at(arm: Robot, names: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray]:
        poses, twists = identification_jacobian(arm, here, names)
        error = se3.pose_error(wanted, poses) * weight
        return error.ravel(), (twists * weight[:, None]).reshape(-1, len(names))

    def nearest(arm: Robot, names: tuple[str, ...]) -> Robot:
        return closest(arm, names, lambda arm: at(arm, names), prior=np.zeros(len(names))) if names else arm

    start = nearest(start, usable.free_frames)
    offsets = [start.chain.elements[i].name for i in start.chain.driven]
    frames = [f"{f}.{piece}" for f in FRAMES if f in parts for piece in FRAME_PARTS]
    names = offsets * (OFFSETS in parts) + frames
    jacobian = at(start, tuple(names))[1]
    rest = np.abs(np.diagonal(np.linalg.qr(jacobian, mode="r")))  # orthogonal to the columns before
    own = np.flatnonzero(rest > MIN_OWN_SHARE * np.linalg.norm(jacobian, axis=0)[: len(rest)]).tolist()
    arm = nearest(start, tuple(names[i] for i in own))
    before, after = (PoseErrors.of(se3.pose_error(wanted, tool_poses(a, here))) for a in (start, arm))
    return ControllerNumbers(
        parts=tuple(parts),
        offsets=frozen((arm.chain.values - start.chain.values)[arm.chain.driven]),
        robot=arm,
        held=tuple(n for i, n in enumerate(names) if i not in own),
        before=before,
        is_placed=bool(usable.free_frames),
        after=after,
        rows=len(here.q),
        losses=tuple(_losses(usable, start, arm, here.q)),
        notes=unobserved_text(calibrated, {"the model": actual, "these numbers": arm}),
    )


def _losses(usable: Usable, start: Robot, arm: Robot, q: Float[np.ndarray, "rows n"]) -> Iterator[str]:
    """Where an arm has larger errors than the one from which the search started."""
    actual = usable.robot.with_effects(*divided(usable.robot)[0])
    minimum = WORSE_AMOUNT if usable.sees_rotation else NOTICED
    for where, rows in (("at the measured poses", q), ("within the joint limits", sampled(arm))):
        for place, tool in (("tool", None), ("flange", Frame())):
            framed = (each.with_frames(tool=tool) for each in (actual, start, arm))
            wanted, old, new = (tool_poses(each, Motion(rows)) for each in framed)
            before, after = (PoseErrors.of(se3.pose_error(wanted, each)) for each in (old, new))
            if after.position_mean > WORSE_RATIO * before.position_mean + WORSE_AMOUNT:
                change = f"{in_mm(before.position_mean)} → {in_mm(after.position_mean)}"
                yield f"{place} positions {where}: {change}"
            if after.rotation_mean > WORSE_RATIO * before.rotation_mean + minimum:
                sizes = np.rad2deg([before.rotation_mean, after.rotation_mean])
                yield f"{place} orientations {where}: {sizes[0]:.3f}° → {sizes[1]:.3f}°"


@dataclass(frozen=True, eq=False)
class Use:
    """Numbers for controllers that accept increasingly many of them.

    Args:
        variants: Joint offsets only; with the tool; with tool and base.
    """

    variants: tuple[ControllerNumbers, ...]

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
        few, *_, full = self.variants
        chosen = self.advised or full
        numbers = [(f"nothing{' (best base and tool)' * full.is_placed}", *_errors(full.before))]
        for text, variant in zip(TEXT, self.variants, strict=True):
            numbers.append((text if variant.is_better else f"{text}: not advised", *_errors(variant.after)))
        reference = f"the calibrated model{', as far as it was measured' if full.notes else ''}"
        numbers.append((reference, *"0000"))
        headings = ("entered", "mean\n[mm]", "max\n[mm]", "mean\n[°]", "max\n[°]")
        yield ResultTable(f"Remaining error relative to {reference}", headings, numbers)
        if full.is_better or few.is_better:
            numbered = enumerate(sliding(full.robot))
            offsets = [(f"joint {k + 1}", *(_offset(v, k, s) for v in (full, few))) for k, s in numbered]
            columns = ("joint", "with tool and base", "offsets only")
            yield ResultTable("Joint offsets, added to each reading", columns, offsets)
        if chosen.is_better and len(chosen.parts) > 1:
            placed = [(part, *_frame(getattr(chosen.robot, part))) for part in chosen.parts[1:]]
            axes = ("frame", "x", "y", "z", "roll", "pitch", "yaw")
            yield ResultTable("Tool and base with them: xyz [mm], roll pitch yaw [°]", axes, placed)
        yield Sentence(capital(self.advice))
        yield Sentence(f"compared at {full.rows} joint positions", tone=Tone.QUIET)
        yield from lines("note", chosen.notes)
        yield from [Sentence(", ".join(full.held), "redundant, left unchanged")] * bool(full.held)

    def json(self) -> list[Json]:
        """The numbers in SI, as plain data."""
        return [_json(v) for v in self.variants]


def use_of(calibrated: Robot, nominal: Robot) -> Use:
    """Numbers for controllers that accept offsets only, the tool, too, and the base, of the first session."""
    return Use(tuple(controller_numbers(calibrated, nominal, PARTS[: k + 1]) for k in range(len(PARTS))))


def _json(numbers: ControllerNumbers) -> Json:
    frames = {name: getattr(numbers.robot, name) for name in FRAMES}
    return document(
        CONTROLLER,
        robot=numbers.robot.name,
        takes=numbers.parts,
        units=["m" if slides else "rad" for slides in sliding(numbers.robot)],
        offsets=numbers.offsets,
        **{name: {"xyz": frame.xyz, "rpy": frame.rpy} for name, frame in frames.items()},
        held=numbers.held,
        compared_at=numbers.rows,
        **{
            name: {
                "position_mm": {"mean": 1e3 * errors.position_mean, "max": 1e3 * errors.position_max},
                "orientation_deg": dict(zip(("mean", "max"), np.rad2deg(errors[2:]), strict=True)),
            }
            for name, errors in {"without": numbers.before, "remains": numbers.after}.items()
        },
        advised=numbers.is_better,
        losses=numbers.losses,
    )


def _errors(errors: PoseErrors) -> list[str]:
    return [*(short(1e3 * e) for e in errors[:2]), *(short(float(np.rad2deg(e))) for e in errors[2:])]


def _offset(numbers: ControllerNumbers, joint: int, slides: bool) -> str:
    value = numbers.offsets[joint]
    if not numbers.is_better:
        return "–"
    return f"{signed(1e3 * value, 4)} mm" if slides else f"{signed(float(np.rad2deg(value)), 5)}°"


def _frame(frame: Frame) -> list[str]:
    return [*(signed(1e3 * v, 3) for v in frame.xyz), *(signed(float(np.rad2deg(v)), 4) for v in frame.rpy)]
