"""Models other than a search's own on the judging rows: rivals, and the ranking of candidates."""

from dataclasses import dataclass

import numpy as np

from workbench.arm.robot import Robot
from workbench.diagnosis.claims.accepted_terms import distinct, place_of
from workbench.diagnosis.result import Ranked
from workbench.diagnosis.search.evidence import Model, Offer, Term, left_by, offers
from workbench.diagnosis.search.refit import robot_with
from workbench.diagnosis.search.rounds import Searched
from workbench.identification.errors.row_errors import Errors
from workbench.identification.preparation import Prepared

MAX_EVALUATED = 12
"""Number of ranked candidates evaluated on the judging rows."""
MAX_LISTED_RIVALS = 3
"""Maximum number of rivals listed for an effect."""
MIN_RELATIVE_EVIDENCE = 0.5
"""Minimum evidence of a rival relative to the effect's to be listed …"""
MAX_EVIDENCE_GAP = 100.0
"""… and maximum difference between the two."""
MAX_RANKED = 40
"""Maximum number of candidates in the ranking."""


@dataclass(frozen=True, eq=False)
class ModelComparison:
    """Errors of models on the judging rows; on the fitted ones without those."""

    ready: Prepared
    searched: Searched

    def errors(self, model: Model) -> Errors:
        """Errors of the geometry with a model's effects, by the linear solution at the fit."""
        fitted = self.searched.stage.fitted
        found = fitted.problem.instrument(fitted.fit.x)
        return self._errors(robot_with(fitted, self.searched.grams, model), found)

    def alternatives(self, term: Term) -> tuple[Ranked, ...]:
        """Rivals of a term of the search's model, with the remaining error in its place."""
        rivals = rivals_of(self.searched, term)
        return tuple(_ranked(rival, self.errors((*rest, rival.term))) for rest, rival in rivals)

    def ranking(self) -> tuple[Ranked, ...]:
        """Candidates by their contribution to the geometry alone; the first few are evaluated."""
        best = enumerate(ranked(self.searched))
        return tuple(_ranked(o, self.errors((o.term,)) if k < MAX_EVALUATED else None) for k, o in best)

    def _errors(self, arm: Robot, found) -> Errors:
        held_out = self.ready.held_out_data
        data = held_out if len(held_out) else self.searched.stage.fitted.problem.data
        return Errors.of(self.ready.errors_on(data, arm, found))


def _ranked(offer: Offer, errors: Errors | None) -> Ranked:
    candidate = offer.term.candidate
    return Ranked(candidate.effect, offer.gain, float(np.exp(offer.log_p)), errors, candidate.shrunk)


def rivals_of(searched: Searched, term: Term) -> list[tuple[Model, Offer]]:
    """The best candidates for the place of an accepted term, each with the rest of its model."""
    place = place_of(searched, (term,))
    minimum = max(MIN_RELATIVE_EVIDENCE * place.own, place.own - MAX_EVIDENCE_GAP)
    near = distinct([o for o in place.offers if o.gain > minimum])
    return [(place.left.model, found) for found in near[:MAX_LISTED_RIVALS]]


def ranked(searched: Searched) -> list[Offer]:
    """Contributions of candidates to the geometry alone, best first; one per label."""
    found = offers(left_by(searched.grams, ()), searched.offered.candidates)
    return distinct(sorted(found, key=lambda o: -o.gain))[:MAX_RANKED]
