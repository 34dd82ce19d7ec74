"""Corrected joint positions of a calibrated arm, with all its effects, in one file that needs only numpy.

    q, left = correct(wanted)                    joints of the nominal arm → joints of this arm [rad or m]
    q, left = correct_poses(poses, near)         poses of the tool in the robot's base → joints near `near`
    poses = forward(q)                           poses of this arm's tool, with its deflections

Rows in, rows out. `left` is the remaining error per row [m, rad]; a row that a correction would make worse
keeps its joints. Loads are those of the arm at rest; payload [kg], temperature [degC] and direction (sign of
each joint's last motion) are numbers, or arrays with a row for each.
"""

import numpy as np

ARM: dict = {}  # filled in by the export

ROUNDS, SHORTEST, DONE = 40, 2.0**-8, 1e-12


class State:
    """What drives effects beside the joints, for some rows."""

    def __init__(self, rows, payload=0.0, temperature=None, direction=None):
        if ARM["warm"] and temperature is None:
            raise ValueError("this arm expands with temperature; give temperature [degC]")
        if ARM["directed"] and direction is None:
            raise ValueError("this arm has play; give direction, the sign of each joint's last motion")
        fill = (payload, 0.0 if temperature is None else temperature)
        self.payload, self.temperature = (np.broadcast_to(np.asarray(v, float), rows).copy() for v in fill)
        given = 0.0 if direction is None else np.asarray(direction, float)
        self.direction = np.broadcast_to(given, (rows, ARM["dof"])).copy()

    def take(self, rows):
        return State(len(rows), self.payload[rows], self.temperature[rows], self.direction[rows])


def correct(wanted, *, payload=0.0, temperature=None, direction=None):
    """Joint positions (rows, n) that bring this arm to the nominal arm's poses, and the remaining errors."""
    q = np.atleast_2d(np.asarray(wanted, float))
    poses = _geometry(ARM["nominal"], q)[0]
    return correct_poses(poses, q, payload=payload, temperature=temperature, direction=direction)


def correct_poses(poses, near, *, payload=0.0, temperature=None, direction=None):
    """Joint positions (rows, n) that bring this arm to poses (rows, 4, 4), and the remaining errors."""
    q = np.atleast_2d(np.asarray(near, float))
    poses = np.reshape(np.asarray(poses, float), (-1, 4, 4))
    state = State(len(q), payload, temperature, direction)
    before, first = _missed(poses, q, state)
    x, cost, left = _iterate(poses, q, state)
    worse = (cost > first) | (left[:, 0] > np.maximum(before[:, 0], 1e-9))
    return np.where(worse[:, None], q, x), np.where(worse[:, None], before, left)


def forward(q, *, payload=0.0, temperature=None, direction=None):
    """Poses (rows, 4, 4) of the tool of the deflected arm in the robot's base."""
    q = np.atleast_2d(np.asarray(q, float))
    return _deflected(q, State(len(q), payload, temperature, direction))


def _missed(poses, q, state):
    """Distance and angle that are missing at q, and their cost."""
    tool = _geometry(ARM["rigid"], q)[0]
    left = _missing(tool, tool @ np.linalg.inv(_deflected(q, state)) @ poses)[1]
    return left, left[:, 0] ** 2 + (ARM["weight"] * left[:, 1]) ** 2


