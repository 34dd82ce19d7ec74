"""The ARIA paper's Tables 1–4, limits and equations beside what this package has in their place."""

import numpy as np
from jaxtyping import Float

from studies import aria_printed as printed
from studies.aria_arms import TITLES, Acquisition, identified, mean_errors
from studies.finding import Finding, between, checked, judged, without
from workbench.arm.built_in_arms import load_robot
from workbench.arm.kinematics.forward import identification_jacobian, link_frames, tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.data.accuracy_requirement import Requirement
from workbench.data.prediction import row_components
from workbench.data.simulation.instruments import INSTRUMENTS
from workbench.plate.plate import Plate
from workbench.plate.target_branches import plate_solutions

EVEN = 1e-3
"""Distance of a target of Table 2 from its even place on the circle that rounding to mm explains [m]."""


def nominal(robot: Robot) -> tuple[Finding, ...]:
    """Table 1 and eq. (2)."""
    names = [f"joint{i + 1}.{c}" for i in range(6) for c in printed.COLUMNS[:4]]
    gap = np.abs(robot.values(tuple(names)) - printed.TABLE_1.ravel()).max()
    limits, (low, high) = printed.LIMITS_3, np.rad2deg(robot.limits[2])
    return (
        checked("Table 1", "24 nominal constants", "6 × (θ, d, a, α)", f"apart by {gap:.1g}", gap < 1e-12,
                "copied into the built-in arm"),
        checked(
            "Eq. (2)", "limits of joint 3", limits["text"], f"{low:.0f}° … {high:.1f}°",
            limits["low"] < limits["high"],
            "as printed no angle is allowed; the lower limit lacks its minus sign",
        ),
    )  # fmt: skip


def requirement() -> tuple[Finding, ...]:
    """Eq. (3)."""
    angle = np.rad2deg(Requirement().angle)
    return (
        checked(
            "Eq. (3)", "greatest orientation error [°]", "0.66", f"{angle:.3f}",
            abs(angle - printed.REQUIRED_ANGLE) < 0.005,
            "arithmetic: d is the norm of 1 mm along each axis",
        ),
    )  # fmt: skip


def jacobian(robot: Robot, q: Float[np.ndarray, "rows n"]) -> tuple[Finding, ...]:
    """Eqs. (13a–e) as printed, at the constants of Table 4, beside the exact derivative."""
    actual = load_robot("aria-table4")
    frames = link_frames(actual, Motion(q))
    tool = frames[:, -1, :3, 3]
    findings = []
    for letter, column, first, axis in (
        ("a", "theta", 0, 2), ("b", "d", 0, 2), ("c", "a", 1, 0), ("d", "alpha", 1, 0), ("e", "beta", 1, 1),
    ):  # fmt: skip
        names = [n for n in robot.default_free if n.endswith(f".{column}")]
        gap = 0.0
        for name in names:
            frame = frames[:, int(name[5]) - 1 + first]
            spin, arm = frame[:, :3, axis], tool - frame[:, :3, 3]
            turns = column in ("theta", "alpha", "beta")
            both = (np.cross(spin, arm), spin) if turns else (spin, np.zeros_like(spin))
            exact = identification_jacobian(actual, Motion(q), (name,))[1][:, :, 0]
            gap = max(gap, float(np.abs(np.concatenate(both, 1) - exact).max()))
        agrees = gap < 1e-9
        reason = (
            "" if agrees else "x of frame i lies behind the turn β, the turn α before it: β2 ≠ 0 shows it"
        )
        findings.append(
            judged(f"Eq. (13{letter})", f"∂k/∂{column}", "formula", f"apart by {gap:.1g}", agrees, reason)
        )
    return tuple(findings)


def tool(robot: Robot, plate: Plate, q: Float[np.ndarray, "targets n"]) -> tuple[Finding, ...]:
    """Table 2, target by target: its poses, its branches, O of each."""
    places, angles = plate.poses[:, :3, 3], np.rad2deg(np.stack([t.rpy for t in plate.targets]))
    gap = np.abs(np.concatenate([places, angles], 1) - printed.TABLE_2).max()
    centre = 0.5 * (places.max(0) + places.min(0))
    radius = np.linalg.norm(places[:, :2] - centre[:2], axis=1)
    spokes = 2.0 * np.pi * np.arange(10) / 10
    even = centre[:2] + printed.RADIUS * np.stack([np.cos(spokes), np.sin(spokes)], 1)
    off = np.linalg.norm(places[:, :2] - even, axis=1).max()
    solutions = plate_solutions(robot, plate)
    counts = [len(s) for s in solutions]
    reached = np.abs(tool_poses(robot, Motion(q)) - robot.base.pose @ plate.poses).max()
    return (
        checked("Table 2", "ten poses", "10 × (X Y Z, X Y Z)", f"apart by {gap:.1g}", gap < 1e-9,
                "copied into the built-in plate"),
        checked(
            "§4.3", "radius of the circle [m]", "0.25", f"{radius.mean():.4f}",
            abs(radius.mean() - printed.RADIUS) < EVEN, "of Table 2",
        ),
        checked(
            "§4.3", "evenly distributed", "36° apart", f"{1e3 * off:.2f} mm from even", off < EVEN,
            "of Table 2, printed to the millimetre",
        ),
        checked(
            "§4.3", "orientations", "“are the same”", "−150° and −160° about x in turn",
            not np.ptp(printed.TABLE_2[:, 3:], axis=0).any(),
            "the text and Table 2 contradict each other; the table is taken",
        ),
        judged(
            "Table 2", "targets reached", "10", f"{sum(c > 0 for c in counts)}, in "
            f"{between(min(counts), max(counts))} ways each", min(counts) > 0 and reached < 1e-8,
        ),
    )  # fmt: skip


