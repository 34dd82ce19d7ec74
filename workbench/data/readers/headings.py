"""Meanings of headings: our own names, and synonyms used by controllers and people.

A key is the name of formats.md ('q1', 'x', 'qw', 'm2y', 'tilt_x3', …); those with one value a row or a joint
stand in the table of columns. A heading of another spelling is recognised only where it can't mean anything
else; commanded values are never taken for measured ones, but for joints where no others are.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from itertools import product

import numpy as np
from jaxtyping import Float

from workbench.base.columns import Column, Per
from workbench.base.errors import UnitError
from workbench.base.types import frozen
from workbench.base.units import Quantity, conversion, parse_heading
from workbench.data.observation import known_columns
from workbench.data.readers.columns_option import IGNORED, MATRIX

JOINT = (Quantity.ANGLE, Quantity.LENGTH)
PIXEL_LABELS = ("image", "camera", "id", "corner")

UR_JOINTS = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
_JOINT_TEXT = "q|j|jt|posj|a|ax|joint|axis|achse|gelenk|theta|th|θ|joint_angle|angle|rax|field_position"
_JOINT_TEXT += "|joint(?:_states?)?_pos(?:ition)?|gelenkwinkel|achswinkel|winkel|axe|articulation|eje"
_JOINT_TEXT += "|giunto|asse|关节|관절"
_ROBOTS = "panda|fr3|fer|iiwa|lbr|lbr_iiwa|kuka|robot|arm"
_MEASURED = "pos|position|lage|p|measured|measurement|meas|actual|act|real|ist|mess|messwert|trans"
_MEASURED += "|observed|reached|mean|mittelwert"
_INSTRUMENT = "tracker|laser|leica|lt|faro|mocap|marker"
_COMMAND = "goal|target|cmd|command|commanded|desired|des|nominal|nom|soll|setpoint|ref|reference"
_COMMANDED = re.compile(rf"(^[qj]|^|_)({_COMMAND})\d*(_|$)")
AROUND = re.compile(rf"^(?:(?:{_MEASURED}|{_INSTRUMENT})_)+|(?:_(?:{_MEASURED}|{_INSTRUMENT}))+$")
"""What may stand before and behind a name of what was, not of what should be: by controller or instrument."""
_MEASURED_BY = re.compile(
    rf"(^|_)(measured|measurement|observed|meas|mess|messung|messwert|{_INSTRUMENT})\d*(_|$)"
)
_REACHED = re.compile(r"(^[qj]|^|_)(actual|act|real|ist|reached)\d*(_|$)")
_NO_JOINT = re.compile(rf"(^|_)({_INSTRUMENT}|mean|mittelwert)(_|$)")
CONTROLLER = re.compile(r"(?:^|[\s_./-])(?:tcp|posx|robot|fk|calc|theo|sim|o_t_ee)(?=$|[\s_./([-])", re.I)
"""What stands with places that a controller or a model computes: none was measured."""
COMMAND = re.compile(rf"^(?:{_COMMAND})[\s\-./_]+|[\s\-./_]+(?:{_COMMAND})(?=\s*(?:[\[(]|$))", re.I)
"""What stands with joints as commanded, which count where none were read."""

# (pattern of the normalised name, key). {0}, {1} are the pattern's groups.
_PATTERNS: tuple[tuple[re.Pattern[str], str], ...] = tuple(
    (re.compile(pattern.replace(r"\d+", r"\d{1,9}"), re.ASCII), key)
    for pattern, key in (
        (rf"(?:{_JOINT_TEXT})_?(\d+)(?:pos(?:ition)?)?|joint_a(\d+)", "q{0}"),
        (rf"(?:{_ROBOTS}|state|field)_(?:q|j|joint|axis)_?a?_?(\d+)", "q{0}"),
        (r"(?:q|j|joint|axis)(?:pos)?_?(?:measured|meas|actual|act|ist|mess)_?(\d+)", "q{0}"),
        (r"m?([xyz])_coord(?:inate)?|(?:[tp]|tvec_?)?([xyz])", "{0}"),
        (r"(?:tf_\w+_|field_|pose_|transform_)+(?:position|translation)_([xyz])", "{0}"),
        (r"(?:tf_\w+_|field_|pose_|transform_)+(?:orientation|rotation)_([wxyz])", "q{0}"),
        (r"(roll|pitch|yaw|nick|gier)(?:_?(?:winkel|angle))?", "{0}"),
        (r"zxz_(phi|theta|psi)", "zxz_{0}"),
        (r"(?:q|(?:q|quat|quaternion|orientation)_|quat)([wxyz])", "q{0}"),
        (r"(?:r|(?:rot_?vec|rotation_vector|rv|rvec)_?)([xyz])", "r{0}"),
        (r"r_?([123])_?([123])", "r{0}{1}"),
        (r"(?:smr|reflector|prism|target)(?:_name)?|collection::group::name|sitz|kegel", "point"),
        (r"(?:m|marker|smr|reflector|prism|led|ball)_?(\d+)_?([xyz])", "m{0}{1}"),
        (r"(?:sigma|std)_?(x|y|z|rx|ry|rz|roll|pitch|yaw)", "sigma_{0}"),
        (r"tilt_?([xy])_?(\d+)", "tilt_{0}{1}"),
        (r"datum_uhrzeit|date_time", "time"),
        (r"(force|moment)_([xyz])", "{0}_{1}"),
    )
)
_UR = {name: f"q{i}" for i, name in enumerate(UR_JOINTS, 1)}
_LOGGED = re.compile(r"^(\w+_)?joint(_states?|_positions?|s)_|(_joint)?(_pos(ition)?)?$")
"""What logs have around a joint's name."""
_ANGLES = {"sigma_roll": "sigma_rx", "sigma_pitch": "sigma_ry", "sigma_yaw": "sigma_rz"}
_ANGLES |= {"nick": "pitch", "gier": "yaw"}
_MATRIX = [f"r{i}{j}" if j < 4 else "xyz"[i - 1] for i in (1, 2, 3) for j in (1, 2, 3, 4)]
"""A pose row by row, without its last row."""
_OBSERVED = re.compile(r"(sigma_)?(r?[xyz]|roll|pitch|yaw)|q[wxyz]|r\d\d|zxz_\w+|m\d+[xyz]|tilt_\w+")
_NOT_MEASURED = re.compile(r"time|payload|temperature|torque\d+|session|group|exclude")
_ENTRY = re.compile(r"(\w*?[a-z])_?(\d)(?:_?(\d))?", re.ASCII)
_TURNS = {3: (), 6: ("rx", "ry", "rz"), 7: ("qx", "qy", "qz", "qw")}
"""Orientations of a place and that in so many numbers; the rows tell which these are."""
_NUMBERED = [[f"{i}{j}" for i, j in product(digits, repeat=2)] for digits in ("1234", "0123")]
_NUMBERED += [[str(k) for k in range(first, first + 16)] for first in (0, 1)]
_SIX, _QUATERNION = [f"q{i}" for i in range(1, 7)], ("qw", "qx", "qy", "qz")
_TOGETHER: tuple[tuple[Sequence[str], Sequence[str]], ...] = (
    (("w", "p", "r"), ("roll", "pitch", "yaw")),
    *(([f"{a}{end}" for a in "abc"], ("yaw", "pitch", "roll")) for end in ("", "_act", "_ist")),
    (("u", "v", "w"), ("yaw", "pitch", "roll")),
    ([f"{kind}{a}1" for kind in ("", "phi") for a in "xyz"], ("x", "y", "z", "roll", "pitch", "yaw")),
    (("s", "l", "u", "r", "b", "t"), _SIX),
    (("q0", "qx", "qy", "qz"), _QUATERNION),
    *(([f"{a}{end}" for a in "xyz"], "xyz") for end in ("m", "meas", "act", "ist")),
    *((["base", "shoulder", "elbow", *(f"wrist{mark}{i}" for i in "123")], _SIX) for mark in ("_", "")),
    ([f"{c}{r}" for r in "xyz" for c in "noap"], _MATRIX),
    *(([f"{r}{i}{j}" for i in "012" for j in "012"], MATRIX) for r in ("r", "r_", "rot")),
)
"""Headings that mean something together: angles, poses, joints, quaternions and axes of several makers."""
COUNTERS = {"#", "id", "idx", "index", "no", "nr", "num", "number", "nummer", "row", "n°", "nº", "№"}
"""Columns that count rows in the file's own way."""
SQUARE_ERROR = 0.04
"""By how much squares of a quaternion's numbers may miss the sum of 1, by rounding."""
_GROUPED = re.compile(
    r"[-+]?\d{1,3}(([ '’\u202f])\d{3}(\2\d{3})*([.,]\d*)?|([.,])\d{3}(\5\d{3})*(?!\5)[.,]\d+)"
)
_SEXAGESIMAL = re.compile(r"([-+]?)(\d+)°\s*(\d+)['′’]\s*(\d+\.?\d*)(?:[\"″”]|'')")
_UNIT_ENDING = re.compile(
    r"(.+?)[_ /](?:(mm|cm|um|µm|m|in|deg|derece|°|rad|mrad|degC|°C|K|s|ms|kg|Nm)|(mm|deg|rad)([_ ][xyz]))"
)
_POINTS = ["{a}{k}", "{a}_{k}", "p{k}{a}", *(f"{p}{{k}}_{{a}}" for p in ("p", "p_", "pt", "point", "point_"))]
"""How points of the tool are counted: x1, x_1, p1x, P1.X, pt_1_x …"""