def _iterate(poses, q, state):
    """Move the rigid arm's target until the deflected arm meets the intended one."""
    limits = np.array(ARM["limits"]).T
    x = np.clip(q, *limits)
    best, step, left = x.copy(), np.zeros_like(x), np.full((len(x), 2), np.inf)
    cost, share, going = np.full(len(x), np.inf), np.ones(len(x)), np.arange(len(x))
    for _ in range(ROUNDS):
        if not len(going):
            break
        now = x[going]
        tool = _geometry(ARM["rigid"], now)[0]
        wanted = tool @ np.linalg.inv(_deflected(now, state.take(going))) @ poses[going]
        miss = _missing(tool, wanted)[1]
        here = miss[:, 0] ** 2 + (ARM["weight"] * miss[:, 1]) ** 2
        fell = here < cost[going]
        lower = going[fell]
        best[lower], cost[lower], left[lower] = x[lower], here[fell], miss[fell]
        step[lower] = _refine(wanted[fell], x[lower], limits) - x[lower]
        share[going] = np.where(fell, 1.0, 0.5 * share[going])
        x[going] = best[going] + share[going][:, None] * step[going]
        going = going[(cost[going] > DONE**2) & (share[going] > SHORTEST)]
    return best, cost, left


def _refine(targets, start, limits):
    """Damped Newton of the rigid arm, each row until it is there or no step helps."""
    x, weight2 = np.clip(start, *limits), ARM["weight"] ** 2
    tool, axes, points = _geometry(ARM["rigid"], x)
    r, miss = _missing(tool, targets)
    cost = miss[:, 0] ** 2 + weight2 * miss[:, 1] ** 2
    damping, idle = np.full(len(x), 1e-3), np.zeros(len(x), int)
    going = np.flatnonzero((miss > 1e-13).any(1))
    for _ in range(60):
        if not len(going):
            break
        h, g = _normal(tool[going], axes[going], points[going], r[going], weight2)
        size = np.trace(h, axis1=1, axis2=2) / h.shape[1]
        held = ((x[going] <= limits[0]) & (g < 0.0)) | ((x[going] >= limits[1]) & (g > 0.0))
        h[np.broadcast_to(held[:, :, None] | held[:, None, :], h.shape)] = 0.0
        g[held] = 0.0
        damping[going] = np.maximum(np.minimum(damping[going], cost[going] / size), 1e-11)
        open_rows = np.arange(len(going))
        for _ in range(14):
            rows = going[open_rows]
            extra = np.where(held[open_rows], 1.0, (damping[rows] * size[open_rows])[:, None])
            matrix = h[open_rows] + extra[:, :, None] * np.eye(h.shape[1])
            step = np.linalg.solve(matrix, g[open_rows][..., None])[..., 0]
            scale = np.minimum(1.0, 0.7 / np.maximum(np.abs(step).max(1), 1e-300))
            new = np.clip(x[rows] + scale[:, None] * step, *limits)
            now = _geometry(ARM["rigid"], new)
            found, there = _missing(now[0], targets[rows])
            trial = there[:, 0] ** 2 + weight2 * there[:, 1] ** 2
            good = trial < cost[rows]
            taken = rows[good]
            idle[taken] = np.where(trial[good] > 0.9999 * cost[taken], idle[taken] + 1, 0)
            x[taken], cost[taken], r[taken], miss[taken] = new[good], trial[good], found[good], there[good]
            tool[taken], axes[taken], points[taken] = (part[good] for part in now)
            damping[taken] *= 0.1
            damping[rows[~good]] *= 10.0
            open_rows = open_rows[~good]
            if not len(open_rows):
                break
        stuck = np.isin(going, going[open_rows])
        going = going[~stuck & (idle[going] < 4) & (miss[going] > 1e-13).any(1)]
    return x


def _normal(tool, axes, points, r, weight2):
    """JᵀJ and Jᵀr, with the weighted rotations that the task constrains."""
    slides = np.array(ARM["slides"], bool)[None, :, None]
    linear = np.where(slides, axes, np.cross(axes, tool[:, None, :3, 3] - points))
    turn = np.where(slides, 0.0, axes)
    if ARM["task"] == 5:
        z = tool[:, None, :3, 2]
        turn = turn - (turn * z).sum(2, keepdims=True) * z
    if ARM["task"] == 3:
        turn = np.zeros_like(turn)
    h = linear @ linear.transpose(0, 2, 1) + weight2 * turn @ turn.transpose(0, 2, 1)
    return h, (linear @ r[:, :3, None] + weight2 * turn @ r[:, 3:, None])[..., 0]


