"""What the caller says of the columns of a file, or of the matrices of a MATLAB file: {heading: meaning}.

The `columns` option is such a mapping, `{"Achse 1": "q1[deg]", "Halle": "-"}`, in text as JSON. Or a list in
the order of the columns, for files without a header:

    q1[deg],q2[deg],…,q6[deg],xyz[mm],quat

where '…' or '..' counts on, '-' leaves a column out, and a group (q, xyz, rpy, zxz, quat, rotvec, matrix, m1)
stands for its columns. Or pairs 'meaning[unit|row|column]=name', the name being a heading of the file or
a variable of a MATLAB file ('data.joints_deg' for a struct's field):

    q[rad|column]=Q, xyz[mm|column]=P

'column' says that one column of the matrix is one measurement, 'row' (the default where the shape leaves no
doubt) that one row is. The two sides may stand the other way round: Q[column]=q[rad].
"""

import json
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import NamedTuple

from workbench.arm.robot import Robot
from workbench.base.errors import OptionError
from workbench.base.units import parse_heading

MATRIX = tuple(f"r{i}{j}" for i in "123" for j in "123")
GROUPS: dict[str, tuple[str, ...]] = {
    "xyz": ("x", "y", "z"),
    "rpy": ("roll", "pitch", "yaw"),
    "zxz": ("zxz_phi", "zxz_theta", "zxz_psi"),
    "quat": ("qw", "qx", "qy", "qz"),
    "quat_xyzw": ("qx", "qy", "qz", "qw"),
    "rotvec": ("rx", "ry", "rz"),
    "matrix": MATRIX,
    "pose": ("x", "y", "z", *MATRIX),
}
_SAME = ("p xyz", "position xyz", "quaternion quat", "wxyz quat", "xyzw quat_xyzw", "rotation matrix")
GROUPS |= {name: GROUPS[own] for name, own in map(str.split, _SAME)}
Joints = int | Sequence[str] | Robot | None
"""A robot, the names of its joints in order, or their number; None: not known."""
IGNORED = "-"
"""Leaves a column out."""
UNITLESS = re.compile(r"r\d\d|q[wxyz]|direction\d+")
"""Columns that carry no unit, whatever their group has."""
_SIDES = {"row": "row", "rows": "row", "column": "column", "columns": "column", "col": "column"}
_ITEM = re.compile(r"\s*([^\[\]]*[^\[\]\s])\s*(?:\[([^\[\]]*)\])?\s*")
_JOINT = re.compile(r"q\d*", re.IGNORECASE)
_RUN = re.compile(r"([^\W\d]+)(\d{1,3})(\[[^]]*\])?[\s,;]*(?:…|\.\.\.?)[\s,;]*\1(\d{1,3})(\[[^]]*\])?")
"""Numbered names with dots between them: 'q1[deg], …, q6[deg]'."""


class NamedUnit(NamedTuple):
    """A name with what stood in its brackets."""

    name: str
    unit: str | None = None
    orientation: str | None = None

    def heading(self, key: str | None = None) -> str:
        """The name, or one of the columns that it stands for, with the unit."""
        key = key or self.name
        return key if self.unit is None or UNITLESS.fullmatch(key) else f"{key}[{self.unit}]"


Pair = tuple[NamedUnit, tuple[NamedUnit, ...]]
"""Names that mean the same; which is the file's is found by looking into the file."""


@dataclass(frozen=True)
class Naming:
    """The `columns` option, parsed: a list in order, or pairs; or a mapping, the file's names on the left."""

    text: str
    items: tuple[NamedUnit, ...] = ()
    pairs: tuple[Pair, ...] = ()
    is_mapping: bool = False

    def __bool__(self) -> bool:
        return bool(self.items or self.pairs)


Columns = str | Mapping[str, str] | Naming | None
"""The option, in any of its forms."""
AS_HEADED = Naming("")
"""Nothing, of a file of which no option says what its columns are: messages then name its headings alone."""


