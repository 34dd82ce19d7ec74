"""A plate tried on virtual arms in a session."""

import numpy as np

from workbench.base.errors import OptionError
from workbench.base.wording import plural
from workbench.data.accuracy_requirement import Wanted
from workbench.extras.production.plate_trial import check_tried, rms_of, try_plate
from workbench.plate.plate import AUTO
from workbench.session.command import computed
from workbench.session.commands.plate import AbstractPlateTrial
from workbench.session.live_score import PlateTrial
from workbench.session.stages import PASSING_SHARE
from workbench.session.state import Session

JUDGED_POSES = 200
"""Poses of the region at which arms are judged."""


class TryPlate(AbstractPlateTrial):
    """Find the yield: the share of virtual arms that keep the wanted error after a calibration on this plate.

    Args:
        arms: How many virtual arms.
        seed: Of everything random.
    """

    arms: int = 1000
    seed: int = 0

    title = computed(lambda self: f"Try the plate on {plural(self.arms, 'virtual arm')}")

    def check(self, session: Session) -> None:
        check_tried(session.robot, session.plate)
        for i, state in enumerate(session.states):
            if not state.measurable:
                raise OptionError(f"target {i + 1} is {state.obstacle}; move it, then try the plate")

    def compute(self, session: Session) -> PlateTrial:
        plate, noise, wanted = session.plate, session.noise, session.choices.wanted or Wanted(position=1e-3)
        q = np.stack([state.q for state in session.states])
        found = try_plate(
            session.robot,
            plate.with_joints(q, tuple(state.branch or AUTO for state in session.states)),
            arms=self.arms,
            sigma=(noise.position, noise.rotation),
            wanted=wanted,
            poses=JUDGED_POSES,
            seed=self.seed,
        )
        used = float(np.quantile(found.used, PASSING_SHARE, method="inverted_cdf"))
        kept = f"{100 * PASSING_SHARE:.0f} % of {len(found.met)} virtual arms stay within {used:.3g} mm"
        return PlateTrial(
            plate=plate,
            noise=noise,
            wanted=session.choices.wanted,
            arms=len(found.met),
            share=found.share,
            unreached=found.unreached,
            used=used,
            position=1e-3 * rms_of(found.errors)["position_rms_mm"],
            text=f"{kept} everywhere in the region" if session.choices.wanted is None else found.text,
            blame=found.blame,
        )
