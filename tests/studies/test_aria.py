"""The ARIA paper done again: what must agree does, what can't is said, and the command writes it all."""

import numpy as np
import pytest

from studies import aria_printed as printed
from studies.aria import reproduce_aria
from studies.conftest import agree, finding
from studies.finding import Verdict, checked, judged


@pytest.fixture(scope="module")
def found():
    return reproduce_aria(arms=1)


def test_what_is_not_printed_is_not_counted():
    """Hidden values, arithmetic and empty cells; the rest is one rule."""
    found = (
        judged("Table 1", "a", "1.0", "1.0", np.bool_(True)),
        judged("Table 1", "b", "–", "1.0", np.bool_(True)),
        judged("Table 1", "c", "(implied)", "no", np.bool_(False), "why"),
        checked("Table 1", "d", "2.0", "2.0", np.bool_(True)),
        judged("Table 1", "e", "up to 5", "1.0", np.bool_(True)),
    )
    assert [f.verdict.name for f in found] == ["AGREES", "HOLDS", "FAILS", "HOLDS", "HOLDS"]


def test_what_must_agree_agrees(found):
    agree(
        found,
        ("Table 1", "nominal"), ("Eq. (3)", "orientation"), ("Eq. (13a)", "theta"), ("Eq. (13e)", "beta"),
        ("Table 2", "ten poses"), ("Table 2", "reached"), ("§4.2", "same O in different cubes"),
        ("§4.2", "rank"), ("Table 3", "joint4.theta"), ("Table 3", "near zero"), ("Table 3", "further"),
        ("§4.1.3", "OPT1"), ("§5.2", "OLS"), ("§4.4, 1", "arbitrary"), ("§4.4, 3", "measured poses"),
    )  # fmt: skip


def test_what_differs_or_can_not_be_given_is_named(found):
    assert finding(found, "Eq. (2)", "joint 3").verdict is Verdict.FAILS
    assert finding(found, "Eq. (13d)", "alpha").verdict is Verdict.DIFFERS
    assert finding(found, "Fig. 11", "position").verdict is Verdict.NONE


def test_without_noise_every_arm_is_found_again(found):
    for comparison in found.exact:
        assert comparison.reached == 1
        assert comparison.own_position[:, 1:].max() < 1e-9
        assert comparison.region[:, 1:].max() < 1e-9
        assert comparison.region[:, 0].min() > 5e-3


def test_with_noise_the_ways_of_measuring_part_at_poses_that_were_not_measured(found):
    """One branch for all of Table 2 leaves several times the error of clustering or of mixed branches."""
    _, clustering, one_branch, mixed = (np.median(c.region[:, 1]) for c in found.noisy)
    assert one_branch > 3 * clustering
    assert one_branch > 3 * mixed
    for comparison in found.noisy:
        assert comparison.within(1e-3, np.deg2rad(0.66)) == 1.0
        assert 5e-5 < np.median(comparison.own_position[:, 1]) < 3e-4


def test_the_command_writes_every_finding(found, check_command):
    check_command("aria", found, "Eq. (3)")


def test_digits_say_how_far_a_number_is_rounded():
    halves = {"0.34": 0.005, "1.57": 0.005, "-0.8": 0.05, "1.67e-7": 5e-10, "-0.00081": 5e-6}
    assert {text: printed.half_unit(text) for text in halves} == pytest.approx(halves)
