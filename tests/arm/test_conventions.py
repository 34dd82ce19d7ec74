"""Every convention against 4×4 matrices typed from the printed equations, entry by entry."""

import numpy as np
import pytest
from generator import move, turn

import workbench as wb
from workbench import Motion, identification_jacobian, link_frames, load_robot
from workbench.arm.conventions import JointEntry, default_free
from workbench.arm.joint import JointKind


def hayati(theta, d, a, alpha, beta):
    """ARIA eq. (8), multiplied out by hand: Rot(z,θ) Trans(z,d) Trans(x,a) Rot(x,α) Rot(y,β)."""
    ct, st, ca, sa, cb, sb = (f(v) for v in (theta, alpha, beta) for f in (np.cos, np.sin))
    return np.array(
        [
            [ct * cb - st * sa * sb, -st * ca, ct * sb + st * sa * cb, a * ct],
            [st * cb + ct * sa * sb, ct * ca, st * sb - ct * sa * cb, a * st],
            [-ca * sb, sa, ca * cb, d],
            [0, 0, 0, 1],
        ]
    )


def standard(theta, d, a, alpha, beta):
    """The textbook matrix of standard DH; β has no place in it."""
    ct, st, ca, sa = (f(v) for v in (theta, alpha) for f in (np.cos, np.sin))
    matrix = [[ct, -st * ca, st * sa, a * ct], [st, ct * ca, -ct * sa, a * st], [0, sa, ca, d], [0, 0, 0, 1]]
    return np.array(matrix)


def craig(theta, d, a, alpha, beta):
    """The matrix printed below Katana eq. (3.1)."""
    ct, st, ca, sa = (f(v) for v in (theta, alpha) for f in (np.cos, np.sin))
    return np.array(
        [[ct, -st, 0, a], [ca * st, ca * ct, -sa, -d * sa], [sa * st, sa * ct, ca, d * ca], [0, 0, 0, 1]]
    )


def craig_hayati(theta, d, a, alpha, beta):
    """Katana eq. (3.2), with the Trans(Z, d) of (3.1) at its end."""
    return turn("x", alpha) @ turn("y", beta) @ move("x", a) @ turn("z", theta) @ move("z", d)


def xyz(theta, d, a, alpha, beta):
    """Katana eq. (4.3), and the Trans(Z, d) of the others."""
    return turn("x", alpha) @ turn("y", beta) @ turn("z", theta) @ move("x", a) @ move("z", d)


def zyx(theta, d, a, alpha, beta):
    """Katana eqs. (4.4) and (4.5), and the Trans(X, a) of (4.3)."""
    return turn("z", theta) @ turn("y", beta) @ turn("x", alpha) @ move("x", a) @ move("z", d)


LINKS = {
    "hayati": (hayati, True, ""),
    "dh": (standard, False, ""),
    "craig": (craig, False, ""),
    "craig-hayati": (craig_hayati, True, ""),
    "three-rotation": (xyz, True, ""),
    "three-rotation zyx": (zyx, True, 'order = "zyx"'),
}


def write(folder, name, tables, kinds):
    convention = name.split()[0]
    lines = [f'convention = "{convention}"']
    for row, kind in zip(tables, kinds, strict=True):
        lines += ["[[joint]]", f'type = "{kind}"', LINKS[name][2]]
        keys = ("theta", "d", "a", "alpha", "beta")
        lines += [f"{k} = {float(v)!r}" for k, v in zip(keys, row, strict=True)]
    path = folder / "arm.toml"
    path.write_text("\n".join(lines))
    return load_robot(path)


def tables(name, number, seed=0):
    table = np.random.default_rng(seed).uniform(-2, 2, (number, 5))
    if not LINKS[name][1]:
        table[:, 4] = 0.0
    return table


@pytest.mark.parametrize("name", LINKS)
def test_links_multiply_with_every_kind_of_joint(name, tmp_path):
    kinds = ["revolute", "fixed", "prismatic", "revolute", "fixed", "prismatic"]
    rows = tables(name, len(kinds))
    robot = write(tmp_path, name, rows, kinds)
    assert [j.name for j in robot.joints] == ["joint1", "fixed1", "joint2", "joint3", "fixed2", "joint4"]
    assert robot.dof == 4
    q = np.random.default_rng(1).uniform(-2, 2, (5, 4))
    found = link_frames(robot, Motion(q))
    for row, frames in zip(q, found, strict=True):
        t, left = np.eye(4), list(row)
        np.testing.assert_allclose(frames[0], t)
        for k, (kind, constants) in enumerate(zip(kinds, rows.copy(), strict=True)):
            if kind != "fixed":
                constants[0 if kind == "revolute" else 1] += left.pop(0)
            t = t @ LINKS[name][0](*constants)
            np.testing.assert_allclose(frames[k + 1], t, atol=1e-13)
        np.testing.assert_allclose(frames[-1], t, atol=1e-13)


def entry(alpha=0.0, kind=JointKind.REVOLUTE, free=None):
    return JointEntry(kind, alpha=alpha, free=free)


def test_four_constants_of_each_joint_are_free_and_beta_replaces_d_between_parallel_axes():
    quarter = np.pi / 2
    perpendicular, parallel = ("theta", "d", "a", "alpha"), ("theta", "beta", "a", "alpha")
    # a Hayati joint's α leads to the next axis; a Craig joint's comes from the one before
    entries = [entry(0.0), entry(quarter), entry(np.pi), entry(0.0)]
    assert default_free("hayati", entries) == [parallel, perpendicular, parallel, perpendicular]
    assert default_free("craig", entries) == [perpendicular, perpendicular, parallel, parallel]


SLIDE, TURNED = {"type": "prismatic"}, {"alpha": np.pi}
SCARA = [{"d": 0.4, "a": 0.3}, {"a": 0.25, **TURNED}, SLIDE, {"d": 0.1}]
COLUMN = [{"a": 0.1, **SLIDE}, {"a": 0.3}, {"a": 0.2, "alpha": 1.2}, {"d": 0.1}]


@pytest.mark.parametrize("convention", ["dh", "craig"])
@pytest.mark.parametrize("table", [SCARA, COLUMN], ids=["scara", "column"])
def test_free_constants_show_all_that_small_errors_of_any_link_do(table, convention):
    robot = wb.Robot.from_dh(table, convention)
    q = np.random.default_rng(0).uniform(0.1, 1.0, (40, 4))
    frames = [f"{f}.{p}" for f in ("base", "tool") for p in ("x", "y", "z", "roll", "pitch", "yaw")]
    every = [f"joint{k}.{name}" for k in range(1, 5) for name in ("theta", "d", "a", "alpha", "beta")]
    ranks = [
        np.linalg.matrix_rank(np.concatenate(identification_jacobian(robot, q, (*names, *frames))[1]), 1e-9)
        for names in (robot.default_free, every)
    ]
    assert ranks[0] == ranks[1]
