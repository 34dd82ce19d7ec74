"""Writing and reading again gives the same measurements, whatever they are and in whatever unit."""

from dataclasses import fields

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from workbench import Dataset, read_measurements, write_measurements

NOT_IN_THE_FILE = {"source", "notes", "row", "joint_units"}
quick = settings(max_examples=40)
texts = st.text(
    st.characters(categories=("L", "N", "P", "S"), exclude_characters="#"), min_size=1, max_size=6
)


def assert_same(ours: Dataset, theirs: Dataset, *, rotation: float = 1e-14):
    for f in fields(Dataset):
        a, b = getattr(ours, f.name), getattr(theirs, f.name)
        if f.name in NOT_IN_THE_FILE:
            continue
        if f.name == "rotation" and a is not None:
            np.testing.assert_allclose(a, b, atol=rotation)
        elif isinstance(a, np.ndarray | dict):
            np.testing.assert_equal(a, b, err_msg=f.name)
        else:
            assert a is None or a == b, f.name


@st.composite
def columns(draw):
    """Fields of a `Dataset`; it is built in the test, as its run-time checks draw random numbers."""
    rows, joints = draw(st.integers(1, 6)), draw(st.integers(1, 7))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    maybe = lambda value: value if draw(st.booleans()) else None  # noqa: E731
    labels = lambda: np.array(draw(st.lists(texts, min_size=rows, max_size=rows)), dtype=str)  # noqa: E731
    size = 10.0 ** draw(st.integers(-6, 3))
    temperature = rng.normal(23, 2, rows)
    temperature[rng.random(rows) < 0.3] = np.nan
    exclude = rng.random(rows) < 0.3
    exclude[0] = False
    return dict(
        q=rng.normal(0, 3, (rows, joints)),
        position=size * rng.normal(0, 1, (rows, 3)),
        rotation=maybe(Rotation.from_rotvec(rng.normal(0, 2, (rows, 3))).as_matrix()),
        markers=maybe(rng.normal(0, 1, (rows, 2, 3))),
        distance=maybe(rng.random(rows)),
        anchor=labels(),
        **{name: maybe(labels()) for name in ("contact", "point", "session", "group", "reason")},
        time=maybe(np.sort(rng.random(rows) * 1e4)),
        temperature=maybe(temperature),
        payload=maybe(rng.random(rows)),
        torque=maybe(rng.normal(0, 10, (rows, joints))),
        direction=maybe(rng.integers(-1, 2, (rows, joints)).astype(float)),
        sigma=maybe(rng.random((rows, 6)) + 1e-9),
        tilt=maybe({2: rng.normal(0, 1, (rows, 2))}),
        wrench=maybe(rng.normal(0, 10, (rows, 6))),
        exclude=maybe(exclude),
    )


@quick
@given(given=columns())
def test_there_and_back(tmp_path, given):
    dataset = Dataset(**given)
    path = write_measurements(dataset, tmp_path / "rows.csv")
    again = read_measurements(path, joints=dataset.joints)
    assert_same(dataset, again, rotation=2e-14)


def test_the_header_is_that_of_the_formats(tmp_path):
    small = Dataset(q=[[0.1, 0.2]], position=[[1.0, 2.0, 3.0]], rotation=np.eye(3)[None])
    path = write_measurements(small, tmp_path / "rows.csv")
    assert path.read_text().splitlines()[0] == "q1[rad],q2[rad],x[m],y[m],z[m],qw,qx,qy,qz"


def test_rows_that_are_kept_out_come_back(tmp_path):
    rotation = np.stack([np.full((3, 3), np.nan), np.eye(3)])
    seen = Dataset(q=np.zeros((2, 1)), position=[[1.0, 2.0, np.nan], [1.0, 2.0, 3.0]], rotation=rotation)
    data = seen.kept_out({0: 'lost, "sight"'})
    assert_same(data, read_measurements(write_measurements(data, tmp_path / "rows.csv")))
