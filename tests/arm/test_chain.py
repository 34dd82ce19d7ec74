"""The chain of elementary transforms: against products of plain matrices, and its derivative."""

import numpy as np
from checks import check_jacobian, pose_change
from generator import four, move, rotation, turn
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.arm import chain as chains
from workbench.arm.chain import Axis, Chain, Element

CODES = "xyz"


def random_chain(seed, length, *, constants=True):
    """Elements of every kind, some of them driven, joints in the order of the chain; and three postures."""
    rng, elements, joints = np.random.default_rng(seed), [], 0
    for k in range(length):
        axis = Axis(rng.integers(0, 7 if constants else 6))
        if axis is Axis.CONSTANT:
            matrix = four(rotation(rng.normal(size=3))) @ move("x", rng.normal())
            elements.append(Element(axis, f"e{k}", matrix=matrix))
            continue
        driven = rng.random() < 0.4 or k == 0
        elements.append(Element(axis, f"e{k}", float(rng.normal()), joint=joints if driven else None))
        joints += driven
    return rng, Chain(tuple(elements), joints), rng.normal(size=(3, joints))


def product(chain, row, shift=None):
    """The same chain multiplied out matrix by matrix; also every frame on the way."""
    t, frames = np.eye(4), [np.eye(4)]
    for k, e in enumerate(chain.elements):
        v = e.value + (0 if e.joint is None else row[e.joint]) + (0 if shift is None else shift[k])
        step = (turn if e.axis.turns else move)(CODES[e.axis % 3], v)
        t = t @ (e.matrix if e.axis is Axis.CONSTANT else step)
        frames.append(t)
    return t, frames


@given(st.integers(0, 10_000), st.integers(1, 14))
@settings(max_examples=60)
def test_poses_are_the_product(seed, length):
    _, chain, q = random_chain(seed, length)
    q *= [[1e-3], [1.0], [30.0]]  # in every quarter of several turns
    expected = [product(chain, row)[0] for row in q]
    np.testing.assert_allclose(chains.poses(chain, q), expected, rtol=0.0, atol=2e-11)


@given(st.integers(0, 10_000), st.integers(1, 14))
@settings(max_examples=30)
def test_other_values_and_shifts(seed, length):
    rng, chain, q = random_chain(seed, length)
    shift = rng.normal(size=(3, length))
    expected = [product(chain, row, s)[0] for row, s in zip(q, shift, strict=True)]
    np.testing.assert_allclose(chains.poses(chain, q, shift=shift), expected, atol=1e-12)
    np.testing.assert_allclose(chains.twists(chain, q, np.arange(0), shift=shift)[0], expected, atol=1e-12)
    values = rng.normal(size=length)
    expected = [product(chain, row, values - chain.values)[0] for row in q]
    np.testing.assert_allclose(chains.poses(chain.with_values(values), q), expected, atol=1e-12)


@given(st.integers(0, 10_000), st.integers(1, 14))
@settings(max_examples=30)
def test_frames_on_the_way(seed, length):
    _, chain, q = random_chain(seed, length)
    found = chains.frames(chain, q, np.arange(-1, length))
    for row in range(3):
        np.testing.assert_allclose(found[row], product(chain, q[row])[1], atol=1e-12)
    twice = chains.frames(chain, q, np.array([length - 1, length - 1]))
    np.testing.assert_array_equal(twice[:, 0], twice[:, 1])


@given(st.integers(0, 10_000), st.integers(1, 14))
@settings(max_examples=30)
def test_twists_are_the_derivative(seed, length):
    _, chain, q = random_chain(seed, length, constants=False)
    found, twists = chains.twists(chain, q, np.arange(length))
    np.testing.assert_allclose(found, chains.poses(chain, q), atol=1e-14)
    moved = lambda v: chains.poses(chain.with_values(v), q)  # noqa: E731
    check_jacobian(moved, twists, np.array(chain.values), difference=pose_change)
