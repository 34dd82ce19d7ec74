"""The `columns` option: what each column, or each MATLAB matrix, holds.

Two forms. A list in the order of the columns, for files without a header:

    q1[deg],q2[deg],…,q6[deg],xyz[mm],quat

where '…' or '..' counts on, '-' leaves a column out, and a group (q, xyz, rpy, zxz, quat, rotvec, matrix, m1)
stands for its columns. Or pairs 'meaning[unit|row|column]=name', the name being a heading of the file or
a variable of a MATLAB file ('data.joints_deg' for a struct's field):

    q[rad|column]=Q, xyz[mm|column]=P

'column' says that one column of the matrix is one measurement, 'row' (the default where the shape leaves no
doubt) that one row is. The two sides may stand the other way round: Q[column]=q[rad].
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from workbench.base.errors import OptionError

GROUPS: dict[str, tuple[str, ...]] = {
    "xyz": ("x", "y", "z"),
    "rpy": ("roll", "pitch", "yaw"),
    "zxz": ("zxz_phi", "zxz_theta", "zxz_psi"),
    "quat": ("qw", "qx", "qy", "qz"),
    "quat_xyzw": ("qx", "qy", "qz", "qw"),
    "rotvec": ("rx", "ry", "rz"),
    "matrix": tuple(f"r{i}{j}" for i in "123" for j in "123"),
    "pose": ("x", "y", "z", *(f"r{i}{j}" for i in "123" for j in "123")),
}
SAME_GROUPS = {
    "p": "xyz",
    "position": "xyz",
    "quaternion": "quat",
    "wxyz": "quat",
    "xyzw": "quat_xyzw",
    "rotation": "matrix",
}
Joints = int | Sequence[str] | None
"""Number of joints of a robot, or their names in order; None: not known."""
IGNORED = "-"
"""Leaves a column out."""
_ORIENTATIONS = {"row": "row", "rows": "row", "column": "column", "columns": "column", "col": "column"}
_ITEM = re.compile(r"(?P<name>[^\[\]]*)(?:\[(?P<inner>[^\[\]]*)\])?")
_DOTS = ("…", "...", "..")


@dataclass(frozen=True)
class NamedUnit:
    """One side of an entry: a name with what stood in its brackets."""

    name: str
    unit: str | None = None
    orientation: str | None = None

    def heading(self, key: str | None = None) -> str:
        return (key or self.name) + (f"[{self.unit}]" if self.unit is not None else "")


@dataclass(frozen=True)
class Pair:
    """Two names that mean the same; which is the file's is found by looking into the file."""

    left: NamedUnit
    right: tuple[NamedUnit, ...]


@dataclass(frozen=True)
class Naming:
    """The `columns` option, parsed: a list in order, or pairs; or a mapping, the file's names on the left."""

    text: str
    items: tuple[NamedUnit, ...] = ()
    pairs: tuple[Pair, ...] = ()
    is_mapping: bool = False


def parse_columns(text: str) -> Naming:
    items: list[NamedUnit] = []
    pairs: list[Pair] = []
    for part in _parts(text):
        left, equals, right = part.partition("=")
        if equals:
            pairs.append(Pair(_item(left, text), (_item(right, text),)))
        elif pairs:
            last = pairs[-1]
            pairs[-1] = Pair(last.left, (*last.right, _item(part, text)))
        else:
            items.append(_item(part, text))
    if bool(items) == bool(pairs):
        raise OptionError(
            f"columns='{text}' is neither a list ('q1[deg],…,x[mm],y[mm],z[mm]') "
            "nor pairs ('q[rad|column]=Q')"
        )
    pairs = [Pair(pair.left, _counted_on(pair.right, text)) for pair in pairs]
    return Naming(text, _counted_on(tuple(items), text), tuple(pairs))