def normalised(name: str) -> str:
    """Lower case, with one underscore for blanks, hyphens, dots and humps: 'Achse 1' gives 'achse_1'."""
    return re.sub(r"[\s\-./_()]+|(?<=[a-z]{2})(?=[A-Z])", "_", name.strip()).strip("_").lower()


def joint_name(name: str) -> str:
    """A joint's name as it is compared: 'shoulder' and '/joint_states/shoulder_joint/position' are one."""
    return _LOGGED.sub("", normalised(name))


def meaning(name: str) -> str | None:
    """Key of what a column of this name (without its unit) holds, or None."""
    return _meaning(name, tuple(known_columns().values()))


@lru_cache(maxsize=1000)
def _meaning(name: str, table: tuple[Column, ...]) -> str | None:
    plain = normalised(name)
    if name.strip() != "T":  # T may be time, temperature or torque
        if (named := _UR.get(joint_name(plain))) is not None:
            return named
        numbered = re.fullmatch(r"(.+?)_?(\d{1,9})", plain, re.ASCII)
        for column in table:
            names = (column.name, *column.also)
            if column.per is Per.ROW and not {plain, plain.replace("_", "")}.isdisjoint(names):  # TimeStamp
                return column.name
            is_numbered = column.per is Per.JOINT or (column.observed and column.quantity)  # distance1 …
            if is_numbered and numbered is not None and numbered[1] in names:
                return column.name + (numbered[2].lstrip("0") or "0")
    is_around = False if _NO_JOINT.search(plain) else None
    owned = {joint_name(plain): True, AROUND.sub("", plain): is_around, plain: None}
    for (pattern, template), (own, is_joint) in product(_PATTERNS, owned.items()):
        if match := pattern.fullmatch(own):
            groups = (group.lstrip("0") or "0" for group in match.groups() if group is not None)
            key = template.format(*groups)
            if is_joint in (None, re.fullmatch(r"q\d+", key) is not None):
                return _ANGLES.get(key, key)
    return None


