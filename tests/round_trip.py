"""Saved arms evaluated by a stranger: numpy and scipy on the numbers of the file, nothing of the package.

    arm = read_arm(Path("calibrated.toml"))      # or .urdf
    flange, tool = arm(rows)                     # in the arm's own base; in the measuring frame
    errors(arm, rows)                            # mean distance and angle from what was measured [m], [rad]

A robot TOML is a chain of rotations about and translations along axes of their own frames; an effect adds to
some of their values what its law makes of the joint positions, the loads and the last motion.
"""

import csv
import re
import tomllib
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from generator import four, move, rotation, turn
from scipy.spatial.transform import Rotation

SCALES = {"rad": 1.0, "deg": np.pi / 180.0, "m": 1.0, "mm": 1e-3, "s": 1.0, "degC": 1.0, "kg": 1.0}
ORDERS = {
    "dh": ("theta", "d", "a", "alpha", "beta"),
    "hayati": ("theta", "d", "a", "alpha", "beta"),
    "craig": ("alpha", "beta", "a", "theta", "d"),
    "craig-hayati": ("alpha", "beta", "a", "theta", "d"),
}
KINDS = {"theta": "rz", "d": "tz", "a": "tx", "alpha": "rx", "beta": "ry"}
HERE = {"xyz": [0.0, 0.0, 0.0], "rpy": [0.0, 0.0, 0.0]}
WXYZ = ("qw", "qx", "qy", "qz")
STILL = 1e-6
"""Changes of a joint below this are no motion [rad or m]."""


@dataclass(frozen=True)
class Rows:
    """Measured rows.

    Args:
        q: Joint positions [rad or m].
        position: Of the tool in the measuring frame [m].
        rotation: Its orientation; None if it was not measured.
        session: Of each row; empty where there is one only.
        direction: Sign of each joint's last motion.
        payload: Mass at the tool [kg].
        time: When it was measured [s].
    """

    q: np.ndarray
    position: np.ndarray
    rotation: np.ndarray | None
    session: np.ndarray
    direction: np.ndarray
    payload: np.ndarray
    time: np.ndarray

    def __len__(self) -> int:
        return len(self.q)

    def take(self, rows: Any) -> "Rows":
        """Rows by number."""
        rotation = None if self.rotation is None else self.rotation[rows]
        parts = (self.session, self.direction, self.payload, self.time)
        return Rows(self.q[rows], self.position[rows], rotation, *(part[rows] for part in parts))


Poses = tuple[np.ndarray, np.ndarray]
Arm = Callable[[Rows], Poses]
"""Poses (rows, 4, 4) of the flange in the arm's base, and of the tool in the measuring frame."""


def rows_of(q: np.ndarray) -> Rows:
    """Joint positions of which nothing else is known."""
    nothing, names = np.zeros(len(q)), np.full(len(q), "")
    return Rows(q, np.full((len(q), 3), np.nan), None, names, np.zeros_like(q), nothing, nothing)


def read_rows(path: Path) -> Rows:
    """A table with units in its headings."""
    table = list(csv.reader(path.read_text().splitlines()))
    head = [name.strip() for name in table[0]]
    cells = np.array(table[1:])

    def column(name: str) -> np.ndarray | None:
        for k, heading in enumerate(head):
            plain, _, unit = heading.rstrip("]").partition("[")
            if plain == name:
                return cells[:, k].astype(float) * SCALES[unit] if unit else cells[:, k]
        return None

    joints = []
    while (values := column(f"q{len(joints) + 1}")) is not None:
        joints.append(values)
    q = np.column_stack(joints)
    angles, quaternion = ([column(name) for name in names] for names in (("roll", "pitch", "yaw"), WXYZ))
    rotation = None if angles[0] is None else rpy(*angles)[:, :3, :3]
    if quaternion[0] is not None:
        turned = np.column_stack(quaternion).astype(float)
        rotation = Rotation.from_quat(turned, scalar_first=True).as_matrix()
    time, session, payload = (column(name) for name in ("time", "session", "payload"))
    session = np.full(len(q), "") if session is None else session
    return Rows(
        q=q,
        position=np.column_stack([column(name) for name in "xyz"]),
        rotation=rotation,
        session=session,
        direction=np.zeros_like(q) if time is None else directions(q, time, session),
        payload=np.zeros(len(q)) if payload is None else payload,
        time=np.full(len(q), np.nan) if time is None else time,
    )


