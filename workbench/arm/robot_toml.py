"""Robots as TOML files: the tables of `formats.md`, with one clear sentence for each error."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal, final

import numpy as np
import tomli_w

from workbench.arm.calibration_record import Calibration, Observed
from workbench.arm.chain import Axis, Element
from workbench.arm.conventions import (
    CONSTANTS,
    ORDERS,
    Bounded,
    Column,
    JointEntry,
    build_elements,
    joint_names,
)
from workbench.arm.effects import EFFECTS, AbstractEffect
from workbench.arm.frame import Frame
from workbench.arm.gravity import TOLERANCE
from workbench.arm.joint import COM_TOLERANCE, MASS_TOLERANCE, Joint, JointKind
from workbench.arm.masses import carried, moved
from workbench.arm.mounting import Mounting
from workbench.arm.plausible_units import rpy_of, with_plausible_units
from workbench.arm.robot import ENDS, Robot
from workbench.base import se3
from workbench.base.arguments import Reads
from workbench.base.array_checks import numbers
from workbench.base.errors import RobotError
from workbench.base.files import check_ending, write_text
from workbench.base.toml import AbstractTableReader
from workbench.base.types import Freedom, frozen

CONVENTIONS = (*ORDERS, "three-rotation", "elementary")
PLACES = {"base", "tool", "session", "gravity", "gravity_tolerance", "ends"}
ROBOT_KEYS = {"name", "convention", "joint", "element", "effect", "calibration", *PLACES}
FACTS = {"name", "link", "limits", "mass", "com", "mass_tolerance", "com_tolerance", "max_moment"}
FREEDOMS = {False: Freedom.FIXED, True: Freedom.FREE, "auto": Freedom.AUTO}


@dataclass(frozen=True)
class ElementEntry:
    """One `[[element]]` of an `elementary` robot, as `Element` has it."""

    axis: Annotated[Literal["rx", "ry", "rz", "tx", "ty", "tz"], Reads("", lambda text, _: str(text).lower())]
    value: Bounded = 0.0
    name: str = ""
    joint: Column | None = None
    follows: Column | None = None
    ratio: Bounded = 1.0
    free: bool = False


@final
class _RobotReader(AbstractTableReader):
    """A robot's file being read."""

    wanted = "a robot TOML"
    otherwise = "a robot TOML, a URDF, or a built-in name"

    def frame(self, value: Any, what: str, default: Freedom) -> Frame:
        table = self.table(value, f"[{what}]")
        self.keys(table, {"xyz", "rpy", "free"}, f"[{what}]")
        free = table.get("free")
        if not (free is None or isinstance(free, bool) or free == "auto"):
            raise self.fail(f'[{what}] free must be true, false or "auto", not {free!r}')
        xyz = self.numbers(table.get("xyz", [0, 0, 0]), 3, f"[{what}] xyz")
        rpy = rpy_of(self, table.get("rpy", [0, 0, 0]), f"[{what}] rpy")
        freedom = default if free is None else FREEDOMS[free]
        return Frame(frozen(xyz), frozen(se3.rpy_to_matrix(rpy)), freedom)

    def mounting(self, table: dict, where: str, common: Mounting, default: Freedom) -> Mounting:
        """Base, tool and gravity in a table, or the common ones."""
        kinds = [kind for kind in ("base", "tool") if kind in table]
        own: dict[str, Any] = {kind: self.frame(table[kind], f"{where}{kind}", default) for kind in kinds}
        if "gravity" in table:
            own["gravity"] = frozen(self.numbers(table["gravity"], 3, f"{where}gravity"))
        return replace(common, **own)

    def entry(self, table: dict, number: int, convention: str) -> JointEntry:
        """What a `[[joint]]` says about the geometry, which an `elementary` robot has in its elements."""
        allowed = {"type"} if convention == "elementary" else {"type", "free", "follows", "ratio", *CONSTANTS}
        allowed |= {"order"} if convention == "three-rotation" else set()
        what = f"[[joint]] {number + 1}"
        self.keys(table, allowed | FACTS, what)
        return self.record(JointEntry, {key: table[key] for key in table.keys() & allowed}, what)

    def joint(self, table: dict, name: str, kind: JointKind) -> Joint:
        facts = {"label" if key == "name" else key: table[key] for key in table.keys() & FACTS}
        facts["com"] = frozen(self.numbers(table.get("com", [0, 0, 0]), 3, f"{name} com"))
        return self.record(Joint, {"name": name, "kind": kind, **facts}, name)