def _missing(tool, target):
    """Position and rotation that are missing (rows, 6), and their lengths (rows, 2)."""
    r = np.zeros((len(tool), 6))
    r[:, :3] = target[:, :3, 3] - tool[:, :3, 3]
    angle = np.zeros(len(tool))
    if ARM["task"] != 3:
        if ARM["task"] == 5:
            turn = np.cross(tool[:, :3, 2], target[:, :3, 2])
            sine, cosine = np.linalg.norm(turn, axis=1), (tool[:, :3, 2] * target[:, :3, 2]).sum(1)
        else:
            m = target[:, :3, :3] @ tool[:, :3, :3].transpose(0, 2, 1)
            turn = 0.5 * np.stack(
                [m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]], 1
            )
            sine, cosine = np.linalg.norm(turn, axis=1), 0.5 * (np.trace(m, axis1=1, axis2=2) - 1.0)
        angle = np.arctan2(sine, cosine)
        r[:, 3:] = turn * np.where(sine < 1e-300, 1.0, angle / np.maximum(sine, 1e-300))[:, None]
    return r, np.stack([np.linalg.norm(r[:, :3], axis=1), angle], 1)


def _geometry(constants, x):
    """Tool, and direction and point of every joint, of an arm of constants between joints about (along) z."""
    axes, points = np.empty((*x.shape, 3)), np.empty((*x.shape, 3))
    t = np.broadcast_to(np.asarray(constants[0]), (len(x), 4, 4)).copy()
    for k, constant in enumerate(constants[1:]):
        axes[:, k], points[:, k] = t[:, :3, 2], t[:, :3, 3]
        t = _step(t, 5 if ARM["slides"][k] else 2, x[:, k]) @ np.asarray(constant)
    return t, axes, points


def _step(t, axis, value):
    """t times a rotation about (axis 0–2), or a translation along (3–5), an axis of its own."""
    t = t.copy()
    if axis >= 3:
        t[:, :3, 3] += t[:, :3, axis - 3] * value[:, None]
        return t
    i, j = (axis + 1) % 3, (axis + 2) % 3
    c, s = np.cos(value)[:, None], np.sin(value)[:, None]
    a, b = t[:, :3, i].copy(), t[:, :3, j].copy()
    t[:, :3, i], t[:, :3, j] = a * c + b * s, b * c - a * s
    return t


def _frames(q, shift):
    """Frame right before every element of the chain, and behind the last one."""
    t = np.broadcast_to(np.eye(4), (len(q), 4, 4)).copy()
    out = []
    for k, (axis, driver, value, constant) in enumerate(ARM["chain"]):
        out.append(t)
        if constant is not None:
            t = t @ np.asarray(constant)
        else:
            t = _step(t, axis, value + shift[:, k] + (q[:, driver] if driver >= 0 else 0.0))
    return [*out, t]


def _deflected(q, state):
    """Poses of the tool at the fixed point of loads and deflections."""
    shift = np.zeros((len(q), len(ARM["chain"])))
    rigid = _frames(q, shift) if any(t["kind"] == 5 for t in ARM["terms"]) else []
    for term in ARM["terms"]:
        if term["kind"] < 6:
            shift[:, term["element"]] += _still_term(term, q, state, rigid)
    loaded = [t for t in ARM["terms"] if t["kind"] >= 6]
    start, going = shift.copy(), np.arange(len(q)) if loaded else np.arange(0)
    for _ in range(20):
        if not len(going):
            break
        wrenches = _wrenches(q[going], shift[going], state.payload[going])
        new = start[going]
        for term in loaded:
            new[:, term["element"]] += _load_term(term, q[going], wrenches)
        moved = np.abs(new - shift[going]).max(1) >= 1e-13
        shift[going] = new
        going = going[moved]
    return _frames(q, shift)[-1]