def write_rows(path: Path, rows: Rows) -> None:
    """Joints and poses as a table."""
    head = [*(f"q{k + 1}[rad]" for k in range(rows.q.shape[1])), "x[m]", "y[m]", "z[m]"]
    table = [rows.q, rows.position]
    if rows.rotation is not None:
        head += ["qx", "qy", "qz", "qw"]
        table.append(Rotation.from_matrix(rows.rotation).as_quat())
    write_table(path, head, np.hstack(table).tolist())


def write_table(path: Path | str, head: str | Iterable[str], rows: Iterable[Iterable[Any]]) -> Path:
    """Rows of numbers and words under their headings, numbers with all digits."""
    first = head if isinstance(head, str) else ",".join(head)
    lines = [*[first] * bool(first), *(",".join(map(str, row)) for row in rows)]
    Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")
    return Path(path)


def thinned(source: Path, most: int) -> tuple[str, list[str]]:
    """Heading and lines of a table, evenly spread where it is large."""
    head, *lines = source.read_text().splitlines()
    kept = np.unique(np.linspace(0, len(lines) - 1, min(len(lines), most)).astype(int))
    return head, [lines[k] for k in kept]


def directions(q: np.ndarray, time: np.ndarray, session: np.ndarray) -> np.ndarray:
    """Sign of each joint's last motion, each row reached straight from the last one of its session."""
    out = np.zeros_like(q)
    for name in np.unique(session):
        order = np.flatnonzero(session == name)
        order = order[np.argsort(time[order], kind="stable")]
        for before, now in pairwise(order):
            moved = q[now] - q[before]
            out[now] = np.where(np.abs(moved) > STILL, np.sign(moved), out[before])
    return out


def step(kind: str, value: np.ndarray) -> np.ndarray:
    """Rotations about, or translations along, an axis: rx … tz."""
    return (turn if kind[0] == "r" else move)(kind[1], value)


def rpy(roll: Any, pitch: Any, yaw: Any) -> np.ndarray:
    """Rz(yaw) Ry(pitch) Rx(roll)."""
    return step("rz", yaw) @ step("ry", pitch) @ step("rx", roll)


def placed(xyz: Any, angles: Any) -> np.ndarray:
    """A pose from numbers, or from a text with numbers."""
    xyz, angles = (np.array(v.split() if isinstance(v, str) else v, float) for v in (xyz, angles))
    out = rpy(*angles)
    out[:3, 3] = xyz
    return out


inverse = np.linalg.inv


