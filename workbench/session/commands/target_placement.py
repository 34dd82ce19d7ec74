"""Plates that are put in place of the present one."""

from dataclasses import replace

from workbench.plate.plate import Plate, Target
from workbench.session.state import Session
from workbench.session.target_postures import solve_all_targets
from workbench.session.target_steps import move_targets


def place_targets(session: Session, targets: tuple[Target, ...]) -> Session:
    """The session with these targets, the arm in the best mix of branches."""
    return place_plate(session, replace(session.plate, targets=targets))


def place_plate(session: Session, plate: Plate) -> Session:
    """The session with this plate, the arm in the best of the mixes of branches that are tried."""
    states = solve_all_targets(session.robot, plate, region_q=session.region.q)
    return move_targets(session, plate, states)
