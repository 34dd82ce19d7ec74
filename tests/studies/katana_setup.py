"""The arm and the set-up of the Katana thesis: its tables of constants, its equations, its influences."""

import numpy as np
from scipy.spatial.transform import Rotation

from studies import katana_printed as printed
from studies.finding import Finding, checked, judged
from studies.katana_influence import ANGLE, LENGTH_DEVIATION, Influence, influence
from studies.katana_study import zxz_of
from workbench import Motion, Robot, identification_jacobian, link_frames, load_robot, tool_poses
from workbench.arm.frame import FRAME_PARTS
from workbench.plate.poses.iso_cube import CubePoses
from workbench.plate.poses.sampling import random_poses

ROUNDING = 1e-12
"""Lengths [m] and angles [rad] apart by less are the same."""
COPIED = "copied into the built-in arm"
"""Why a table that the arm was made from is not counted."""
POSES = 200
"""Random poses at which the two forms are compared."""


def arm() -> tuple[Finding, ...]:
    """Tables 3.1, 4.1, 4.2, 4.4 and the frames."""
    craig, three = load_robot("katana450"), load_robot("katana450-three-rotation")
    q = random_poses(craig, POSES, rng=np.random.default_rng(0))
    poses = tool_poses(craig, Motion(q))
    turns = poses[:, :3, :3]
    distance = float(np.abs(poses - tool_poses(three, Motion(q))).max())
    again = float(np.abs(Rotation.from_euler("ZXZ", zxz_of(turns)).as_matrix() - turns).max())
    limits = np.rad2deg(craig.limits)
    masses = [joint.mass for joint in craig.moving[1:]]
    kilograms = printed.STIFFNESS[0] / printed.KILOGRAM_METRE_PER_DEGREE
    compliance = next(e for e in load_robot("katana450-tilting").effects if e.name == "joint-compliance")
    stiffness = 1.0 / np.array(compliance.coefficients)
    return (
        judged(
            "Tables 3.1, 4.1", "Craig's and Hayati's form against the three-rotation form", "the same arm",
            f"apart by {distance:.1g} m", distance < ROUNDING,
        ),
        checked(
            "Table 3.1", "limits of the five joints [°]", "±169.5, −30 … 102, ±122.5, ±112, ±168",
            ", ".join(f"{low:g} … {high:g}" for low, high in limits.round(6)),
            np.allclose(limits, printed.LIMITS), COPIED,
        ),
        checked(
            "Eq. (4.7)", "nominal base from the reference corner [mm]", "55, 55, 201.5",
            ", ".join(f"{v:g}" for v in 1e3 * craig.base.xyz),
            np.allclose(craig.base.xyz, [0.055, 0.055, 0.2015]), COPIED,
        ),
        judged(
            "§3.2", "ZXZ Euler angles of the tool, there and back", "–", f"apart by {again:.0e}",
            again < ROUNDING,
        ),
        checked(
            "Table 4.2", "masses of links 2 to 5 [kg]", ", ".join(f"{m:g}" for m in printed.MASSES),
            ", ".join(f"{m:g}" for m in masses), masses == printed.MASSES, COPIED,
        ),
        _centres(craig, three, q),
        checked(
            "§3.3, Table 4.2", "mass of the attachment, of link 5 [kg]",
            f"{printed.ATTACHMENT:g}, {printed.MASSES[-1]:g}", f"{masses[-1]:g}",
            masses[-1] == printed.ATTACHMENT,
            "which part of the wrist turns with the 0.5 kg attachment is not said; the table is taken",
        ),
        checked(
            "Table 4.4", "k of joint 1 [kg·m/°]; of the built-in arm [N m/rad]", f"{kilograms:g}",
            f"{stiffness[0]:.0f}", np.allclose(stiffness, printed.STIFFNESS, rtol=1e-5),
            f"a unit turned: weight of {kilograms:g} kg on a metre's arm for each degree",
        ),
    )  # fmt: skip


def _centres(craig: Robot, three: Robot, q: np.ndarray) -> Finding:
    """Table 4.2's centres of gravity stand at the same places in both forms."""
    places = []
    for robot in (craig, three):
        frames = link_frames(robot, Motion(q))[:, 1:6]
        coms = np.array([joint.com for joint in robot.moving])
        places.append(np.einsum("rjab,jb->rja", frames[:, :, :3, :3], coms) + frames[:, :, :3, 3])
    distance = float(np.abs(places[0] - places[1])[:, 1:].max())
    return checked(
        "Table 4.2", "centres of gravity of links 2 to 5 in both forms", "100, 104, 80, 70 mm",
        f"apart by {distance:.0e} m", distance < ROUNDING, COPIED,
    )  # fmt: skip


def equations() -> tuple[Finding, ...]:
    """Printed equations that are corrected, not copied."""
    length, tilt = 0.05, float(printed.CLEARANCE[1])
    inverted = np.sqrt(1.0 / np.sin(tilt) ** 2 - 1.0) / (length / 2.0)
    right = length / 2.0 * np.tan(tilt)
    ratio = np.linspace(0.0, 1.0, 2001)
    stated = ratio * 1.5708 / (ratio + (1.0 - ratio))
    stray = float(np.rad2deg(np.abs(stated - np.arctan2(ratio, 1.0 - ratio)).max()))
    return (
        judged(
            "Eq. (5.15)", "clearance of joint 2 for a shaft of 50 mm [mm]", f"{1e3 * inverted:.2g}",
            f"{1e3 * right:.3f}", np.isclose(inverted, right),
            "the printed equation is inverted and has not the unit of a length: r = (L/2) tan C",
        ),
        judged(
            "Eq. (5.16)", "γ off the direction of the moment [°]", "0", f"up to {stray:.1f}", stray < 0.05,
            "γ in proportion to the components depends on the frame; the direction itself is used",
        ),
    )  # fmt: skip