def parse_columns(text: Columns) -> Naming | None:
    """The option, read where it is text or a mapping."""
    if isinstance(text, str) and text.lstrip().startswith("{"):
        with suppress(ValueError):
            text = json.loads(text)
    if isinstance(text, Mapping):
        ours = ((NamedUnit(str(theirs)), parse_heading(str(own))) for theirs, own in text.items())
        pairs = tuple((theirs, (NamedUnit(own.name, own.unit),)) for theirs, own in ours)
        return Naming(str(dict(text)), (), pairs, is_mapping=True) if pairs else None
    if not isinstance(text, str):
        return text
    items, found, whole = list[NamedUnit](), list[Pair](), text
    for run in reversed([*_RUN.finditer(text)]):  # 'q1[deg],q2[deg],q3[deg]' of 'q1[deg],…,q3'
        names = [f"{run[1]}{n}{run[3] or run[5] or ''}" for n in range(int(run[2]), int(run[4]) + 1)]
        whole = whole[: run.start()] + ",".join(names) + whole[run.end() :]
    for part in re.split(r"[,;\n](?![^\[]*\])", whole):
        left, equals, right = part.partition("=")
        if equals:
            found.append((_item(left, text), (_item(right, text),)))
        elif part.strip() and found:  # one more column of the matrix
            found[-1] = (found[-1][0], (*found[-1][1], _item(part, text)))
        elif part.strip():
            items.append(_item(part, text))
    if bool(items) == bool(found):
        known = "neither a list ('q1[deg],…,x[mm],y[mm],z[mm]') nor pairs ('q[rad|column]=Q')"
        raise OptionError(f"columns='{text}' is {known}")
    return Naming(text, tuple(items), tuple(found))


def of_joints_and_others(naming: Naming) -> tuple[Naming, Naming]:
    """Names of joints, for a table of their own, and the others; '-' goes with the name before it."""
    last = next((item.name for item in naming.items if item.name != IGNORED), "")
    lists: tuple[list[NamedUnit], list[NamedUnit]] = [], []
    for item in naming.items:
        last = last if item.name == IGNORED else item.name
        lists[not _JOINT.fullmatch(last)].append(item)
    are_joints = [any(_JOINT.fullmatch(one.name) for one in (a, *b)) for a, b in naming.pairs]
    pairs = ([p for p, own in zip(naming.pairs, are_joints, strict=True) if own is k] for k in (True, False))
    both = zip(lists, pairs, strict=True)
    joints, others = (replace(naming, items=tuple(i), pairs=tuple(p)) for i, p in both)
    return joints, others


def _item(text: str, whole: str) -> NamedUnit:
    """A name with its brackets: [unit], [row] or [unit|column]."""
    found = _ITEM.fullmatch(text)
    tokens = [token.strip() for token in found[2].split("|")] if found and found[2] is not None else []
    units = [token for token in tokens if token.lower() not in _SIDES]
    if found is None or len(units) > 1 or re.search(r"…|\.\.", found[1]):
        forms = "name[unit] or name[unit|column], nor '…' between numbered names, as in q1[deg],…,q6[deg]"
        raise OptionError(f"columns='{whole}': '{text.strip()}' is not of the form {forms}")
    sides = [_SIDES[token.lower()] for token in tokens if token.lower() in _SIDES]
    return NamedUnit(found[1], *(units or [None]), *sides[:1])


def group_keys(name: str) -> tuple[str, ...] | None:
    """The columns that a group name stands for; None for any other name."""
    if marker := re.fullmatch(r"(?:m|marker)_?(\d+)", name.lower()):
        return tuple(f"m{marker[1]}{axis}" for axis in "xyz")
    return GROUPS.get(name.lower())


def headings_in_order(naming: Naming, width: int) -> tuple[str, ...]:
    """Headings of all columns, with groups written out; a lone 'q[deg]' takes the columns that are left."""
    keys = [group_keys(item.name) or (item.name,) for item in naming.items]
    joints = [k for k, item in enumerate(naming.items) if item.name == "q"]
    free = width - sum(map(len, keys)) + len(joints)
    if len(joints) == 1:
        keys[joints[0]] = tuple(f"q{i}" for i in range(1, free + 1))
    headings = [item.heading(k) for item, own in zip(naming.items, keys, strict=True) for k in own]
    if len(headings) != width or not all(keys):
        wanted = f"where the file has {width}: name each in order, '-' for one to leave out"
        raise OptionError(f"columns='{naming.text}' names {len(headings)} columns {wanted}")
    return tuple(headings)