def _still_term(term, q, state, rigid):
    """Terms that no load drives."""
    kind, i, a, b, c = (term[name] for name in ("kind", "i", "a", "b", "c"))
    if kind == 0:
        return a * q[:, i]
    if kind == 3:
        return (state.temperature - b) * (a + c * q[:, i])
    if kind == 4:
        return a * np.sign(state.direction[:, i])
    if kind == 5:
        return a * _sag(term, q, state, rigid)
    at = q[:, i]
    if kind == 1:
        out = a * np.cos(c * at) + b * np.sin(c * at)
    else:
        knots, cubics = np.array(term["knots"]), np.array(term["cubics"])
        place = knots[0] + (at - knots[0]) % (2.0 * np.pi) if c else np.clip(at, knots[0], knots[-1])
        piece = np.clip(np.searchsorted(knots, place, side="right") - 1, 0, len(cubics) - 1)
        d, p = place - knots[piece], cubics[piece]
        out = ((p[:, 0] * d + p[:, 1]) * d + p[:, 2]) * d + p[:, 3]
    if term["span"]:
        beyond = np.maximum(np.maximum(term["low"] - at, at - term["high"]), 0.0)
        out = out * 0.5 * (1.0 + np.cos(np.pi * np.minimum(beyond / term["span"], 1.0)))
    return out


def _sag(term, q, state, rigid):
    """(d × u) · w of the arm that nothing bends."""
    driven, axes = ARM["driven"], [axis for axis, *_ in ARM["chain"]]
    mine = driven[term["i"]]
    frame = rigid[mine + 1]
    pull = np.cross(term["direction"], frame[:, :3, axes[mine] % 3])
    if term["k"] == 4:
        lever = state.payload[:, None] * (rigid[-1][:, :3, 3] - frame[:, :3, 3])
    else:
        link = driven[term["j"]]
        slides = term["k"] == 3
        lever = rigid[link + 1][:, :3, axes[link] % 3 if slides else term["k"]]
        lever = lever * q[:, [term["j"]]] if slides else lever
    return (pull * lever).sum(1)


def _load_term(term, q, wrenches):
    """Terms that loads drive."""
    kind, i, j, k, a, b, c = (term[name] for name in ("kind", "i", "j", "k", "a", "b", "c"))
    load, other = wrenches[:, i, j], wrenches[:, i, k]
    if kind == 6:
        return a * load
    if kind == 7:
        return a * (np.tanh(load / b) if b else np.sign(load))
    if kind == 8:
        size = np.sqrt(load**2 + other**2)
        return a * load / np.where(size > 0.0, size, np.inf)
    angle = c + b * q[:, i]
    return a * (np.cos(angle) * load + np.sin(angle) * other)


def _wrenches(q, shift, payload):
    """What each link exerts on the next at their joint, at rest, in the axes of the joint's mount."""
    frames, mounts = _frames(q, shift), ARM["mounts"]
    gravity = np.array(ARM["gravity"])
    place = [len(frames) - 1 if after < 0 else after + 1 for after, *_ in ARM["masses"]]
    out = np.empty((len(q), len(mounts), 6))
    loads = []
    for at, (_, mass, *com) in zip(place, ARM["masses"], strict=True):
        t = frames[at]
        loads.append((at, t[:, :3, 3] + t[:, :3, :3] @ np.array(com), np.full((len(q), 1), mass) * -gravity))
    loads.append((len(frames), frames[-1][:, :3, 3], payload[:, None] * -gravity))
    for joint, mount in enumerate(mounts):
        t = frames[mount]
        behind = [(point, force) for at, point, force in loads if at > mount]
        f = np.sum([force for _, force in behind], axis=0)
        m = np.sum([np.cross(point - t[:, :3, 3], force) for point, force in behind], axis=0)
        out[:, joint, :3] = (f[:, None, :] @ t[:, :3, :3])[:, 0]
        out[:, joint, 3:] = (m[:, None, :] @ t[:, :3, :3])[:, 0]
    return out