def angle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angle between orientations [rad], exact for small ones: |A − B| = 2√2 sin(½ angle)."""
    distance = np.linalg.norm(a[..., :3, :3] - b[..., :3, :3], axis=(-2, -1))
    return 2.0 * np.arcsin(np.minimum(distance / np.sqrt(8.0), 1.0))


@dataclass(frozen=True)
class Errors:
    """Mean error on some rows [m], [rad]; NaN without measured orientations."""

    position: float
    rotation: float = float("nan")


def errors(arm: Arm, rows: Rows) -> Errors:
    """Mean distance and angle of the tool from what was measured, base and tool as the file has them."""
    tool = arm(rows)[1]
    distance = np.linalg.norm(tool[:, :3, 3] - rows.position, axis=1)
    turned = np.nan if rows.rotation is None else angle(tool, rows.rotation).mean()
    return Errors(float(np.nanmean(distance)), float(turned))


def pose_difference(a: np.ndarray, b: np.ndarray) -> tuple[float, float]:
    """Greatest distance [m] and angle [rad] between poses."""
    return float(np.linalg.norm(a[:, :3, 3] - b[:, :3, 3], axis=1).max()), float(angle(a, b).max())


def aligned(points: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """The motion that brings points closest to measured ones (Kabsch)."""
    a, b = points - points.mean(0), measured - measured.mean(0)
    u, _, vt = np.linalg.svd(b.T @ a)
    turned = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    return four(turned, measured.mean(0) - turned @ points.mean(0))


# Robot TOML ---------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Body:
    """A point mass: behind which step of the chain it hangs [kg], and where in the frame there [m]."""

    behind: int
    mass: float
    com: np.ndarray


@dataclass(frozen=True)
class TomlArm:
    """A robot's file.

    Args:
        steps: Kind, value and name of every step.
        driven: Step that each joint drives.
        bodies: None unless the masses of all moving links are known.
    """

    table: dict[str, Any]
    steps: list[tuple[str, float, str]]
    driven: list[int]
    bodies: list[Body] | None
    effects: list[dict[str, Any]] = field(default_factory=list)

    @property
    def slides(self) -> np.ndarray:
        return np.array([self.steps[k][0][0] == "t" for k in self.driven])

    @property
    def coupled(self) -> np.ndarray:
        """What each joint is of the columns: itself, and those that it follows."""
        out = np.eye(len(self.driven))
        moving = [j for j in self.table.get("joint", []) if j.get("type") != "fixed"]
        for k, joint in enumerate(moving):
            for j, ratio in zip(
                np.ravel(joint.get("follows", [])), np.ravel(joint.get("ratio", [])), strict=True
            ):
                out[k, int(j) - 1] += ratio
        return out

    def frames(self, q: np.ndarray, shift: dict[str, np.ndarray]) -> np.ndarray:
        """Frames (steps + 1, rows, 4, 4) before every step and behind the last, in the arm's base."""
        q, out = q @ self.coupled.T, [np.broadcast_to(np.eye(4), (len(q), 4, 4))]
        for k, (kind, value, name) in enumerate(self.steps):
            at = value + shift.get(name, 0.0) + (q[:, self.driven.index(k)] if k in self.driven else 0.0)
            out.append(out[-1] @ step(kind, np.broadcast_to(at, len(q))))
        return np.array(out)

    def __call__(self, rows: Rows) -> Poses:
        flange = np.empty((len(rows), 4, 4))
        tool = np.empty_like(flange)
        sessions = {s["name"]: s for s in self.table.get("session", [])}
        for name in np.unique(rows.session):
            mine = np.flatnonzero(rows.session == name)
            frames = sessions.get(str(name), {})
            base, end = (
                placed(t["xyz"], t["rpy"])
                for t in (frames.get(k) or self.table.get(k, HERE) for k in ("base", "tool"))
            )
            gravity = frames.get("gravity") or self.table.get("gravity", [0, 0, -9.81])
            for loads in (e["loads"] for e in self.effects if "loads" in e):
                gravity = loads.get(f"gravity[{name}]", loads["gravity"])
            shift = self.shift(rows.take(mine), end, np.array(gravity))
            flange[mine] = self.frames(rows.q[mine], shift)[-1]
            tool[mine] = self.drifted(base, rows.time[mine]) @ flange[mine] @ end
        return flange, tool

    def drifted(self, base: np.ndarray, time: np.ndarray) -> np.ndarray:
        """Where the base is seen while the measuring frame drifts."""
        out = np.broadcast_to(base, (len(time), 4, 4)).copy()
        for effect in self.table.get("effect", []):
            if effect["name"] == "base-drift":
                x, y, z, roll, pitch, yaw = np.outer(
                    effect["coefficients"], time - effect.get("reference", 0.0)
                )
                out[:, :3, 3] += np.column_stack([x, y, z])
                out = out @ step("rx", roll) @ step("ry", pitch) @ step("rz", yaw)
        return out

    def shift(self, rows: Rows, tool: np.ndarray, gravity: np.ndarray) -> dict[str, np.ndarray]:
        """What the effects add to each step, at the fixed point of loads and deflections."""
        shift: dict[str, np.ndarray] = {}
        for _ in range(1 + 30 * any(e["name"] in LOADED for e in self.effects)):
            moments = self.moments(rows, shift, tool, gravity) if self.bodies and self.effects else None
            shift = {}
            for effect in self.effects:
                for name, value in LAWS[effect["name"]](self, effect, rows, moments).items():
                    shift[name] = shift.get(name, 0.0) + value
        return shift

    def moments(
        self, rows: Rows, shift: dict[str, np.ndarray], tool: np.ndarray, gravity: np.ndarray
    ) -> np.ndarray:
        """What the earlier link exerts on the later one at rest (rows, joints, [f; τ]), axes of the joint."""
        frames = self.frames(rows.q, shift)
        masses = [
            (b.behind, (frames[b.behind] @ np.append(b.com, 1.0))[:, :3], np.full(len(rows), b.mass))
            for b in self.bodies or []
        ]
        masses.append((len(self.steps) + 1, (frames[-1] @ tool[:, 3])[:, :3], rows.payload))
        out = np.zeros((len(rows), len(self.driven), 6))
        for j, k in enumerate(self.driven):
            first = k - 2 if self.steps[max(k - 1, 0)][2].startswith("tilt") else k
            here = frames[first]
            for behind, point, mass in masses:
                if behind <= first:
                    continue
                force = -mass[:, None] * gravity
                moment = np.cross(point - here[:, :3, 3], force)
                for part, vector in ((slice(3), force), (slice(3, 6), moment)):
                    out[:, j, part] += np.einsum("rji,rj->ri", here[:, :3, :3], vector)
        return out