def read_toml(path: Path | str) -> Robot:
    """Read a robot."""
    reader = _RobotReader(path)
    data = reader.load()
    return robot_from_table(data, reader)


def robot_from_rows(table: Any, convention: str, *, name: str = "robot", limits: Any | None = None) -> Robot:
    """A robot from a joint table as in a data sheet; see `Robot.from_dh`."""
    reader = _RobotReader(f"the table of robot '{name}'")
    if hasattr(table, "to_dict"):
        table = table.to_dict("records")
    rows = list(table) if isinstance(table, Iterable) else []
    if not rows:
        raise RobotError(f"{reader.path} has no rows; give one for each joint")
    joints = [_joint_table(row, i, reader) for i, row in enumerate(rows)]
    if limits is not None:
        pairs = numbers(limits, "limits")
        moving = [joint for joint in joints if joint.get("type") != JointKind.FIXED]
        if pairs.shape != (len(moving), 2):
            wanted = f"{len(moving)} x 2"
            raise RobotError(f"limits must be {wanted}, got {' x '.join(map(str, pairs.shape)) or pairs}")
        for joint, pair in zip(moving, pairs.tolist(), strict=True):
            if np.isfinite(pair).all():
                joint["limits"] = pair
    return robot_from_table({"name": name, "convention": convention, "joint": joints}, reader)


def _joint_table(row: Any, number: int, reader: _RobotReader) -> dict[str, Any]:
    """One joint as a table: names with values, or four or five numbers."""
    if isinstance(row, Mapping):
        return {key: value.item() if isinstance(value, np.generic) else value for key, value in row.items()}
    try:
        values = np.asarray(row, float).ravel().tolist()
    except (TypeError, ValueError):
        raise reader.fail(f"joint {number + 1} must be numbers, got {row!r}") from None
    if len(values) not in (4, 5):
        raise reader.fail(f"joint {number + 1} has {len(values)} numbers; give theta, d, a, alpha (and beta)")
    return dict(zip(CONSTANTS, values, strict=False))


def robot_from_table(data: dict[str, Any], reader: _RobotReader) -> Robot:
    """A robot from the parsed tables of its file."""
    reader.keys(data, ROBOT_KEYS, "the robot")
    convention = data.get("convention")
    if convention not in CONVENTIONS:
        raise reader.fail(f"convention is {convention!r}; known: {', '.join(CONVENTIONS)}")
    tables = reader.tables(data, "joint")
    own = {key: data[key] for key in ("gravity_tolerance",) if key in data}
    unknown = Frame(free=Freedom.AUTO)
    mounting = reader.record(Mounting, {"base": unknown, "tool": unknown, **own}, "the robot")
    mounting = reader.mounting(data, "", mounting, Freedom.AUTO)
    entries = [reader.entry(t, i, convention) for i, t in enumerate(tables)]
    if not isinstance(outer := data.get("ends", ENDS), list | tuple) or [*map(type, outer)] != [str, str]:
        raise reader.fail(f"ends must be the names of the first and the last link, not {outer!r}")
    try:
        if convention == "elementary":
            elements, ends, entries = _elementary(data, tables, entries, reader)
        else:
            if "element" in data:
                raise reader.fail(f'[[element]] belongs to convention "elementary", not to "{convention}"')
            elements, ends = build_elements(convention, entries)
        kinds = [entry.type for entry in entries]
        moving = sum(kind is not JointKind.FIXED for kind in kinds)
        if strange := [e.name for e in elements if e.follows is not None and e.follows >= moving]:
            raise reader.fail(f"{strange[0]} follows an unknown joint; give one of 1 … {moving}")
        facts = zip(tables or [{}] * len(kinds), joint_names(kinds), kinds, strict=True)
        joints = tuple(reader.joint(*each) for each in facts)
        robot = Robot(
            name=str(data.get("name", Path(reader.path).stem)),
            convention=convention,
            elements=elements,
            joints=joints,
            link_ends=ends,
            mounting=mounting,
            ends=(outer[0], outer[1]),
        )
        effects = [_effect(t, i, reader) for i, t in enumerate(reader.tables(data, "effect"))]
        robot = with_plausible_units(replace(robot, effects=tuple(effects)))
    except RobotError as error:
        raise reader.fail(str(error)) from None
    robot = replace(robot, sessions=_sessions(reader.tables(data, "session"), mounting, reader))
    record = None if "calibration" not in data else _calibration(data["calibration"], robot, reader)
    loads = [t["loads"] for t in reader.tables(data, "effect") if "loads" in t]
    return replace(_loaded(robot, loads[0], reader) if loads else robot, calibration=record)


