"""Corrected joint positions of a calibrated arm, with all its effects, in one file that needs only numpy.

    q, left = correct(wanted)                    joints of the nominal arm → joints of this arm [rad or m]
    q, left = correct_poses(poses, near)         poses of the tool in the robot's base → joints near `near`
    poses = forward(q)                           poses of this arm's tool, with its deflections
    ARM["base"]                                  pose of the robot's base in the measuring frame

Rows in, rows out. `left` is the remaining error per row [m, rad]; a row that a correction would make worse
keeps its joints. Loads are those of the arm at rest; payload [kg], temperature [degC] and direction (sign of
each joint's last motion) are numbers, or arrays with a row for each.
"""

import numpy as np

ARM: dict = {}  # arm
ROUNDS, DONE = 40, 1e-12


def correct(wanted, **state):
    """Joint positions (rows, n) that bring this arm to the nominal arm's poses, and the remaining errors."""
    q = np.atleast_2d(np.asarray(wanted, float))
    return correct_poses(_frames(ARM["nominal"], q, np.zeros((len(q), len(ARM["nominal"]))))[-1], q, **state)


def forward(q, **state):
    """Poses (rows, 4, 4) of the tool of the deflected arm in the robot's base."""
    q = np.atleast_2d(np.asarray(q, float))
    return _deflected(q, *_state(q, **state))[-1]


def correct_poses(poses, near, **state):
    """Joint positions (rows, n) that bring this arm to poses (rows, 4, 4), and the remaining errors.

    Newton's method within the joint limits, damped as far as something is missing; the best step counts.
    """
    near = np.atleast_2d(np.asarray(near, float))
    poses, given = np.reshape(np.asarray(poses, float), (-1, 4, 4)), _state(near, **state)
    limits = np.array(ARM["limits"]).T
    r, _, left = _missing(poses, near, given)
    q, x, cost = near.copy(), np.clip(near, *limits), (r**2).sum(1)
    worst = np.maximum(left[:, 0], 1e-9)
    for _ in range(ROUNDS):
        r, jacobian, miss = _missing(poses, x, given)
        now = (r**2).sum(1)
        better = (now < cost) & (miss[:, 0] <= worst)
        q[better], left[better], cost[better] = x[better], miss[better], now[better]
        if cost.max() < DONE**2:
            break
        h, g = jacobian.transpose(0, 2, 1) @ jacobian, (r[:, None] @ jacobian)[:, 0]
        damping = np.clip(now, *(np.outer([1e-11, 1e-3], np.trace(h, axis1=1, axis2=2)) / h.shape[1]))
        held = ((x <= limits[0]) & (g < 0.0)) | ((x >= limits[1]) & (g > 0.0))
        h = np.where(held[:, :, None] | held[:, None], 0.0, h) + damping[:, None, None] * np.eye(h.shape[1])
        x = np.clip(x + np.linalg.solve(h, np.where(held, 0.0, g)[..., None])[..., 0], *limits)
    return q, left


def _state(q, payload=0.0, temperature=None, direction=None):
    """What drives effects beside the joints, for each row."""
    given = {"temperature": temperature, "direction": direction}
    if missing := [name for name in ARM["needs"] if given[name] is None]:
        raise ValueError(f"effects of this arm depend on the {missing[0]}; give {missing[0]}=…")
    parts = ((payload, len(q)), (temperature, len(q)), (direction, q.shape))
    return [np.broadcast_to(np.asarray(0.0 if v is None else v, float), shape) for v, shape in parts]


def _missing(poses, q, state):
    """What is missing at q as a vector (rows, 6), its Jacobian (rows, 6, n), and as length and angle.

    Angles count by the arm's weight, and as far as its joints can meet them.
    """
    frames = _deflected(q, *state)
    tool = frames[-1]
    slides = np.array([ARM["chain"][k][0] >= 3 for k in ARM["driven"]])
    axes = np.stack([frames[k][:, :3, ARM["chain"][k][0] % 3] for k in ARM["driven"]], 2)
    points = np.stack([frames[k][:, :3, 3] for k in ARM["driven"]], 2)
    moves = np.where(slides, axes, np.cross(axes, tool[:, :3, 3:] - points, axis=1))
    turns, turn, cosine = np.where(slides, 0.0, axes), np.zeros((len(q), 3)), np.ones(len(q))
    moves, turns = moves @ np.array(ARM["columns"]), turns @ np.array(ARM["columns"])
    if ARM["task"] == 3:  # position
        turns = 0.0 * turns
    elif ARM["task"] == 5:  # position and direction of the tool's z
        z, wanted = tool[:, :3, 2], poses[:, :3, 2]
        turn, cosine = np.cross(z, wanted), (z * wanted).sum(1)
        turns = turns - z[:, :, None] * (z[:, None] @ turns)
    else:
        m = poses[:, :3, :3] @ tool[:, :3, :3].transpose(0, 2, 1)
        turn = 0.5 * (m - m.transpose(0, 2, 1))[:, [2, 0, 1], [1, 2, 0]]
        cosine = 0.5 * (np.trace(m, axis1=1, axis2=2) - 1.0)
    sine, move = np.linalg.norm(turn, axis=1), poses[:, :3, 3] - tool[:, :3, 3]
    angle = np.arctan2(sine, cosine)
    turn = turn * np.where(sine > 0.0, angle / np.where(sine > 0.0, sine, 1.0), 1.0)[:, None]
    r = np.concatenate([move, ARM["weight"] * turn], 1)
    jacobian = np.concatenate([moves, ARM["weight"] * turns], 1)
    return r, jacobian, np.stack([np.linalg.norm(move, axis=1), angle], 1)