def known_together(columns: Mapping[str, Sequence[str]]) -> dict[str, str]:
    """Keys of names that mean something only together, by the cells under each normalised name.

    Four columns, numbered or a … d, whose squares sum to 1 in every row are a quaternion, as of ABB or Leica.
    """
    there, found = set(columns), dict[str, str]()
    for group, keys in (*_TOGETHER, *_poses(columns)):
        if there.issuperset(group) and not (there - set(group)) & set(keys):
            found |= zip(group, keys, strict=True)
    if {"fx", "fy", "fz"} <= there:  # torques beside forces, not a place
        found |= dict.fromkeys(("tx", "ty", "tz"), IGNORED)
    for form in () if {"x", "m1x"} & {*map(meaning, there)} else _POINTS:  # points of the tool
        count = next(k for k in range(len(there) + 1) if form.format(a="x", k=k + 1) not in there)
        points = {form.format(a=a, k=k + 1): f"m{k + 1}{a}" for k in range(count) for a in "xyz"}
        if points.keys() <= there and count != 2:  # a controller's point and an instrument's
            found |= points if count > 1 else dict(zip(points, "xyz", strict=False))
    numbered = ([f"{stem}{k}" for k in range(n, n + 5)] for stem, n in product(("q", "rot_q"), (0, 1)))
    for *four, fifth in (*numbered, "abcde"):
        if fifth not in there and there.issuperset(four):
            sums = np.sum([numbers_in(tuple(columns[name])) ** 2 for name in four], axis=0)
            off = abs(sums[sums > 0.0] - 1.0) < SQUARE_ERROR  # zeros: it wasn't seen
            found |= zip(four, _QUATERNION, strict=True) if off.sum() > 0.9 * len(off) else ()
    return found


