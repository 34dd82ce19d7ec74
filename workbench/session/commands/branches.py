"""Commands about branches: which solution of the inverse kinematics each target is measured in."""

from collections.abc import Hashable
from dataclasses import dataclass, replace

import numpy as np

from workbench.base.errors import OptionError
from workbench.plate.plate import AUTO
from workbench.session.command import AbstractChange
from workbench.session.reach import place, place_all
from workbench.session.state import Session
from workbench.session.target_steps import changed, check_free, with_item


@dataclass(frozen=True)
class ChooseBranch(AbstractChange):
    """Measure a target in the branch of this name, or leave that to the program (`auto`)."""

    target: int
    branch: str

    @property
    def title(self) -> str:
        return f"Target {self.target + 1}: branch {self.branch}"

    @property
    def key(self) -> Hashable | None:
        return ("branch", self.target)

    def check(self, session: Session) -> None:
        session.check_target(self.target)
        check_free(session)
        known = [way.name for way in session.ways] if self.target == session.selected else [self.branch]
        if self.branch not in (AUTO, *known):
            raise OptionError(f"target {self.target + 1} has no branch '{self.branch}' within the limits")

    def apply(self, session: Session) -> Session:
        target = replace(session.plate.targets[self.target], branch=self.branch, q=None)
        state = place(session.robot, session.plate, target, session.states[self.target].q)
        plate = replace(session.plate, targets=with_item(session.plate.targets, self.target, target))
        return changed(session, plate, with_item(session.states, self.target, state), selected=self.target)


@dataclass(frozen=True)
class MixBranches(AbstractChange):
    """Take the mix of branches that predicts the least error; branches chosen by hand stay."""

    @property
    def title(self) -> str:
        return "Choose the best mix of branches"

    @property
    def key(self) -> Hashable | None:
        return None

    def check(self, session: Session) -> None:
        check_free(session)

    def apply(self, session: Session) -> Session:
        rng = np.random.default_rng(len(session.history))
        states = place_all(session.robot, session.plate, region_q=session.region_q, rng=rng)
        return changed(session, session.plate, states)