def _frames(chain, q, shift):
    """Frame right before every element of a chain, and behind the last one."""
    t, out = np.broadcast_to(np.eye(4), (len(q), 4, 4)), []
    for k, (axis, driver, ratio, value, constant) in enumerate(chain):
        out.append(t)
        if constant is not None:
            t = t @ np.asarray(constant)
            continue
        t, by = t.copy(), (value + shift[:, k] + (ratio * q[:, driver] if driver >= 0 else 0.0))[:, None]
        if axis >= 3:
            t[:, :3, 3] += t[:, :3, axis - 3] * by
        else:
            i, j, c, s = (axis + 1) % 3, (axis + 2) % 3, np.cos(by), np.sin(by)
            a, b = out[-1][:, :3, i], out[-1][:, :3, j]
            t[:, :3, i], t[:, :3, j] = a * c + b * s, b * c - a * s
    return [*out, t]


def _deflected(q, payload, temperature, direction):
    """Frames of the arm at the fixed point of loads and deflections."""
    start = np.zeros((len(q), len(ARM["chain"])))
    for element, change in _at_rest(q, _frames(ARM["chain"], q, start), payload, temperature, direction):
        start[:, element] += change
    shift = start
    for _ in range(20 if ARM["masses"] else 0):
        before, shift = shift, start.copy()
        for element, change in _under_load(q, _wrenches(_frames(ARM["chain"], q, before), payload)):
            shift[:, element] += change
        if np.abs(shift - before).max() < 1e-13:
            break
    return _frames(ARM["chain"], q, shift)


def _at_rest(q, frames, payload, temperature, direction):
    """What joints, temperature and motion add to elements."""
    return []  # rest


def _under_load(q, w):
    """What the wrenches through the joints add to elements."""
    return []  # load


def _wrenches(frames, payload):
    """What each link exerts on the next at their joint, at rest, in the axes of the joint's mount."""
    gravity, out = np.array(ARM["gravity"]), np.empty((len(payload), len(ARM["mounts"]), 6))
    loads = [(len(frames), frames[-1][:, :3, 3], payload[:, None] * -gravity)]
    for after, mass, com in ARM["masses"]:
        at = after + 1 if after >= 0 else len(frames) - 1
        loads.append((at, frames[at][:, :3, :3] @ com + frames[at][:, :3, 3], -mass * gravity[None]))
    for joint, mount in enumerate(ARM["mounts"]):
        t = frames[mount]
        behind = [(point - t[:, :3, 3], force) for at, point, force in loads if at > mount]
        moments, still = (np.cross(arm, force) for arm, force in behind), np.zeros(3)
        both = sum((force for _, force in behind), still), sum(moments, still)
        out[:, joint] = np.concatenate([part[:, None] @ t[:, :3, :3] for part in both], 2)[:, 0]
    return out


def _share(load, other):
    size = np.hypot(load, other)
    return load / np.where(size > 0.0, size, np.inf)


def _fading(q, low, high, span):
    beyond = np.maximum(np.maximum(low - q, q - high), 0.0)
    return 0.5 * (1.0 + np.cos(np.pi * np.minimum(beyond / span, 1.0)))


def _spline(q, knots, cubics, periodic):
    """Piecewise cubic, the highest power first; repeated every turn, or constant beyond."""
    x = np.array(knots)
    at = x[0] + (q - x[0]) % (2.0 * np.pi) if periodic else np.clip(q, x[0], x[-1])
    piece = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(x) - 2)
    d, (a, b, c, e) = at - x[piece], np.array(cubics)[:, piece]
    return ((a * d + b) * d + c) * d + e
