"""Any commands in any order: the session takes each, or refuses it in one sentence and stays as it was.

    SEQUENCES=10000 python -m pytest tests/session/test_random_commands.py -o addopts=""

tries so many sequences; the suite a few.
"""

import dataclasses
import json
import os
import typing
from enum import Enum
from functools import cache

import numpy as np
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule, run_state_machine_as_test

from workbench.base.errors import WorkbenchError
from workbench.base.wording import MAX_SENTENCE
from workbench.plate.plate import Plate
from workbench.session.command import AbstractChange, AbstractTask, kinds
from workbench.session.journal import codec
from workbench.session.journal.numbers import changed_numbers
from workbench.session.state import Session

FEW = 10
STEPS = 8
NUMBERS = (0.0, 0.05, 0.2, 0.4, -0.3, 1.0, -2.6, 1e-6, 1e9, 1e300, -1e300, float("nan"), float("inf"))
COUNTS = (0, 1, 2, 3, 5, 9, 10, 50, -1, 10**6, -(2**63), 2**200)
WORDS = ("", "ARIA", "OPT2", "circle", "grid", "plate", "joint1.theta", "base.x", "++-")
TEXTS = (*WORDS, "x" * 5000, "<b>", "\0")


def values_of(hint) -> st.SearchStrategy:
    """Values of a field's type: sound ones, and those that nobody would type."""
    arguments = typing.get_args(hint)
    if typing.get_origin(hint) is tuple:
        if arguments[-1] is ...:
            return st.lists(values_of(arguments[0]), max_size=8).map(tuple)
        return st.tuples(*map(values_of, arguments))
    if arguments:  # or None
        return st.one_of(*map(values_of, arguments))
    if isinstance(hint, type) and issubclass(hint, Enum):
        return st.sampled_from(list(hint))
    if dataclasses.is_dataclass(hint):
        return st.none() if hint is Plate else made(hint)
    if getattr(hint, "array_type", None) is np.ndarray:
        return st.sampled_from(COUNTS[:FEW]).map(lambda count: np.zeros(max(count, 0)))
    of_type = {float: NUMBERS, int: COUNTS, str: TEXTS, bool: (True, False), bytes: (b"", b"q1[deg]\n1\n")}
    return st.sampled_from(of_type[hint]) if hint in of_type else st.none()


@cache
def made(kind) -> st.SearchStrategy:
    """Records of a type, one strategy for each: `TakeSample` holds another one."""
    return st.deferred(lambda: st.builds(kind, **fields_of(kind)))


def fields_of(kind) -> dict[str, st.SearchStrategy]:
    hints = typing.get_type_hints(kind)
    return {field.name: values_of(hints[field.name]) for field in dataclasses.fields(kind)}


OURS = sorted(
    (k for k in kinds().values() if k.__module__.startswith("workbench.")), key=lambda kind: kind.__name__
)
COMMANDS = st.sampled_from(OURS).flatmap(made)


class Commands(RuleBasedStateMachine):
    """A session to which anything is said. Tasks are checked, as the worker does before it begins them."""

    first: Session

    def __init__(self):
        super().__init__()
        self.session = self.first
        self.before = self.first
        self.sentence = ""

    @rule(command=COMMANDS)
    def carry_out(self, command):
        values, files = codec.encode(command)
        text = json.dumps(values, allow_nan=False)
        again = codec.decode(type(command).__name__, json.loads(text), files.__getitem__)
        assert repr(again) == repr(command)
        self.before = self.session
        try:
            again.check(self.session)
            if isinstance(again, AbstractTask):
                return
            assert isinstance(again, AbstractChange)
            self.session = again.apply(self.session)
        except WorkbenchError as error:
            self.sentence = str(error)

    @invariant()
    def the_session_is_whole(self):
        session = self.session
        assert len(self.sentence) <= MAX_SENTENCE
        assert "\n" not in self.sentence
        assert len(session.plate.targets) == len(session.states) > 0
        assert all(np.isfinite(state.q).all() for state in session.states if state.q is not None)
        json.dumps(changed_numbers(session, self.before), allow_nan=False)


def test_any_commands_in_any_order(first):
    count = int(os.environ.get("SEQUENCES", FEW))
    Commands.first = first
    profile = settings(
        max_examples=count, stateful_step_count=STEPS, database=None, suppress_health_check=list(HealthCheck)
    )
    run_state_machine_as_test(Commands, settings=profile)