def _effect(table: dict, number: int, reader: _RobotReader) -> AbstractEffect:
    """An effect; settings other than joints and coefficients are keys of the same name."""
    what = f"[[effect]] {number + 1}"
    name = table.get("name")
    if not isinstance(name, str) or name not in EFFECTS:
        raise reader.fail(f"{what} has the name {name!r}; known: {', '.join(EFFECTS)}")
    kind, what = EFFECTS[name], f"{what} ({name})"
    reader.keys(table, {"name", "joints", "coefficients", "loads", *kind.settings()}, what)
    joints = table.get("joints", [])
    if not isinstance(joints, list) or not all(type(j) is int for j in joints):
        raise reader.fail(f"{what} joints must be a list of whole numbers from 1, not {joints!r}")
    if not isinstance(table.get("coefficients"), list) or not table["coefficients"]:
        raise reader.fail(f"{what} has no coefficients; give a list of numbers, their sizes in SI units")
    given = {key: table[key] for key in ("coefficients", *kind.settings()) if key in table}
    return reader.record(kind, {"joints": [j - 1 for j in joints], **given}, what)


def _calibration(table: Any, robot: Robot, reader: _RobotReader) -> Calibration:
    """The record in a robot's file."""
    what = "[calibration]"
    given = dict(reader.table(table, what))
    if "observed" not in given:
        raise reader.fail(f"{what} has no 'observed'; identify the arm again, or delete this table")
    given["observed"] = reader.record(Observed, given["observed"], "[calibration.observed]")
    if "geometry" in given:
        given["geometry"] = _geometry(given["geometry"], robot, reader)
    return reader.record(Calibration, given, what)


def _geometry(data: Any, robot: Robot, reader: _RobotReader) -> Robot:
    """The best arm without effects, as in the record of a calibration."""
    what = "[calibration.geometry]"
    reader.keys(data, {"values", "base", "tool", "session"}, what)
    values = reader.table(data.get("values", {}), f"{what} values")
    values = {name: reader.number(value, f"{what} value of {name}") for name, value in values.items()}
    mounting = reader.mounting(data, f"{what} ", robot.mounting, Freedom.FIXED)
    alone = replace(
        robot,
        effects=(),
        mounting=mounting,
        sessions=_sessions(reader.tables(data, "session"), mounting, reader),
    )
    if unknown := sorted(values.keys() - {e.name for e in robot.elements}):
        raise reader.fail(f"{what} has a value of '{unknown[0]}', which the arm has not")
    return alone.with_values(values)


def _loaded(robot: Robot, data: Any, reader: _RobotReader) -> Robot:
    """The arm with the masses and gravity with which its effects of load were fitted."""
    what = "the loads of an effect"
    reader.keys(data, {"links", "gravity", *(f"gravity[{name}]" for name in robot.sessions)}, what)
    links = data.get("links")
    if not isinstance(links, list) or len(links) != len(robot.joints):
        raise reader.fail(f"{what} need links, one [mass, x, y, z] for each of {len(robot.joints)} joints")
    joints = []
    for joint, link in zip(robot.joints, links, strict=True):
        mass, *com = reader.numbers(link, 4, f"{what} at {joint.name}") if link else (None, 0.0, 0.0, 0.0)
        joints.append(replace(joint, mass=mass, com=frozen(np.array(com))))

    def under(own: Mounting, key: str) -> Mounting:
        return replace(own, gravity=frozen(reader.numbers(data[key], 3, key))) if key in data else own

    mounting = under(robot.mounting, "gravity")
    sessions = {
        n: under(replace(m, gravity=mounting.gravity), f"gravity[{n}]") for n, m in robot.sessions.items()
    }
    return replace(robot, joints=tuple(joints), mounting=mounting, sessions=sessions)