Shift = dict[str, np.ndarray]
BENDING = ("link-flexure", "extension-compliance", "extension-clearance")
LOADED = ("joint-compliance", "bearing-compliance", "clearance-tilt", "backlash", *BENDING)


def _joints(effect: dict) -> list[int]:
    return [j - 1 for j in effect["joints"]]


def _across(arm: TomlArm, joint: int) -> list[int]:
    own = "xyz".index(arm.steps[arm.driven[joint]][0][1])
    return [(own + 1) % 3, (own + 2) % 3]


def _own(arm: TomlArm, joint: int, moments: np.ndarray) -> np.ndarray:
    kind = arm.steps[arm.driven[joint]][0]
    return moments[:, joint, "xyz".index(kind[1]) + (3 if kind[0] == "r" else 0)]


def _driven(arm: TomlArm, joint: int) -> str:
    return arm.steps[arm.driven[joint]][2]


def _compliance(arm: TomlArm, effect: dict, rows: Rows, moments: np.ndarray) -> Shift:
    pairs = zip(_joints(effect), effect["coefficients"], strict=True)
    return {_driven(arm, j): -c * _own(arm, j, moments) for j, c in pairs}


def _backlash(arm: TomlArm, effect: dict, rows: Rows, moments: np.ndarray) -> Shift:
    out, width = {}, effect.get("width", 0.0)
    for j, c in zip(_joints(effect), effect["coefficients"], strict=True):
        if effect.get("by") == "motion":
            side = np.sign(rows.direction[:, j])
        else:
            load = _own(arm, j, moments)
            side = np.tanh(load / width) if width else np.sign(load)
        out[_driven(arm, j)] = -c * side
    return out


def _scale(arm: TomlArm, effect: dict, rows: Rows, moments: Any) -> Shift:
    return {
        _driven(arm, j): c * rows.q[:, j]
        for j, c in zip(_joints(effect), effect["coefficients"], strict=True)
    }


def _fading(q: np.ndarray, low: float, high: float, spacing: float) -> np.ndarray:
    """1 where the law was learned, 0 from three spacings beyond."""
    beyond = np.maximum(np.maximum(low - q, q - high), 0.0) / (3.0 * spacing)
    return 0.5 * (1.0 + np.cos(np.pi * np.minimum(beyond, 1.0)))


