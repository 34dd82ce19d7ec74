"""What is laid over the scene."""

from dataclasses import dataclass

from workbench.session.comparison import Stage


@dataclass(frozen=True, kw_only=True)
class Overlay:
    """What is laid over the scene.

    Args:
        nominal: The nominal arm at a measured row.
        calibrated: The calibrated arm.
        points: Where the tool was measured, coloured by its error once there is a fit.
        stage: The model whose errors colour the points; of those not known, the last one before.
        frames: Measured orientations.
        arrows: Errors from measured to predicted places.
        ghosts: The other branches that reach the selected target.
        exaggeration: How many times longer errors of the nominal arm are drawn, and those along a trajectory.
        exaggeration_after: The same for the calibrated arm, whose errors are much smaller.
        law: Label of the effect whose law is laid over the errors along the joints, and whose joint glows;
            the strongest cause if empty, `none` for none.
        bent: The arm as its effects bend it.
        bending: How many times stronger it is then drawn as bent.
    """

    nominal: bool = True
    calibrated: bool = True
    points: bool = True
    stage: Stage = Stage.CAUSES
    frames: bool = False
    arrows: bool = True
    ghosts: bool = True
    exaggeration: float = 50.0
    exaggeration_after: float = 50.0
    law: str = ""
    bent: bool = True
    bending: float = 50.0