def number_in(cell: str) -> float:
    """The number in a cell, its thousands grouped where that leaves no doubt; NaN where there is none."""
    cell = f"-{cell[:-1]}" if cell.endswith("-") else cell  # as SAP writes it
    with suppress(ValueError):
        return float("" if "_" in cell else cell)
    text = re.sub(r"(?<=\d)[dD](?=[-+]\d)", "e", cell.replace("\u2212", "-").replace("\u00a0", " ").strip())
    if _GROUPED.fullmatch(text):
        text = re.sub(r"[.,](?=.*[.,])", "", re.sub(r"[^\d.,+-]", "", text)).replace(",", ".")
    if degrees := _SEXAGESIMAL.fullmatch(text):
        return float(f"{degrees[1]}1") * sum(float(v) / 60.0**k for k, v in enumerate(degrees.groups()[1:]))
    with suppress(ValueError):
        return float("" if "_" in text else text)
    return float("nan")


@lru_cache(maxsize=200)
def numbers_in(cells: tuple[str, ...]) -> Float[np.ndarray, " rows"]:
    """The number in each cell; NaN where there is none."""
    return frozen(np.array([number_in(cell) for cell in cells], float))


def _poses(columns: Mapping[str, Sequence[str]]) -> Iterator[tuple[list[str], Sequence[str]]]:
    """Names of numbers of poses, tcp_pose_0 … 6, t11 … t34 or t0 … t15, and their keys.

    The last row of a matrix tells entries by columns; numbered ones must have it. Numbers of `position` or
    `tcp` are a pose where joints stand beside it, and nothing that was measured.
    """
    others = {key for name in columns if (key := meaning(name)) and not _NOT_MEASURED.fullmatch(key)}
    beside_joints = bool(others) and all(re.fullmatch(r"q\d+", key) for key in others)
    stems, constant = dict[str, dict[str, str]](), dict[str, float]()
    for name, cells in columns.items():
        if cells and all(map(cells[0].__eq__, cells)):
            constant[name] = number_in(cells[0])
        if (entry := _ENTRY.fullmatch(name)) is not None and meaning(name) is None:
            stems.setdefault(entry[1], {})[entry[2] + (entry[3] or "")] = name
    for (stem, own), numbers in product(stems.items(), _NUMBERED):
        rows, count = [own.get(number, "") for number in numbers], len(own)
        for entries in (rows, [rows[k // 4 + 4 * (k % 4)] for k in range(16)]):
            if all(entries) and [constant.get(name) for name in entries[12:]] == [0.0, 0.0, 0.0, 1.0]:
                yield entries[:12], _MATRIX
                break
        if stem in ("t", "m", "h") and all(rows[:12]) and not any(rows[12:]):
            yield rows[:12], _MATRIX
        is_pose = stem.endswith(("pose", "posx")) or (stem in ("position", "tcp") and beside_joints)
        if is_pose and count in _TURNS and set(own) == set(numbers[:count]) and (count > 3 or stem == "tcp"):
            yield rows[:count], (*"xyz", *_TURNS[count])


def _says(words: re.Pattern[str]) -> Callable[[str], bool]:
    """Whether a heading has one of some words, its unit aside."""
    return lambda name: bool(words.search(normalised(parse_heading(name).name)))


is_commanded = _says(_COMMANDED)
"""Whether a heading speaks of a goal, not of a measurement."""
is_of_measurement = _says(_MEASURED_BY)
"""Whether it says that it was measured, or by which instrument."""
is_reached = _says(_REACHED)
"""Whether it says that it was reached, not commanded."""
_QUANTITIES = (
    (r"q\d+", JOINT),
    (r"(sigma_)?[xyz]|m\d+[xyz]|distance\d+", (Quantity.LENGTH,)),
    (r"roll|pitch|yaw|zxz_(phi|theta|psi)|(sigma_)?r[xyz]|tilt_[xy]\d+", (Quantity.ANGLE,)),
    (r"moment_.*", (Quantity.TORQUE,)),
    (r"force_.*", (Quantity.FORCE,)),
)


def column_of(key: str) -> Column | None:
    """The entry of the table that a column of this name belongs to."""
    table = known_columns()
    of_joints = table.get(key.rstrip("0123456789"))
    return of_joints if of_joints is not None and of_joints.per is Per.JOINT else table.get(key)


def is_observed(key: str) -> bool:
    """Whether a column of this name is of what was observed, or of its scatter."""
    column = column_of(key)
    return bool(_OBSERVED.fullmatch(key)) if column is None else column.observed


def quantities_of(key: str) -> tuple[Quantity, ...]:
    """What the column measures; empty for labels."""
    if (column := column_of(key)) is not None:
        return () if column.quantity is None else (column.quantity,)
    return next((found for pattern, found in _QUANTITIES if re.fullmatch(pattern, key)), (Quantity.NUMBER,))


def unit_apart(text: str) -> tuple[str, str | None]:
    """Name and unit of any heading, 'Length [mm]', 'Length_mm' or 'measured_mm_x'."""
    name, unit = parse_heading(text)
    if unit is None and (match := _UNIT_ENDING.fullmatch(name)):
        return match[1] + (match[4] or ""), match[2] or match[3]
    return name, unit


def split_ending(name: str, key: str | None = None) -> tuple[str, str] | None:
    """Name and unit of 'x_mm' or 'q1 deg', where the unit suits what the name, or `key`, means."""
    bare, unit = unit_apart(name)
    return (bare, unit) if unit and bare != name and suits(unit, key or meaning(bare) or "group") else None


def suits(unit: str, key: str) -> bool:
    """Whether a column of this name may have the unit."""
    with suppress(UnitError):
        return bool(conversion(unit, *quantities_of(key) or (Quantity.NUMBER,)))
    return False


def meaning_of(heading: str) -> str | None:
    """Key of what a heading, with or without its unit, names."""
    split = split_ending(heading)
    return meaning(parse_heading(heading).name) or (None if split is None else meaning(split[0]))
