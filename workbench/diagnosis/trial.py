"""Other models than a search's own, on the rows that judge: rivals, and the ranking of candidates."""

import numpy as np

from workbench.arm.robot import Robot
from workbench.diagnosis.evidence import Model, Offer, Term, left_by, offers
from workbench.diagnosis.places import distinct, place_of
from workbench.diagnosis.refit import large, linear_answer, refit, robot_with
from workbench.diagnosis.result import Ranked
from workbench.diagnosis.rounds import Searched
from workbench.identification.preparation import Prepared
from workbench.identification.row_errors import Errors

TRIED = 12
"""Candidates of the ranking that are tried out on the rows that judge."""
LISTED = 3
"""Rivals that are listed for an effect."""
MENTIONED = 0.5
"""Part of an effect's evidence that a rival must have to be mentioned …"""
MUCH_WORSE = 100.0
"""… and how far below the effect's it may lie at most."""
RANKED = 40
"""Candidates in the ranking."""


class Trial:
    """Errors of models on the rows that judge; without those, on the fitted ones."""

    def __init__(self, ready: Prepared, searched: Searched):
        fitted = searched.stage.fitted
        self._found = fitted.problem.instrument(fitted.fit.x)
        self._searched = searched
        self._ready = ready
        self._data = ready.held if len(ready.held) else fitted.problem.data

    def errors(self, model: Model) -> Errors:
        """Of the geometry with a model's effects, by the linear solution at the fit."""
        return self._errors(robot_with(self._searched.stage.fitted, self._searched.grams, model), self._found)

    def refitted(self, model: Model) -> Errors:
        """Likewise, fitted anew where the problem is not too large for that."""
        stage, grams = self._searched.stage, self._searched.grams
        if large(stage.fitted.problem):
            return self.errors(model)
        begin = linear_answer(stage.fitted, grams, model)
        rows = stage.rows.take(stage.keep)
        fit = refit(stage.geometric, grams, model, data=rows, begin=begin).fit
        return self._errors(fit.arm, fit.problem.instrument(fit.x))

    def alternatives(self, term: Term) -> tuple[Ranked, ...]:
        """Rivals of a term of the search's model, with the error that they leave in its place."""
        rivals = rivals_of(self._searched, term)
        return tuple(_ranked(rival, self.errors((*rest, rival.term))) for rest, rival in rivals)

    def ranking(self) -> tuple[Ranked, ...]:
        """The candidates by what they would add to the geometry alone; the first few tried out."""
        best = enumerate(ranked(self._searched))
        return tuple(_ranked(o, self.errors((o.term,)) if k < TRIED else None) for k, o in best)

    def _errors(self, arm: Robot, found) -> Errors:
        return Errors.of(self._ready.errors_on(self._data, arm, found))


def _ranked(offer: Offer, errors: Errors | None) -> Ranked:
    candidate = offer.term.candidate
    return Ranked(candidate.effect, offer.gain, float(np.exp(offer.log_p)), errors, candidate.shrunk)


def rivals_of(searched: Searched, term: Term) -> list[tuple[Model, Offer]]:
    """The best candidates for the place of an accepted term, each with the model that they would join."""
    place = place_of(searched, (term,))
    minimum = max(MENTIONED * place.own, place.own - MUCH_WORSE)
    near = distinct([o for o in place.offers if o.gain > minimum])
    return [(place.left.model, found) for found in near[:LISTED]]


def ranked(searched: Searched) -> list[Offer]:
    """What the candidates would add to the geometry alone, the best first; one for each label."""
    found = offers(left_by(searched.grams, ()), searched.offered.candidates)
    return distinct(sorted(found, key=lambda o: -o.gain))[:RANKED]