def _elementary(data: dict, tables: list[dict], entries: list[JointEntry], reader: _RobotReader):
    """Elements of an `elementary` robot, and its joints; the link frame of one is right after its driven
    element."""
    elements: list[Element] = []
    ends: list[int] = []
    for i, table in enumerate(reader.tables(data, "element")):
        ends += [i] if "joint" in table or "follows" in table else []
        elements.append(_element(table, i, max(len(ends) - 1, 0), reader))
    driven = [JointEntry(_kind(elements[i])) for i in ends]
    if tables and len(tables) != len(ends):
        counts = f"{len(tables)} [[joint]] tables but {len(ends)} driven elements"
        raise reader.fail(f"{counts}; give one for each")
    for k, (table, given) in enumerate(zip(tables, entries, strict=True)):
        if "type" in table and given.type is not driven[k].type:
            axis = elements[ends[k]].axis.name.lower()
            right = f"drives {axis}; make it '{driven[k].type}'"
            raise reader.fail(f"[[joint]] {k + 1} is '{given.type}' but {right}")
    return tuple(elements), tuple(ends), driven


def _kind(element: Element) -> JointKind:
    """What a joint does that drives an element; one that follows others has no coordinate."""
    if element.follows is not None:
        return JointKind.FIXED
    return JointKind.REVOLUTE if element.axis.turns else JointKind.PRISMATIC


def _element(table: dict, number: int, link: int, reader: _RobotReader) -> Element:
    what = f"[[element]] {number + 1}"
    entry = reader.record(ElementEntry, table, what)
    if (name := entry.name or f"element{number + 1}.{entry.axis.lower()}").split(".")[0] in ("base", "tool"):
        raise reader.fail(f"{what} is named '{name}', which is reserved for [base] and [tool]; rename it")
    if entry.joint is not None and entry.follows is not None:
        raise reader.fail(f"{what} has joint and follows; give one of them")
    return Element(**(vars(entry) | {"axis": Axis[entry.axis.upper()], "name": name, "link": link}))


def _sessions(tables: list[dict], common: Mounting, reader: _RobotReader) -> dict[str, Mounting]:
    sessions: dict[str, Mounting] = {}
    for i, table in enumerate(tables):
        what = f"[[session]] {i + 1}"
        reader.keys(table, {"name", "base", "tool", "gravity"}, what)
        if not isinstance(table.get("name"), str):
            raise reader.fail(f"{what} needs a name, as in the measurements' session column")
        if table["name"] in sessions:
            raise reader.fail(f"{what} has the same name '{table['name']}' as an earlier one; rename one")
        sessions[table["name"]] = reader.mounting(table, f"{what} ", common, Freedom.FIXED)
    return sessions


def robot_to_table(robot: Robot) -> dict[str, Any]:
    """The tables of a robot's file. A robot from a URDF becomes `elementary`.

    Masses and gravity that were fitted for effects of load stand under these, `loads`; elsewhere as given.
    """
    alone = None if robot.calibration is None else robot.calibration.geometry
    table = _arm_table(robot if alone is None else robot.weighed_as(alone))
    if robot.effects:
        table["effect"] = [_effect_table(e) for e in robot.effects]
    if robot.calibration is not None:
        table["calibration"] = robot.calibration.table()
    if alone is not None:
        loads, given = (_loads_table(each) for each in (robot, robot.weighed_as(alone)))
        for effect, own in zip(table.get("effect", []), robot.effects, strict=True):
            if own.loads and loads != given:
                effect["loads"] = loads
        table["calibration"]["geometry"] = _geometry_table(alone, robot)
    return table


def _effect_table(effect: AbstractEffect) -> dict[str, Any]:
    """An effect as its table."""
    table: dict[str, Any] = {"name": str(effect.name)}
    if effect.joints:
        table["joints"] = [j + 1 for j in effect.joints]
    table["coefficients"] = list(effect.coefficients)
    for key in effect.settings():
        value = getattr(effect, key)
        if value != ():
            table[key] = list(value) if isinstance(value, tuple) else value
    return table


def _loads_table(robot: Robot) -> dict[str, Any]:
    """Masses and centres in the order of the file's joints, and gravity."""
    table = _arm_table(robot)
    links = [[j["mass"], *j["com"]] if "mass" in j else [] for j in table["joint"]]
    own = {f"gravity[{n}]": m.gravity.tolist() for n, m in robot.sessions.items()}
    return {"links": links, "gravity": table["gravity"]} | own


def _geometry_table(alone: Robot, robot: Robot) -> dict[str, Any]:
    """The best arm without effects: what differs from the arm itself."""
    values = {
        e.name: e.value
        for e, own in zip(alone.elements, robot.elements, strict=True)
        if e.matrix is None and e.value != own.value
    }
    table = _arm_table(alone)
    return {"values": values} | {k: table[k] for k in ("base", "tool", "session") if k in table}


