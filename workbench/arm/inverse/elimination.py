"""Starts for every solution of six revolute joints at once, by algebraic elimination.

With joints 1, 2 on the right, 3, 4, 5 on the left, and joint 6 gone because it moves neither its own axis l
nor the point p on it, the closure C₁Z₂C₂Z₃C₃Z₄C₄Z₅C₅ = Z₁⁻¹HZ₆⁻¹ gives six equations in p and l. With p·p,
p·l, p × l and (p·p) l − 2 (p·l) p there are fourteen, and each side is linear in the products of 1, cos q_i,
sin q_i of its joints. Eliminating the eight products of q₁ and q₂ leaves six equations

    M(q₃) (1, cos q₄, sin q₄) ⊗ (1, cos q₅, sin q₅) = 0,       M linear in 1, cos q₃, sin q₃;

times cos(q₄/2) and sin(q₄/2) they are twelve in as many products, so that q₃ is an eigenvalue of a
matrix polynomial of degree two in tan(q₃/2), and its eigenvector carries q₄ and q₅.

The coefficients are found by sampling each angle three times, so that no convention enters. The constants
are first shifted by `RANDOM_SHIFT`: arms of special structure (parallel or intersecting axes) have a singular
pencil, or several solutions with one q₃, and a slight random change separates them (Hochstenbach, Mehl,
Plestenjak, SIAM J. Matrix Anal. 40(3), 2019). So the results are starts for `damped_newton.refine`, not
solutions; the real parts of complex roots are among them, because a root may become complex by the shift.

Sources: Raghavan and Roth, J. Mech. Design 115(3), 1993; Manocha and Canny, IEEE Trans. Robotics and
Automation 10(5), 1994, with half angles in place of their tan(q₄/2), tan(q₅/2).
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from workbench.base import se3

RANDOM_SHIFT = 1e-4
"""Random change of the constants before elimination [rad, and share of the arm's length]."""
SHIFT_SEED = 5
"""Seed of that change, so that the same target always gives the same starts."""
HALF_ANGLE_ORIGIN = 0.3
"""Origin of tan((q₃ − origin)/2) [rad]: away from the right angles of usual arms."""
ANGLES = np.arange(3) * (2.0 * np.pi / 3.0)
TO_HARMONICS = np.linalg.inv(np.stack([np.ones(3), np.cos(ANGLES), np.sin(ANGLES)], 1))
PATH = ["einsum_path", (2, 3), (1, 2), (0, 1)]
HALF_ANGLES = np.zeros((2, 3, 4))
"""(cos, sin)(q/2) · (1, cos q, sin q) in terms of (cos q/2, sin q/2, cos 3q/2, sin 3q/2)."""
HALF_ANGLES[0, 0, 0] = HALF_ANGLES[1, 0, 1] = 1.0
HALF_ANGLES[0, 1, [0, 2]] = HALF_ANGLES[0, 2, [1, 3]] = 0.5
HALF_ANGLES[1, 1, [3, 1]] = HALF_ANGLES[1, 2, [0, 2]] = 0.5, -0.5


def closure_starts(
    constants: Float[np.ndarray, "7 4 4"],
    targets: Float[np.ndarray, "rows 4 4"],
    *,
    length: float,
    entries: Sequence[int] = (0,),
) -> Float[np.ndarray, "rows starts 6"]:
    """Joint angles near every solution, with spurious ones among them.

    Args:
        constants: C₀ … C₆ of `reduced_arm.Arm`, six revolute joints.
        targets: Poses of the tool.
        length: Unit of length that brings positions near 1 [m].
        entries: Joints that take the role of joint 1 (from 0) in turn: the closed loop may be entered
            anywhere, and a target that is degenerate for one entry is not for another. 16 starts each.
    """
    fixed, h = constants.copy(), targets.copy()
    fixed[:, :3, 3] /= length
    h[:, :3, 3] /= length
    loop = np.empty((len(h), 6, 4, 4))
    loop[:, :5] = fixed[1:6]
    loop[:, 5] = fixed[6] @ se3.inverse(h) @ fixed[0]
    loops = []
    for first in entries:
        noise = np.random.default_rng(SHIFT_SEED + first).standard_normal((6, 6)) * RANDOM_SHIFT
        noise = se3.pose(se3.rotvec_to_matrix(noise[:, :3]), noise[:, 3:])
        loops.append(np.roll(loop @ noise, -first, axis=1))
    entered = np.concatenate(loops)
    q = _eliminate(entered[:, :5], se3.inverse(entered[:, 5])).reshape(len(entries), len(h), 16, 6)
    return np.concatenate([np.roll(part, first, axis=2) for first, part in zip(entries, q, strict=True)], 1)


def _eliminate(links: Float[np.ndarray, "rows 5 4 4"], h: Float[np.ndarray, "rows 4 4"]) -> np.ndarray:
    """Roots (rows, 16, 6) of Z₁L₁Z₂L₂Z₃L₃Z₄L₄Z₅L₅Z₆ = H."""
    left, right = _left(links), _right(links[:, 0], h)
    u, s, vt = np.linalg.svd(right[:, :, 1:])
    remaining = np.einsum("rje,rjxyz->rexyz", u[:, :, 8:], left)
    remaining[:, :, 0, 0, 0] -= np.einsum("rje,rj->re", u[:, :, 8:], right[:, :, 0])
    q3, q4, q5 = _roots(remaining)
    x, y, z = (np.stack([np.ones_like(q), np.cos(q), np.sin(q)], -1) for q in (q3, q4, q5))
    monomials = (x[..., :, None, None] * y[..., None, :, None] * z[..., None, None, :]).reshape(
        len(h), 16, 27
    )
    known = monomials @ np.swapaxes(left.reshape(len(h), 14, 27), 1, 2) - right[:, None, :, 0]
    products = (known @ u[:, :, :8]) / np.maximum(s, 1e-12)[:, None] @ vt
    q2 = np.arctan2(products[..., 1], products[..., 0])
    q1 = np.arctan2(products[..., 5], products[..., 2])
    q = np.stack([q1, q2, q3, q4, q5], -1)
    return np.concatenate([q, _last(links, q, h)[..., None]], -1)


def _turn(angle: Float[np.ndarray, "*lead"]) -> Float[np.ndarray, "*lead 4 4"]:
    """Rotations about z."""
    result = np.zeros((*np.shape(angle), 4, 4))
    result[..., 0, 0] = result[..., 1, 1] = np.cos(angle)
    result[..., 1, 0] = np.sin(angle)
    result[..., 0, 1] = -result[..., 1, 0]
    result[..., 2, 2] = result[..., 3, 3] = 1.0
    return result


def _fourteen(frame: Float[np.ndarray, "*lead 4 4"]) -> Float[np.ndarray, "*lead 14"]:
    """p, l, p·p, p·l, p × l, (p·p) l − 2 (p·l) p of the frame's origin p and z axis l."""
    p, axis = frame[..., :3, 3], frame[..., :3, 2]
    pp, pl = (p * p).sum(-1, keepdims=True), (p * axis).sum(-1, keepdims=True)
    return np.concatenate([p, axis, pp, pl, se3.cross(p, axis), pp * axis - 2.0 * pl * p], -1)


def _left(links: Float[np.ndarray, "rows 5 4 4"]) -> Float[np.ndarray, "rows 14 3 3 3"]:
    """Coefficients of the left side in the harmonics of q₃, q₄, q₅."""
    turns = _turn(ANGLES)
    steps = [links[:, i, None] @ turns for i in (1, 2, 3)]
    frames = (steps[0][:, :, None] @ steps[1][:, None])[:, :, :, None] @ (steps[2] @ links[:, 4, None])[
        :, None, None
    ]
    return np.einsum("xa,yb,zc,rabcj->rjxyz", *[TO_HARMONICS] * 3, _fourteen(frames), optimize=PATH)


def _right(
    link: Float[np.ndarray, "rows 4 4"], h: Float[np.ndarray, "rows 4 4"]
) -> Float[np.ndarray, "rows 14 9"]:
    """Coefficients of the right side in the harmonics of q₁ and q₂, one row of nine per equation."""
    back = _turn(-ANGLES)
    after = se3.inverse(link)[:, None] @ (back @ h[:, None])
    values = _fourteen(back @ after[:, :, None])  # rows, q₁, q₂
    harmonics = np.einsum("xa,yb,rabj->rjxy", TO_HARMONICS, TO_HARMONICS, values, optimize=True)
    return harmonics.reshape(len(h), 14, 9)


def _roots(m: Float[np.ndarray, "rows 6 3 3 3"]) -> tuple[Float[np.ndarray, "rows 16"], ...]:
    """Real parts of q₃, q₄, q₅ at the 16 roots of M(q₃) y ⊗ z = 0, y = (1, cos q₄, sin q₄), z likewise of q₅.

    Six equations can't be solved for the nine products in y ⊗ z. Each is therefore taken twice, times
    cos(q₄/2) and times sin(q₄/2). That turns y into w = (cos q₄/2, sin q₄/2, cos 3q₄/2, sin 3q₄/2), and gives
    twelve equations in the twelve products v = w ⊗ z:

        (A + B cos α + C sin α) v = 0,      α = q₃ − origin,      A, B, C 12 × 12

    With t = tan(α/2), cos α = (1 − t²)/(1 + t²) and sin α = 2t/(1 + t²), times 1 + t², this is the quadratic
    eigenvalue problem [(A + B) + 2C t + (A − B) t²] v = 0, whose first companion form is linear in [v; tv]:

        [       0               I        ] [ v  ]       [ v  ]
        [ −(A − B)⁻¹(A + B)  −(A − B)⁻¹2C ] [ tv ]  =  t [ tv ]

    Of its 24 eigenvalues t eight are spurious, t = ±i, where 1 + t² = 0; the other sixteen are the arm's
    solutions, complex ones among them. The eigenvector has v in its upper half and t v in its lower one: the
    larger is read. As v = w ⊗ z, a row of it as a 4 × 3 matrix gives z, hence q₅, and a column w, hence q₄.

    Sources: Manocha and Canny (see above); for the companion form Tisseur and Meerbergen, SIAM Review 43(2),
    2001.
    """
    rows = len(m)
    square = np.einsum("rexyz,mya->rmexaz", m, HALF_ANGLES).reshape(rows, 12, 3, 12)
    c, s = np.cos(HALF_ANGLE_ORIGIN), np.sin(HALF_ANGLE_ORIGIN)
    # from here on about the origin: A, B and C of the docstring
    constant, cosine, sine = square[:, :, 0], square[:, :, 1], square[:, :, 2]
    cosine, sine = c * cosine + s * sine, c * sine - s * cosine
    # (A − B) is the coefficient of t²; the pencil is regular where no solution has α = π
    companion = np.zeros((rows, 24, 24))
    companion[:, :12, 12:] = np.eye(12)
    others = np.concatenate([constant + cosine, 2.0 * sine], -1)
    companion[:, 12:] = -np.linalg.solve(constant - cosine, others)
    tangents, vectors = np.linalg.eig(companion)
    genuine = np.sort(np.abs(tangents**2 + 1.0).argsort(-1)[:, 8:])  # at least 1 for a real angle
    tangents = np.take_along_axis(tangents, genuine, -1)
    vectors = np.take_along_axis(vectors, genuine[:, None], -1)
    upper, lower = np.swapaxes(vectors[:, :12], 1, 2), np.swapaxes(vectors[:, 12:], 1, 2)
    products = np.where((np.abs(tangents) > 1.0)[..., None], lower, upper).reshape(rows, 16, 4, 3)
    power = np.abs(products) ** 2
    of_q5 = np.take_along_axis(products, power.sum(-1).argmax(-1)[..., None, None], 2)[..., 0, :]
    of_q4 = np.take_along_axis(products, power.sum(-2).argmax(-1)[..., None, None], 3)[..., 0]
    main = np.take_along_axis(of_q4, np.abs(of_q4[..., :2]).argmax(-1)[..., None], -1)
    q5 = np.arctan2(*(np.real(of_q5[..., [2, 1]] / of_q5[..., :1]).transpose(2, 0, 1)))
    q4 = 2.0 * np.arctan2(*(np.real(of_q4[..., [1, 0]] / main).transpose(2, 0, 1)))
    with np.errstate(divide="ignore", invalid="ignore"):  # arctan(±i) of the spurious roots
        q3 = np.nan_to_num(np.real(HALF_ANGLE_ORIGIN + 2.0 * np.arctan(tangents)))
    return q3, q4, q5


def _last(
    links: Float[np.ndarray, "rows 5 4 4"], q: Float[np.ndarray, "rows k 5"], h: Float[np.ndarray, "rows 4 4"]
) -> Float[np.ndarray, "rows k"]:
    """q₆ that best rotates the arm's x and y axes onto the target's."""
    arm = np.eye(4)
    for i in range(5):
        arm = arm @ _turn(q[..., i]) @ links[:, i, None]
    rest = np.swapaxes(arm[..., :3, :2], -1, -2) @ h[:, None, :3, :2]
    return np.arctan2(rest[..., 1, 0] - rest[..., 0, 1], rest[..., 0, 0] + rest[..., 1, 1])