def _parts(text: str) -> list[str]:
    """Entries, parted at commas, semicolons or line ends that are outside brackets; '=' drops its blanks."""
    flat = re.sub(r"\s*=\s*", "=", text)
    flat = re.sub(r"(?<=[\w\]])\s*(\.\.\.?|…)\s*(?=[A-Za-z])", r",…,", flat)
    parts = re.split(r"[,;\n](?![^\[]*\])", flat)
    return [part.strip() for part in parts if part.strip()]


def _item(text: str, whole: str) -> NamedUnit:
    """A name with its brackets: [unit], [row] or [unit|column]."""
    match = _ITEM.fullmatch(text.strip())
    if match is None or not match["name"].strip():
        raise OptionError(f"columns='{whole}': '{text}' is not of the form name[unit] or name[unit|column]")
    unit = orientation = None
    for token in (match["inner"] or "").split("|") if match["inner"] is not None else ():
        token = token.strip()
        if token.lower() in _ORIENTATIONS:
            orientation = _ORIENTATIONS[token.lower()]
        elif unit is None:
            unit = token
        else:
            raise OptionError(f"columns='{whole}': '{text}' has two units, '{unit}' and '{token}'")
    return NamedUnit(match["name"].strip(), unit, orientation)


def _counted_on(items: tuple[NamedUnit, ...], whole: str) -> tuple[NamedUnit, ...]:
    """Items with 'q1, …, q6' written out."""
    result: list[NamedUnit] = []
    for i, item in enumerate(items):
        if item.name not in _DOTS:
            result.append(item)
            continue
        first = re.fullmatch(r"(\D*)(\d+)", result[-1].name) if result else None
        last = re.fullmatch(r"(\D*)(\d+)", items[i + 1].name) if i + 1 < len(items) else None
        if first is None or last is None or first[1] != last[1] or int(last[2]) <= int(first[2]):
            raise OptionError(
                f"columns='{whole}': '…' must be between numbered names, as in q1[deg],…,q6[deg]"
            )
        unit = result[-1].unit if result[-1].unit is not None else items[i + 1].unit
        result[-1] = NamedUnit(result[-1].name, unit)
        result += [NamedUnit(f"{first[1]}{n}", unit) for n in range(int(first[2]) + 1, int(last[2]))]
        if items[i + 1].unit is None:
            items = (*items[: i + 1], NamedUnit(items[i + 1].name, unit), *items[i + 2 :])
    return tuple(result)


def group_keys(name: str) -> tuple[str, ...] | None:
    """The columns that a group name stands for; None for any other name."""
    if marker := re.fullmatch(r"(?:m|marker)_?(\d+)", name.lower()):
        return tuple(f"m{marker[1]}{axis}" for axis in "xyz")
    return GROUPS.get(SAME_GROUPS.get(name.lower(), name.lower()))


def headings_in_order(naming: Naming, width: int) -> tuple[str, ...]:
    """Headings of all columns, with groups written out; a lone 'q[deg]' takes the columns that are left."""
    items = naming.items
    if len(items) == width:
        groups = [item for item in items if item.name != "q" and _width(item) > 1]
        if not groups:
            return tuple(item.heading() for item in items)
    fixed = sum(_width(item) for item in items if item.name != "q")
    open_groups = sum(item.name == "q" for item in items)
    joints = width - fixed
    if fixed + open_groups > width or open_groups > 1 or (not open_groups and fixed != width):
        raise OptionError(
            f"columns='{naming.text}' names {fixed + open_groups} columns where the file has {width}: "
            "name each in order, '-' for one to leave out"
        )
    headings: list[str] = []
    for item in items:
        if item.name == "q":
            headings += [item.heading(f"q{i}") for i in range(1, joints + 1)]
        elif _width(item) > 1:
            headings += [_group_heading(item, key) for key in group_keys(item.name) or ()]
        else:
            headings.append(item.heading())
    return tuple(headings)


def _group_heading(item: NamedUnit, key: str) -> str:
    """Heading of one column of a group; the numbers of rotations and quaternions carry no unit."""
    return key if re.fullmatch(r"r\d\d|q[wxyz]", key) else item.heading(key)


def _width(item: NamedUnit) -> int:
    return len(group_keys(item.name) or "1")