def _harmonic(arm: TomlArm, effect: dict, rows: Rows, moments: Any) -> Shift:
    orders = effect.get("order", 1)
    orders = orders if isinstance(orders, list) else [orders]
    sizes = np.reshape(effect["coefficients"], (-1, len(orders), 2))
    out = {}
    for j, pairs in zip(_joints(effect), sizes, strict=True):
        q = rows.q[:, j]
        value = sum(c * np.cos(k * q) + s * np.sin(k * q) for k, (c, s) in zip(orders, pairs, strict=True))
        if effect.get("range"):
            value = value * _fading(q, *effect["range"], np.pi / orders[-1])
        out[_driven(arm, j)] = value
    return out


def _tipped(arm: TomlArm, effect: dict, rows: Rows, moments: np.ndarray) -> Shift:
    """Across the joint, by the moment or in its direction alone; behind an extension, by its length."""
    out, extends = {}, effect["name"].startswith("extension")
    for j, c in zip(_joints(effect), effect["coefficients"], strict=True):
        load = moments[:, j, [3 + axis for axis in _across(arm, j)]]
        if "clearance" in effect["name"]:
            load = load / np.maximum(np.linalg.norm(load, axis=1, keepdims=True), 1e-300)
        if extends:
            load = load * (rows.q[:, [j]] - effect.get("retracted", 0.0))
        where = "bend" if extends else "tilt"
        out |= {f"{where}{j}.{axis}": -c * load[:, k] for k, axis in enumerate(_across(arm, j))}
    return out


def _flexure(arm: TomlArm, effect: dict, rows: Rows, moments: np.ndarray) -> Shift:
    out = {}
    for j, (c1, c2) in zip(_joints(effect), np.reshape(effect["coefficients"], (-1, 2)), strict=True):
        x, y = moments[:, j, [3 + axis for axis in _across(arm, j)]].T
        kind, value, _ = arm.steps[arm.driven[j]]
        v = value + rows.q[:, j] if kind[0] == "r" else np.zeros(len(rows))
        along = (np.cos(v) * x + np.sin(v) * y, np.cos(v) * y - np.sin(v) * x)
        sizes = zip(_across(arm, j), (c1, c2), along, strict=True)
        out |= {f"bend{j}.{axis}": -c * load for axis, c, load in sizes}
    return out


def _sag(arm: TomlArm, effect: dict, rows: Rows, moments: Any) -> Shift:
    (joint,) = _joints(effect)
    frames = arm.frames(rows.q, {})
    down = np.array(effect.get("gravity", [0.0, 0.0, -1.0]))
    here = frames[arm.driven[joint] + 1]
    axis = here[:, :3, "xyz".index(arm.steps[arm.driven[joint]][0][1])]
    pull = np.cross(down / np.linalg.norm(down), axis)
    value = np.zeros(len(rows))
    for term, c in zip(effect["terms"].split(), effect["coefficients"], strict=True):
        assert term[-1] in "xyz", "other terms are not evaluated here"
        behind = frames[arm.driven[int(term[:-1]) - 1] + 1]
        value = value + c * (pull * behind[:, :3, "xyz".index(term[-1])]).sum(1)
    return {_driven(arm, joint): value}


LAWS: dict[str, Callable[[TomlArm, dict, Rows, Any], Shift]] = {
    "joint-compliance": _compliance,
    "backlash": _backlash,
    "encoder-scale": _scale,
    "joint-harmonic": _harmonic,
    "bearing-compliance": _tipped,
    "clearance-tilt": _tipped,
    "gravity-sag": _sag,
    "link-flexure": _flexure,
    "extension-compliance": _tipped,
    "extension-clearance": _tipped,
}