def _arm_table(robot: Robot) -> dict[str, Any]:
    """The same without effects and record."""
    family = robot.convention in ORDERS or robot.convention == "three-rotation"
    table: dict[str, Any] = {
        "name": robot.name,
        "convention": robot.convention if family else "elementary",
        "gravity": robot.gravity.tolist(),
    }
    if robot.mounting.gravity_tolerance != TOLERANCE:
        table["gravity_tolerance"] = robot.mounting.gravity_tolerance
    if robot.ends != ENDS:
        table["ends"] = list(robot.ends)
    if family:
        table["joint"] = _joint_tables(robot)
    else:
        table["element"] = _element_tables(robot)
        joints = [robot.joints[robot.elements[i].link] for i in moved(robot)]
        bodies = zip(joints, carried(robot), strict=True)
        table["joint"] = [_joint_facts(replace(j, mass=mass, com=com)) for j, (mass, com) in bodies]
    table["base"], table["tool"] = _frame_table(robot.base), _frame_table(robot.tool)
    if robot.sessions:
        table["session"] = [
            {"name": name, "base": _frame_table(own.base, False), "tool": _frame_table(own.tool, False)}
            | ({} if own.gravity is robot.gravity else {"gravity": own.gravity.tolist()})
            for name, own in robot.sessions.items()
        ]
    return table


def robot_text(robot: Robot) -> str:
    """A robot's file."""
    return tomli_w.dumps(robot_to_table(robot))


def write_toml(robot: Robot, path: Path | str) -> Path:
    """Write a robot's file, whole or not at all."""
    return write_text(check_ending(path, "a robot's file is", ".toml"), robot_text(robot))


def _joint_facts(joint: Joint) -> dict[str, Any]:
    facts: dict[str, Any] = {k: v for k, v in (("name", joint.label), ("link", joint.link)) if v}
    if joint.kind is not JointKind.REVOLUTE:
        facts["type"] = str(joint.kind)
    if np.isfinite(joint.limits).all():
        facts["limits"] = [float(v) for v in joint.limits]
    if joint.mass is not None:
        facts["mass"] = joint.mass
        facts["com"] = joint.com.tolist()
        if joint.mass_tolerance != MASS_TOLERANCE:
            facts["mass_tolerance"] = joint.mass_tolerance
        if joint.com_tolerance != COM_TOLERANCE:
            facts["com_tolerance"] = joint.com_tolerance
    if joint.max_moment is not None:
        facts["max_moment"] = joint.max_moment
    return facts


def _joint_tables(robot: Robot) -> list[dict[str, Any]]:
    tables = []
    for link, joint in enumerate(robot.joints):
        mine = {e.name.split(".")[1]: e for e in robot.elements if e.link == link}
        table: dict[str, Any] = {c: mine[c].value for c in CONSTANTS}
        table["free"] = [c for c in CONSTANTS if mine[c].free]
        if robot.convention == "three-rotation" and next(iter(mine)) == "theta":
            table["order"] = "zyx"
        if followed := [(e.follows + 1, e.ratio) for e in mine.values() if e.follows is not None]:
            columns, ratios = zip(*followed, strict=True)
            many = len(followed) > 1
            table |= {"follows": list(columns) if many else columns[0]}
            table |= {"ratio": list(ratios) if many else ratios[0]}
        tables.append(table | _joint_facts(joint))
    return tables


def _element_tables(robot: Robot) -> list[dict[str, Any]]:
    tables: list[dict[str, Any]] = []
    for e in robot.elements:
        if e.matrix is not None:
            parts = zip(
                ("tx", "ty", "tz", "rz", "ry", "rx"),
                (*e.matrix[:3, 3], *se3.matrix_to_rpy(e.matrix[:3, :3])[::-1]),
                strict=True,
            )
            tables += [
                {"axis": axis, "value": float(value), "name": f"{e.name}.{axis}"}
                for axis, value in parts
                if value != 0.0
            ]
        else:
            table: dict[str, Any] = {"axis": e.axis.name.lower(), "value": e.value, "name": e.name}
            if e.joint is not None:
                table["joint"] = e.joint + 1
            if e.follows is not None:
                table |= {"follows": e.follows + 1, "ratio": e.ratio}
            if e.free:
                table["free"] = True
            tables.append(table)
    return tables


def _frame_table(frame: Frame, with_free: bool = True) -> dict[str, Any]:
    table: dict[str, Any] = {"xyz": frame.xyz.tolist(), "rpy": frame.rpy.tolist()}
    if with_free:
        table["free"] = {v: k for k, v in FREEDOMS.items()}[frame.free]
    return table
