"""Printed numbers of the Katana thesis's chapter 5 beside ours."""

import numpy as np

from studies import katana_printed as printed
from studies import katana_tracking as tracking
from studies.finding import Finding, checked, judged, without
from studies.katana_study import spread
from studies.katana_tracking import STEPS, TrackingStudy
from workbench import Motion
from workbench.arm.statics.moments import joint_moments

BETTER = (tracking.GEOMETRY, tracking.STIFFNESS, tracking.TILTING)
"""Columns with a printed number."""


def tracking_findings(study: TrackingStudy) -> tuple[Finding, ...]:
    """Every number of chapter 5 beside ours."""
    circle, line = printed.TRACKED, printed.TRACKED_LINE
    reasons = (
        "the errors of these arms are drawn from Table 3.2, the thesis's arm is one of them",
        "samples of the path itself take up most of what the arm does there",
    )
    found = [
        judged(
            "§5.5.1", f"circle, mean error {STEPS[step]} [mm]" + (", so many times less" if step else ""),
            f"{circle[step]:.3f}" + (f", {circle[0] / circle[step]:.1f}×" if step else ""),
            study.spread(step).text(3) + (f", {study.reduction(step).text(1)}×" if step else ""),
            _matches(study, step), reasons[min(step, 1)],
        )
        for step in (tracking.BEFORE, *BETTER)
    ]  # fmt: skip
    near = study.spread(tracking.TILTING, tracking.LINE_NEAR)
    other = judged(
        "§5.5.1", "line, mean error tilting first [mm]", f"{line:.3f}", near.text(3),
        near.low <= line <= near.high,
        "identified on samples of the circle alone; the line is another path and chosen here",
    )  # fmt: skip
    gain = spread(study.mean[:, tracking.GEOMETRY, 0] - study.mean[:, tracking.STIFFNESS, 0])
    stated = circle[tracking.GEOMETRY] - circle[tracking.STIFFNESS]
    stiffness = judged(
        "§5.5.1", "stiffness first lowers the mean error on the circle by [mm]", f"{stated:.3f}",
        gain.text(3), gain.low <= stated <= gain.high,
        "stiffness first brings nothing here: the path's own samples have taken it up",
    )  # fmt: skip
    own, ours = study.spread(tracking.TILTING), study.spread(tracking.OURS)
    wide = np.median(study.mean[:, tracking.OURS] - study.mean[:, tracking.TILTING], axis=0) > 0.0
    sides = (", ".join(np.array(tracking.PATHS)[wide == better]) for better in (True, False))
    words = ("the thesis's own way, from samples of the circle, is better on: ", "ours on: ")
    methods = checked(
        "§5.5.1", "from 118 poses / the thesis's way, from samples of the circle; on the circle [mm]",
        "–", f"{ours.text(3)} / {own.text(3)}", ours.median <= own.median,
        "; ".join(word + paths for word, paths in zip(words, sides, strict=True) if paths),
    )  # fmt: skip
    return (*found, other, stiffness, methods, _elsewhere(study), *_loads(study))


def _matches(study: TrackingStudy, step: int) -> bool:
    """Whether the intervals of the arms enclose the printed error, and how many times less it is."""
    stated, ours, less = printed.TRACKED, study.spread(step), study.reduction(step)
    factor = stated[0] / stated[step]
    return ours.low <= stated[step] <= ours.high and less.low - 0.05 <= factor <= less.high + 0.05


def _elsewhere(study: TrackingStudy) -> Finding:
    """§5.5.1: geometric parameters need not be corrected for a different trajectory."""
    there = study.spread(tracking.TILTING, tracking.LINE_FAR)
    ours = study.spread(tracking.OURS, tracking.LINE_FAR)
    return judged(
        "§5.5.1", "parameters from samples of one trajectory hold for another [mm]", "no correction needed",
        f"before {study.spread(tracking.BEFORE, tracking.LINE_FAR).text()}, then {there.text()}; "
        f"from 118 poses {ours.text()}",
        there.median < study.spread(tracking.BEFORE, tracking.LINE_FAR).median / 2.0,
        "one path leaves directions of the constants open, and another posture shows them; poses from the "
        "whole workspace close them",
    )  # fmt: skip


def _loads(study: TrackingStudy) -> tuple[Finding, ...]:
    """What the thesis reads from its figs. 5.8 to 5.10."""
    path = study.paths[0]
    moments = joint_moments(path.robot, Motion(path.motion.q, **path.motion.drivers))
    own, across = np.abs(moments.about[:, 0]).max(), moments.tipping[:, 0].max()
    stiff, tilted = study.alone.mean(axis=1)
    return (
        judged("Fig. 5.9", "joint 1: moments across the axis exceed the torque about it [N m]", "exceed",
               f"{across:.2f} against {own:.3f}", across > own),
        judged("Fig. 5.10", "tilting costs more than stiffness alone, mean along the circle [mm]",
               "significantly more", f"{tilted:.2f} against {stiff:.2f}", tilted > 2.0 * stiff),
        without("Figs. 5.7–5.10, 5.12", "courses of the curves", "curves",
                "read from pictures without numbers; posture, duration and link 1's mass are not printed"),
    )  # fmt: skip
