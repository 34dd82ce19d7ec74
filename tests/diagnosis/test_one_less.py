"""Models with a term less, from one factorisation, against those that are fitted anew."""

import numpy as np
import pytest
from tables import BAND, EFFECTS, Table

from workbench.arm.effects import Candidate
from workbench.diagnosis.claims.reduced_models import left_of, left_without, own_offers, validated_without
from workbench.diagnosis.search.evidence import Term, drop, left_by, offer, validated

FREE = tuple(Candidate(e) for e in EFFECTS)
SHRUNK = Candidate(BAND, np.eye(16))


@pytest.mark.parametrize("precision", [1e-6, 0.3, 1e6])
def test_a_term_less_is_as_the_rest_fitted_anew(precision):
    grams = Table(1, joint1_cos2=40.0, joint2_sin1=25.0, joint6_cos4=6.0).grams
    model = (Term(FREE[1]), Term(SHRUNK, precision), Term(FREE[3]))
    groups = [*((t,) for t in model), model[:2], model]
    found = validated_without(grams, model, groups)
    assert found == pytest.approx(np.array([validated(grams, drop(model, g)) for g in groups]), rel=1e-7)
    for term, own in zip(model, own_offers(grams, model), strict=True):
        anew = offer(left_by(grams, drop(model, [term])), term.candidate)
        assert own.gain == pytest.approx(anew.gain, abs=1e-5)
        assert own.log_p == pytest.approx(anew.log_p, abs=1e-5)
        assert own.term.candidate is term.candidate


def test_what_is_left_is_updated_as_terms_come_and_go():
    grams = Table(1, joint1_cos2=40.0, joint2_sin1=25.0, joint6_cos4=6.0).grams
    model = (Term(FREE[1]), Term(SHRUNK, 0.3), Term(FREE[3]))
    every = np.arange(len(grams.total))
    for k in range(len(model) + 1):
        anew = left_by(grams, model[:k]).inner(every)
        assert left_of(grams, model[:k]).inner(every) == pytest.approx(anew, abs=1e-6)
    for group in (model[1:2], model[:1], model[:2]):
        rest, found = left_by(grams, drop(model, group)), left_without(grams, model, group)
        assert (found.model, found.freedom) == (rest.model, rest.freedom)
        assert found.inner(every) == pytest.approx(rest.inner(every), abs=1e-6)