def toml_arm(text: str) -> TomlArm:
    """An arm from the text of its file."""
    table = tomllib.loads(text)
    steps, driven, bodies = [], [], []
    effects = [e for e in table.get("effect", []) if e["name"] != "base-drift"]
    links = next((e["loads"]["links"] for e in effects if "loads" in e), None)
    tilted = {j for e in effects if e["name"] in ("bearing-compliance", "clearance-tilt") for j in _joints(e)}

    deflected = {j for e in effects if e["name"] in BENDING for j in _joints(e)}

    def turn_across(kind: str, name: str) -> None:
        own = "xyz".index(kind[1])
        steps.extend((f"r{'xyz'[k % 3]}", 0.0, f"{name}.{k % 3}") for k in (own + 1, own + 2))

    def add(kind: str, value: float, name: str, *, drives: bool) -> None:
        joint = len(driven) if drives else -1
        if joint in tilted:
            turn_across(kind, f"tilt{joint}")
        if drives:
            driven.append(len(steps))
        steps.append((kind, value, name))
        if joint in deflected:
            turn_across(kind, f"bend{joint}")

    def carry(entry: dict) -> None:
        if links is not None:
            if link := links[table["joint"].index(entry)]:
                bodies.append(Body(len(steps), link[0], np.array(link[1:])))
        elif entry.get("mass") is not None:
            bodies.append(Body(len(steps), entry["mass"], np.array(entry.get("com", [0.0, 0.0, 0.0]))))

    known = True
    if table["convention"] == "elementary":
        facts = table.get("joint", [])
        for k, element in enumerate(table["element"]):
            drives = "joint" in element
            add(element["axis"], element.get("value", 0.0), f"{k}", drives=drives)
            if drives and facts:
                carry(facts[len(driven) - 1])
                known &= "mass" in facts[len(driven) - 1]
    else:
        for k, joint in enumerate(table["joint"]):
            kind = joint.get("type", "revolute")
            drives = {"revolute": "theta", "prismatic": "d"}.get(kind)
            for constant in ORDERS[table["convention"]]:
                name = f"{k}.{constant}"
                add(KINDS[constant], joint.get(constant, 0.0), name, drives=constant == drives)
            carry(joint)
            known &= "mass" in joint or kind == "fixed"
    return TomlArm(table, steps, driven, bodies if known and bodies else None, effects)


# URDF, tables --------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class FrameArm:
    """Joints in frames of their own: origin, axis, and whether it turns, its column of q, ratio and offset;
    None for a fixed one."""

    base: np.ndarray
    joints: list[tuple[np.ndarray, np.ndarray, tuple[bool, int, float, float] | None]]
    tool: np.ndarray

    def __call__(self, rows: Rows) -> Poses:
        here = np.broadcast_to(np.eye(4), (len(rows), 4, 4))
        for origin, axis, driven in self.joints:
            here = here @ origin
            if driven is not None:
                turns, column, ratio, offset = driven
                here = here @ moved(axis, offset + ratio * rows.q[:, column], turns=turns)
        return here, self.base @ here @ self.tool


MIMIC = {"multiplier": 1, "offset": 0}


def moved(axis: np.ndarray, by: np.ndarray, *, turns: bool) -> np.ndarray:
    """Rotations about, or translations along, any axis (Rodrigues)."""
    ways = by[:, None] * axis / np.linalg.norm(axis)
    return four(rotation(ways)) if turns else four(np.eye(3), ways)


def urdf_arm(text: str) -> FrameArm:
    """From `measuring_frame`, or the root, to `calibrated_tool`, or the end of the longest chain."""
    joints = {node.find("child").get("link"): node for node in ET.fromstring(text).findall("joint")}

    def chain(link: str) -> list[ET.Element]:
        out = []
        while link in joints:
            out.insert(0, joints[link])
            link = joints[link].find("parent").get("link")
        return out

    def moving(link: str) -> int:
        return sum(node.get("type") != "fixed" for node in chain(link))

    ends = ["calibrated_tool"] if "calibrated_tool" in joints else joints
    tip = max(ends, key=lambda n: (moving(n), len(chain(n))))
    base, tool, found, columns = np.eye(4), np.eye(4), [], list[str]()
    for node in chain(tip):
        place = node.find("origin")
        given = {} if place is None else place.attrib
        origin = placed(given.get("xyz", "0 0 0"), given.get("rpy", "0 0 0"))
        if node.find("parent").get("link") == "measuring_frame":
            base = origin
        elif node.find("child").get("link") == "calibrated_tool":
            tool = origin
        else:
            axis = node.find("axis")
            along = np.array(["1", "0", "0"] if axis is None else axis.get("xyz").split(), float)
            kind, mimic = node.get("type"), node.find("mimic")
            of = node.get("name") if mimic is None else mimic.get("joint")
            columns += [of] if mimic is None and kind != "fixed" else []
            by = [1.0, 0.0] if mimic is None else [float(mimic.get(*k)) for k in MIMIC.items()]
            driven = None if kind == "fixed" else (kind != "prismatic", columns.index(of), *by)
            found.append((origin, along, driven))
    return FrameArm(base, found, tool)


