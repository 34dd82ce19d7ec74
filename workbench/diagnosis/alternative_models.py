"""Models other than a search's own on the judging rows: rivals, and the ranking of candidates."""

from dataclasses import dataclass

import numpy as np

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
        fitted, held_out = self.searched.stage.fitted, self.ready.held_out_data
        data = held_out if len(held_out) else fitted.problem.data
        arm = robot_with(fitted, self.searched.grams, model)
        return Errors.of(self.ready.errors_on(data, arm, fitted.problem.instrument(fitted.fit.x)))

    def alternatives(self, term: Term) -> tuple[Ranked, ...]:
        """The best candidates for the place of a term of the search's model, with the error that remains."""
        place = place_of(self.searched, (term,))
        minimum = max(MIN_RELATIVE_EVIDENCE * place.own, place.own - MAX_EVIDENCE_GAP)
        near = distinct([o for o in place.offers if o.gain > minimum])[:MAX_LISTED_RIVALS]
        return tuple(_ranked(o, self.errors((*place.left.model, o.term))) for o in near)

    def ranking(self) -> tuple[Ranked, ...]:
        """Candidates by their contribution to the geometry alone, one per label; the first few are
        evaluated."""
        found = offers(left_by(self.searched.grams, ()), self.searched.offered.candidates)
        best = enumerate(distinct(sorted(found, key=lambda o: -o.gain))[:MAX_RANKED])
        return tuple(_ranked(o, self.errors((o.term,)) if k < MAX_EVALUATED else None) for k, o in best)


def _ranked(offer: Offer, errors: Errors | None) -> Ranked:
    candidate = offer.term.candidate
    return Ranked(candidate.effect, offer.gain, float(np.exp(offer.log_p)), errors, candidate.shrunk)