def virtual_example(robot: Robot, tool: Acquisition) -> tuple[Finding, ...]:
    """Table 3: the same hidden errors, found again from Table 2's targets without noise."""
    actual = robot.with_values(printed.TABLE_3_HIDDEN)
    rows = tool.measure(actual, INSTRUMENTS["ideal"], np.random.default_rng(0))
    models = identified(robot, rows)
    texts = printed.named(printed.TABLE_3)
    names = tuple(texts)
    ours = models[1].values(names)
    values = np.array([float(text) for text in texts.values()])
    units = np.array([printed.half_unit(text) for text in texts.values()])
    hidden = np.array([name in printed.TABLE_3_HIDDEN for name in names])
    tiny = np.abs(values) < 1e-5
    rounded = np.abs(ours - values) <= units + 1e-9
    other = ~hidden & ~tiny
    findings = [
        checked("Table 3", name, texts[name], f"{ours[names.index(name)]:.6g}",
               rounded[names.index(name)], "hidden in our virtual arm too")
        for name in printed.TABLE_3_HIDDEN
    ]  # fmt: skip
    findings += [
        checked(
            "Table 3", f"{int(tiny.sum())} constants near zero", f"up to {np.abs(values[tiny]).max():.1e}",
            f"up to {np.abs(ours[tiny]).max():.0e}", np.abs(ours[tiny]).max() < 1e-5,
            "zero in both; how nearly says where a search stops",
        ),
        checked(
            "Table 3", f"{int(other.sum())} further constants", "nominal, rounded",
            f"{int(rounded[other].sum())} agree to the last digit", rounded[other].all(),
        ),
    ]  # fmt: skip
    for title, model in zip(TITLES[1:], models[1:], strict=True):
        gap = np.abs(model.values(names) - actual.values(names)).max()
        findings.append(
            judged("§4.1.3", f"{title}: apart from the hidden constants", "–", f"{gap:.0e}", gap < 1e-6)
        )
    return tuple(findings)


def real_example(robot: Robot, tool: Acquisition) -> tuple[Finding, ...]:
    """Table 4 and §5: what a virtual arm with the identified constants says about the printed errors."""
    texts = printed.named(printed.TABLE_4)
    names = tuple(texts)
    actual = load_robot("aria-table4")
    rows = tool.measure(actual, INSTRUMENTS["ideal"], np.random.default_rng(0))
    short = actual.with_values({"joint6.d": float(robot.values(("joint6.d",))[0])})
    position, angle = mean_errors(actual, robot, rows.q)
    without_d6 = mean_errors(short, robot, rows.q)[0]
    moved = actual.values(names) - robot.values(names)
    turns = np.array([n.split(".")[1] in ("theta", "alpha", "beta") for n in names])
    far, turn = 1e3 * np.abs(moved[~turns]).max(), np.rad2deg(np.abs(moved[turns]).max())
    farthest = names[int(np.argmax(np.where(turns, 0.0, np.abs(moved))))]
    rounding = (
        f"without d6, which Fig. 11's nominal arm seems to know, {1e3 * without_d6:.1f} mm; Table 4 is "
        "rounded, and 0.005 rad of an angle are 5 mm at 1 m"
    )
    alone = "the real arm's rows are not printed, and its non-geometric errors are in no table"
    seen = tool.measure(actual, INSTRUMENTS["plate"], np.random.default_rng(0))
    errors = tuple(row_components(model, seen) for model in identified(robot, seen))
    left, turned = (np.linalg.norm(part, axis=1).mean() for part in (errors[1].position, errors[1].rotation))
    virtual = f"{alone}; a virtual arm with Table 4's constants alone and a plate's noise"
    return (
        without("Table 4", "24 constants of the real arm", "see the table", alone),
        judged("§2.4", "greatest displacement of an axis [mm]", "up to 5", f"{far:.1f} ({farthest})",
               far <= 5.0, "of Table 4; the probe of §5.1 may count with the last link"),
        judged("§2.4", "greatest twist of an axis [°]", "up to 5", f"{turn:.1f}", turn <= 5.0, "of Table 4"),
        judged("§5.3", "errors of the nominal arm there [mm], [°]", "about 2.5 and 2.2 (5 × Fig. 11)",
               f"{1e3 * position:.1f} and {np.rad2deg(angle):.1f}",
               round(1e3 * position, 1) == 2.5 and round(np.rad2deg(angle), 1) == 2.2, rounding),
        without("Fig. 11", "position error after calibration [mm]", "≈ 0.5",
                f"{virtual} ends at {1e3 * left:.2f} mm"),
        without("Fig. 11", "orientation error after calibration [°]", "≈ 0.43",
                f"{virtual} ends at {np.rad2deg(turned):.3f}°"),
        checked("§5.3", "0.5 mm and 0.43° meet §2.4", "yes", "0.50 < 1 and 0.43 < 0.66",
               printed.MEASURED_POSITION < 1e3 * printed.REQUIRED_POSITION
               and printed.MEASURED_ANGLE < printed.REQUIRED_ANGLE),
    )  # fmt: skip