def in_sessions(arm: FrameArm, toml: TomlArm) -> Arm:
    """An arm of one session on the bases, and with the tools, of all sessions of a TOML."""
    alone = toml.table.get("calibration", {}).get("geometry", toml.table)
    sessions = alone.get("session", [])
    frames = [[placed(s[k]["xyz"], s[k]["rpy"]) for k in ("base", "tool")] for s in sessions]

    def poses(rows: Rows) -> Poses:
        flange, tool = arm(rows)
        for session, (base, end) in zip(sessions, frames, strict=True):
            mine = rows.session == session["name"]
            tool[mine] = base @ inverse(frames[0][0]) @ tool[mine] @ inverse(frames[0][1]) @ end
        return flange, tool

    return poses


def frames_arm(flange: Callable[[np.ndarray], np.ndarray], like: FrameArm) -> Arm:
    """A file that ends at the flange, read row by row, with base and tool of another."""

    def poses(rows: Rows) -> Poses:
        out = np.array([flange(q) for q in rows.q])
        return out, like.base @ out @ like.tool

    return poses


READERS: dict[str, Callable[[str], Arm]] = {".toml": toml_arm, ".urdf": urdf_arm}


def read_arm(path: Path) -> Arm:
    """An arm from a file, by its ending."""
    return READERS[path.suffix](path.read_text())


# What was shown -----------------------------------------------------------------------------------------

SHOWN = re.compile(r"(URDF|TOML) ([\d.]+) mm(?: ([\d.]+)°)?")


@dataclass(frozen=True)
class Saved:
    """Files of one result, and what was shown of them.

    Args:
        shown: What a person saw of the files' errors.
        held_out: Rows that were held out.
        refitted: Rows to which the files were fitted once more; None if they were not.
    """

    toml: Path
    urdf: Path
    shown: str
    held_out: np.ndarray
    refitted: np.ndarray | None

    @property
    def judged(self) -> tuple[str, np.ndarray]:
        """What was shown of the files themselves, and the rows on which."""
        first, _, again = self.shown.partition("fter the final fit")
        return (first, self.held_out) if self.refitted is None else (again, self.refitted)

    def check(self, rows: Rows) -> None:
        """Each file leaves on its rows what was shown."""
        text, numbers = self.judged
        shown = {name: (mm, turned) for name, mm, turned in SHOWN.findall(text)}
        assert set(shown) == {"URDF", "TOML"}, self.shown
        for name, path in (("TOML", self.toml), ("URDF", self.urdf)):
            found = errors(self.arm(path), rows.take(numbers))
            mm, turned = shown[name]
            assert abs(float(mm) - 1e3 * found.position) < 1e-3, (name, mm, found)
            assert bool(turned) == (rows.rotation is not None), self.shown
            if turned:
                assert abs(float(turned) - np.rad2deg(found.rotation)) < 1e-4, (name, turned, found)

    def arm(self, path: Path) -> Arm:
        """The file's arm; a URDF's on the bases of all sessions, which the TOML has."""
        arm = read_arm(path)
        return in_sessions(arm, toml_arm(self.toml.read_text())) if path == self.urdf else arm
