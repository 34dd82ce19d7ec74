"""What the ARIA paper says about its three ways of choosing poses, and what many virtual arms say."""

import numpy as np

from studies import aria_printed as printed
from studies.aria_arms import Comparison
from studies.finding import Finding, between, judged, without
from workbench import Plate, Robot
from workbench.arm.linearisation import linearise
from workbench.extras.poses.clustering import Clustering
from workbench.plate.target_branches import plate_solutions, single_branches

ALIKE = float(np.sqrt(10.0))
"""Errors within this factor are of the same order of magnitude: half of one up or down."""
ALIKE_SEARCHES = 0.05
"""Relative difference of errors that are called similar."""
ROUNDING = 1e-9
"""Errors below this [m] are rounding."""


def clustering_claims(found: Clustering, robot: Robot, plate: Plate) -> tuple[Finding, ...]:
    """§4.2: ten configurations with the same O in different clusters; what else the set must have."""
    best, turned = found.best, found.turned
    alone = [
        np.linalg.svd(linearise(robot, q).unwhitened, compute_uv=False)
        for q in single_branches(plate_solutions(robot, plate)).values()
    ]
    ratio = max(values[-1] / values[0] for values in alone)
    return (
        judged(
            "§4.2", "poses with the same O in different cubes", "10",
            f"{len(set(best.cubes.tolist()))}, O {between(best.o.min(), best.o.max(), '.4f')}",
            len(set(best.cubes.tolist())) == 10 and best.difference <= 0.01,
            f"{found.region.cube_text} in the region of the plate",
        ),
        judged(
            "§4.2", "same O suffices", "(implied)",
            f"rank {turned.rank} of {len(robot.default_free)} with joint 1 alone turned",
            turned.rank == len(robot.default_free),
            "O does not change when joint 1 turns, so the rank must be asked for as well",
        ),
        judged(
            "§4.2", "rank, σmin/σmax of the stacked Jacobian", "–", f"{best.rank}, {best.stacked:.3f}",
            best.rank == len(robot.default_free) and best.stacked >= ratio,
            f"the best single branch of Table 2 has {ratio:.3f}",
        ),
        without("Fig. 5", "ten configurations", "a drawing", "no coordinates of its clusters are printed"),
    )  # fmt: skip


def claims(exact: tuple[Comparison, ...], noisy: tuple[Comparison, ...]) -> tuple[Finding, ...]:
    """§4.4 and Fig. 7."""
    angle = np.deg2rad(printed.REQUIRED_ANGLE)
    wanted = "< 1 mm and < 0.66° in each entry"
    findings = []
    for comparison in (*exact[:3], *noisy[:3]):
        share = comparison.within(printed.REQUIRED_POSITION, angle)
        lost = len(comparison.own_position) - comparison.reached
        noise = "no noise" if comparison.instrument.sigma_position == 0 else "0.1 mm, 0.02°"
        findings.append(
            judged(
                "§4.4, 1", f"{comparison.acquisition.title}; {noise}", wanted,
                f"{100 * share:.0f} % of {comparison.reached} arms", share == 1.0,
                f"{lost} arms do not reach every pose" if lost else "a bound",
            )
        )  # fmt: skip
    shown, why = "axes without readable numbers", "the text gives no numbers"
    fig_7 = without("Fig. 7", "heights of the plotted errors", shown, why)
    return (*findings, *_orders(exact, noisy), _algorithms(noisy), fig_7)


def _orders(exact: tuple[Comparison, ...], noisy: tuple[Comparison, ...]) -> tuple[Finding, ...]:
    minimum = [float(np.nanmedian(c.own_position[:, 1:])) for c in exact[:3]]
    own = [1e3 * float(np.nanmedian(c.own_position[:, 1])) for c in noisy[:3]]
    region = [1e3 * float(np.nanmedian(c.region[:, 1])) for c in noisy]
    exactly = ", ".join(f"{value:.0e}" for value in minimum)
    return (
        judged(
            "§4.4, 2", "e_p of standard far below the others; no noise [m]", "much smaller", exactly,
            minimum[0] < min(minimum[1:]) / ALIKE and minimum[0] > ROUNDING,
            "here all three end at rounding: a search that runs to the end leaves nothing to compare",
        ),
        judged(
            "§4.4, 2", "the same at the measured poses; with noise [mm]", "much smaller",
            ", ".join(f"{value:.3f}" for value in own), own[0] < min(own[1:]) / 2,
            "at the measured poses every way shows the noise of the instrument",
        ),
        judged(
            "§4.4, 2", "the same at other poses of the region; with noise [mm]", "much smaller",
            ", ".join(f"{value:.3f}" for value in region[:3]), region[0] < min(region[1:3]) / 2,
            "clustering is as good once its set has a well-conditioned Jacobian; Table 2 suffers from its "
            f"one branch, and with branches mixed it has {region[3]:.3f}",
        ),
        judged(
            "§4.4, 3", "clustering and arbitrary choice; measured poses [mm]", "same order of magnitude",
            f"{own[1]:.3f} and {own[2]:.3f}", max(own[1:]) < ALIKE * min(own[1:]),
            f"within a factor of {ALIKE:.1f}",
        ),
        judged(
            "§4.4, 3", "clustering and arbitrary choice; region [mm]", "same order of magnitude",
            f"{region[1]:.3f} and {region[2]:.3f}", max(region[1:3]) < ALIKE * min(region[1:3]),
            "in one branch Table 2 leaves some combinations of constants open about ten times as wide",
        ),
    )  # fmt: skip


def _algorithms(noisy: tuple[Comparison, ...]) -> Finding:
    spread = max(float(np.nanmax(np.ptp(c.region[:, 1:], axis=1) / c.region[:, 1:].min(1))) for c in noisy)
    return judged(
        "§5.2", "OLS, OPT1 and OPT2", "similar", f"region errors apart by at most {100 * spread:.2g} %",
        spread < ALIKE_SEARCHES, "the same least squares by three searches; within 5 % counts as similar",
    )  # fmt: skip