def influences(found: Influence, cube: CubePoses) -> tuple[Finding, ...]:
    """§3.5, §3.6 and Fig. 3.8."""
    at = {name: k for k, name in enumerate(found.names)}
    theta, alpha = at["joint2.theta"], at["joint3.alpha"]
    lengths = [k for k, name in enumerate(found.names) if name.endswith((".a", ".d"))]
    off = float(np.abs(found.distances[:, lengths] - LENGTH_DEVIATION).max())
    second, third = found.distances[:, theta], found.distances[:, at["joint3.theta"]]
    robot = load_robot("katana450")
    example = influence(
        robot, Motion(np.deg2rad([[0.0, 0.0, 0.0, 80.0, 0.0]])), names=printed.CONSTANTS
    ).distances[0]
    three, four = (1e3 * example[at[f"joint{j}.theta"]] for j in (3, 4))
    levers = [value / ANGLE for value in (printed.THETA_2, float(second.mean()))]
    far = (
        f"the mean lever of θ2 is {levers[0]:.2f} m in the thesis and {levers[1]:.2f} m at our poses, whose "
        "cube reaches nearer to the arm; the printed value lies within what θ2 does over the poses"
    )
    return (
        judged("§3.5", "+0.1 mm of a length moves the tool by [mm]", "0.1 everywhere",
               f"0.1, off by {1e3 * off:.0e}", off < ROUNDING),
        judged("Fig. 3.8", "mean influence of θ2 [mm]", f"{1e3 * printed.THETA_2:g}",
               f"{1e3 * second.mean():.2f} ({1e3 * second.min():.2f} … {1e3 * second.max():.2f})",
               abs(second.mean() - printed.THETA_2) < 5e-6, far),
        judged("§3.6", "θ2 is the most influential on average", "yes",
               found.names[int(np.argmax(found.mean))], int(np.argmax(found.mean)) == theta),
        judged("§3.6", "k8 of α2 for mean influences", f"{printed.ALPHA_2_SHARE:g}",
               f"{(found.mean / found.mean.max())[alpha]:.2f}",
               abs((found.mean / found.mean.max())[alpha] - printed.ALPHA_2_SHARE) < 0.005,
               f"α2 moves the tool {1e3 * found.mean[alpha]:.2f} mm, printed 0.59 · 0.34 = 0.20; θ2 less"),
        judged("§3.5", "θ3 at its greatest beats θ2 at its least", "yes",
               f"{1e3 * third.max():.2f} > {1e3 * second.min():.2f} mm", third.max() > second.min()),
        judged("§3.6", "θ1 = θ2 = θ3 = θ5 = 0, θ4 = 80°: influence of θ3, θ4 [mm]", "θ4 larger",
               f"{three:.2f}, {four:.2f}", four > three,
               "which way θ4 counts decides how far the tool is from joint 3"),
        judged("§3.4", "118 poses, all joints move from one to the next", "yes",
               f"least motion {np.rad2deg(cube.min_move):.1f}°", cube.min_move > 0.0,
               f"largest cube here {1e3 * float(np.ptp([cube.cube.min, cube.cube.max], axis=0)[0]):.0f} mm"),
    )  # fmt: skip


def redundant() -> tuple[Finding, ...]:
    """How many constants of both forms are independent, by poses all over the joint space."""
    craig, three = load_robot("katana450"), load_robot("katana450-three-rotation")
    frames = tuple(f"{frame}.{part}" for frame in ("base", "tool") for part in FRAME_PARTS)
    seventeen, twelve = _rank(craig, printed.CONSTANTS), _rank(three, three.default_free)
    full, short = (
        _rank(r, tuple(e.name for e in r.elements if e.matrix is None) + frames) for r in (craig, three)
    )
    return (
        judged("Eq. (3.5)", "17 constants without redundancy", "17", f"{seventeen} independent",
               seventeen == 17, f"by full poses; by points {_rank(craig, printed.CONSTANTS, channels=3)}"),
        judged("§4.2", "three rotations a joint “without increasing redundancy”", "12 constants",
               f"{twelve} independent", twelve == 12,
               "β4 turns about joint 5's own axis; from points, as measured, "
               f"{_rank(three, three.default_free, channels=3)}"),
        judged("§4.2", "both forms hold every error of the arm", f"{4 * craig.dof + 6} with base and tool",
               f"Craig and Hayati {full}, three rotations {short}", short == full,
               "(4.3) and (4.4) have no turn between joints 3 and 4, so that their axes stay parallel"),
    )  # fmt: skip


def _rank(robot: Robot, names: tuple[str, ...], *, channels: int = 6) -> int:
    """How many constants poses (or places: three channels) tell apart."""
    q = random_poses(robot, POSES, rng=np.random.default_rng(0))
    twists = identification_jacobian(robot, Motion(q), names)[1][:, :channels]
    return int(np.linalg.matrix_rank(twists.reshape(-1, len(names)), tol=1e-8 * np.linalg.norm(twists)))
