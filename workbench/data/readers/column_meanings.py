"""The meaning of each column of a table, and problems that prevent its use."""

import math
import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import combinations

import numpy as np
from jaxtyping import Float

from workbench.base.columns import Per
from workbench.base.errors import UnitError, WorkbenchError
from workbench.base.hand_eye import nearest_rotation
from workbench.base.remedy import remedy
from workbench.base.units import EXAMPLES, REMARKS, Conversion, Quantity, conversion, parse_heading
from workbench.base.wording import listed, span
from workbench.data.observation import known_columns
from workbench.data.readers import headings
from workbench.data.readers.columns_option import IGNORED, NamedUnit
from workbench.data.readers.headings import (
    is_commanded,
    meaning,
    normalised,
    numbers_in,
    quantities_of,
    suits,
)
from workbench.data.readers.table import NUMBER, Table

CHOOSE_ON_PAGE = "choose its meaning in the Measure tab, under 'Columns of the file'"
_TOLD_BY_ROWS = re.compile(r"q\d+|[xyz]|roll|pitch|yaw|r[xyz]|m\d+[xyz]")
"""Columns whose unit rows of a known arm tell."""
NOT_NEEDED = re.compile(r"time|payload|temperature|(torque|distance)\d+")
"""Columns that no row needs: with no unit, or one that another meaning has, they are left out."""
TOO_LARGE = {"deg": 2.0 * math.pi, "mm": 20.0}
"""Units that are likeliest where numbers are larger than the others would have them."""
COMPUTED = "these poses are the controller's own, not measured: 'workbench extract' finds its model"
_FRACTION = re.compile(r"(:\d\d:\d\d)(?:[.,](\d{1,5})\d*)?( ?[AP]M)?$", re.IGNORECASE)
_DAYS = ("%d.%m.%Y ", "%m/%d/%Y ", "%d/%m/%Y ", "%Y/%m/%d ")
_TIMES = ("%H:%M:%S.%f", "%H:%M", "%I:%M:%S.%f %p")
_DATES = ("", *(day + time for day in _DAYS for time in _TIMES), _TIMES[0], _TIMES[2])
"""Forms of dates: ISO, and those of controllers and spreadsheets; last times of an unknown day."""
NO_DAY = 1900
"""Year of times of an unknown day."""
UNIX = (1.2e9, 2.1e9)
"""Times since 1970 of which we know that they are, from 2008 to 2036 [s]."""
LONGEST = 110
"""Characters of an advice, which would else be cut."""
MIN_ANCHORED = 3
"""Rows of each anchor, on the mean."""
MIN_ROWS, COMPARED, ALIKE, NEAR = 6, 200, 0.25, 0.05
"""Rows compared, and shares of their spread by which places of one motion, and joints, may differ."""
_REFERENCE = re.compile(r"(^|_)(ref|reference)\d*(_|$)")
"""A goal, or, beside what isn't said to be reached, what an instrument measured."""
_RATE = re.compile(
    r"(^|_)([qj]_?d+_?\d|d[qj]_?\d|(current|speed|velocity|acceleration|force|previous|last)s?(_|$|\d))"
)
"""Names of joints' velocities, or of where they should be, and of what is neither a joint nor a place."""
_ELSEWHERE = re.compile(r"(^|_)([cg]pu|controller|control_box|cabinet|steuerung|schaltschrank)(_|$)")
"""Where temperatures are that tell nothing of the arm's."""
_DEVIATION = re.compile(r"(d|delta|dev\w*|diff?|err\w*)_?[xyz]|[xyz]_?(delta|dev\w*|diff?|err\w*)")


def dates_in(cells: Sequence[str]) -> list[tuple[Float[np.ndarray, " rows"], datetime]]:
    """Seconds from the first of some dates of one form, and that date; none if they aren't dates of one form.

    Two where day and month may stand in either order and the times between them differ.
    """
    found = dict[tuple[float, ...], datetime]()
    for form in _DATES if cells else ():
        with suppress(ValueError, TypeError):  # no date, or with a time zone where the first has none
            iso = not form and not any(map(str.isdigit, cells))
            plain = (cell if iso else _FRACTION.sub(r"\1.\g<2>0\3", cell) for cell in cells)
            dates = [datetime.fromisoformat(cell) if iso else datetime.strptime(cell, form) for cell in plain]
            found.setdefault(tuple((date - dates[0]).total_seconds() for date in dates), dates[0])
    return [(np.array(times), began) for times, began in found.items()]


@dataclass(frozen=True, kw_only=True)
class TableColumn:
    """One column of a table, as understood.

    Args:
        index: Place in the table, from 0.
        heading: Text of the file.
        key: Its name in formats.md; None: left out.
        unit: Unit of the file; None for labels and plain numbers, and where it is missing.
        conversion: To SI; None for labels, dates and columns that are left out.
        remark: A decision to be said; empty if there is none.
        problem: Why it can't be read.
        missing_unit: What is wrong where it has no unit; one that the rows may tell is converted from the
            likeliest until then.
        si: Our unit; None where the file's is missing or there is none.
        cells: What stands in it, as text.
    """

    index: int
    heading: str
    key: str | None = None
    unit: str | None = None
    conversion: Conversion | None = None
    remark: str = ""
    problem: WorkbenchError | None = None
    missing_unit: str = ""
    si: str | None = None
    cells: tuple[str, ...] = ()


def interpret_columns(table: Table) -> tuple[TableColumn, ...]:
    """What each column of a table holds; problems are kept in the columns, not raised."""
    names = [normalised(parse_heading(text).name) for text in table.names]
    together = headings.known_together(dict(zip(names, table.columns, strict=True)))
    columns = [_column(table, index, together.get(name)) for index, name in enumerate(names)]
    for index, told in _by_group(table, columns).items():
        columns[index] = _column(table, index, told)
    if not any(c.key and quantities_of(c.key) == headings.JOINT for c in columns):
        left = (names[c.index] for c in columns if c.key is None)
        unread = " ".join(name for name in left if not is_commanded(name))
        taken = set(re.findall(r"\d+", unread))  # numbers of joints that another column may have read
        bare = replace(table, names=tuple(headings.COMMAND.sub("", text) for text in table.names))
        for i in filter(lambda i: is_commanded(names[i]), range(len(names))):
            key = (second := _column(bare, i, None)).key
            if key and quantities_of(key) == headings.JOINT and key[1:] not in taken:
                columns[i] = replace(second, remark=f"'{second.heading}' is read as {key}, as commanded")
    columns = [_with_unit(column, table, columns) for column in columns]
    of_joints = ["q", *(c.name for c in known_columns().values() if c.per is Per.JOINT)]
    from_zero = {name for name in of_joints if any(c.key == f"{name}0" for c in columns)}
    seen: dict[str, TableColumn] = {}
    for i, column in enumerate(columns):
        counted = re.fullmatch(r"(\D+)(\d+)", column.key or "")
        if counted is not None and counted[1] in from_zero:
            key = f"{counted[1]}{int(counted[2]) + 1}"
            remark = f"'{column.heading}' is read as {key}, as the file counts joints from 0"
            column = columns[i] = replace(column, key=key, remark=remark)
        if column.key is not None and (other := seen.setdefault(column.key, column)) is not column:
            numbers = [c for c in (column, other) if re.search(r"\d", "".join(table.columns[c.index]))]
            if len(numbers) == 2:
                is_joint = quantities_of(column.key) == headings.JOINT  # reached, beside commanded ones
                reached = [c for c in numbers if is_joint and headings.is_reached(c.heading)]
                measured = [c for c in numbers if headings.is_of_measurement(c.heading)]
                known = [c.conversion.to_si(_numbers(table, [c.index])) for c in numbers if c.conversion]
                are_two = column.unit != other.unit and len(known) == 2  # of one joint, in deg and in rad
                is_same = are_two and np.allclose(known[0], known[1], atol=1e-5, equal_nan=True)
                weighed = [c for c in numbers if c.unit != "N"]  # of a load by its weight, too, its mass
                numbers = [other] if is_same else measured or reached or weighed
            if len(numbers) == 1:  # the other holds words, or nothing measured
                seen[column.key] = numbers[0]
                worse = column if numbers[0] is other else other
                columns[worse.index] = _column(table, worse.index, IGNORED)
                continue
            both = f"columns {other.index + 1} and {i + 1} ('{other.heading}', '{column.heading}')"
            shown = [parse_heading(c.heading).name for c in columns]
            option = f"leave one set out, columns='{shown[i]}=-' (--columns), and so on"
            can_tell = table.has_option and shown.count(shown[i]) == 1
            how = f", or {remedy(option, page=CHOOSE_ON_PAGE)}" if can_tell else ""
            text = f"{both} both mean {column.key}: remove or rename one{how}"
            columns[i] = replace(column, problem=table.error(text, i))
    return tuple(columns)


def _by_group(table: Table, columns: Sequence[TableColumn]) -> dict[int, str]:
    """Keys of columns whose names aren't known, in whatever language, by their units and each other: angles
    that are counted are joints, three lengths that differ in x, y, z a place, three such or more points of
    the tool, a lone one is a distance, from the anchors that a lone column of words names; a lone temperature
    is the arm's, a lone column of seconds or of a clock that goes on is the time."""
    found, counted = dict[int, str](), defaultdict[str, dict[int, int]](dict)
    lengths, words, keys = dict[int, str](), list[int](), [c.key for c in columns if c.key]
    lone = {"temperature": list[int](), "time": list[int]()}
    for c in (c for c in columns if c.key is None and not c.remark):
        name, unit = headings.unit_apart(table.names[c.index])
        number = re.fullmatch(r"(.*\D)(\d{1,2})", normalised(name))
        clock = dates_in(c.cells) if ":" in "".join(c.cells[:1]) else []
        times = [numbers_in(c.cells)] if unit and suits(unit, "time") else [own for own, _ in clock]
        if any((np.diff(own) >= 0.0).all() and own[-1] > own[0] for own in times):
            lone["time"].append(c.index)
        elif name != IGNORED and not any(map(NUMBER.fullmatch, c.cells)):
            words += [c.index] if MIN_ANCHORED * len({*c.cells}) <= len(c.cells) else []
        elif unit and suits(unit, "x") and not _DEVIATION.fullmatch(normalised(name)):
            lengths[c.index] = name
        elif unit and suits(unit, "q1") and number:
            counted[number[1]][int(number[2])] = c.index
        elif unit and suits(unit, "temperature") and not _ELSEWHERE.search(normalised(name)):
            lone["temperature"].append(c.index)
    runs = [own for own in counted.values() if len(own) > 3 and max(own) - min(own) + 1 == len(own)]
    if len(runs) == 1 and "q1" not in keys:
        found = {index: f"q{k - min(runs[0]) + 1}" for k, index in runs[0].items()}
    found |= {at[0]: key for key, at in lone.items() if len(at) == 1 and key not in keys}
    if any(map(headings.is_observed, keys)):
        return found
    if len(sets := _triples(lengths, has_actual=False)) == 1:
        return found | dict(zip(sets[0], "xyz", strict=True))
    parts = zip(*(re.split(r"[_\s]", normalised(lengths[own[0]])) for own in sets), strict=False)
    told = [own for own in parts if len({*own}) > 1]  # points that one letter or number tells apart
    is_lettered = [len({*own}) for own in told] == [len(sets)] and max(map(len, told[0])) == 1
    if len(sets) > 2 and is_lettered and _are_one_body([_numbers(table, own) for own in sets]):
        points = enumerate(sets, 1)
        return found | {k: f"m{n}{a}" for n, own in points for k, a in zip(own, "xyz", strict=True)}
    is_alone = (len(lengths), len(words)) == (1, 1) and "time" not in keys
    if is_alone and not (numbers_in(columns[alone := min(lengths)].cells) <= 0.0).any():
        found |= {alone: "distance", words[0]: "anchor"}
    return found


def _column(table: Table, index: int, key: str | None) -> TableColumn:
    """One column by its name and unit, or its unit ending ('x_mm'); `key` is what it means beside others."""
    text, (name, unit), remark = table.headings[index], parse_heading(table.names[index]), ""
    column = TableColumn(index=index, heading=text, cells=tuple(table.columns[index]))
    if IGNORED in (name, key):
        return column
    split = headings.split_ending(name, key) if key or meaning(name) is None else None
    if split is not None and unit in (None, split[1]):
        (name, unit), remark = split, "" if key else f"the unit of '{text}' is taken from its name"
    if key is None or not (unit is None or suits(unit, key)):
        key = meaning(name)
    if key in ("u", "v") and unit not in (None, "px"):  # an angle of a theodolite, not a pixel
        return column
    if is_commanded(name) and any(map(NUMBER.fullmatch, table.columns[index])):
        return replace(column, remark=f"'{text}' is a commanded value, not a measurement, and is left out")
    if key is not None and key != normalised(name) and not remark:
        computed = headings.CONTROLLER.search(name) and quantities_of(key) != headings.JOINT
        remark = COMPUTED if computed else f"'{text}' is read as {key}"
    return column if key is None else replace(column, key=key, unit=unit, remark=remark)


def _with_unit(column: TableColumn, table: Table, columns: list[TableColumn]) -> TableColumn:
    """The column with its conversion to SI, or with the problem that it has none."""
    if (key := column.key) is None or not (quantities := quantities_of(key)):
        return column
    if key == "time" and dates_in(table.columns[column.index][:1]):
        how = "holds dates, read as seconds from the first row"
        if doubt := _doubt_of_dates(table, column.index):
            how = f"is left out, as its {doubt}; write 2024-03-25 16:39:04"
        return replace(column, key=None if doubt else "time", unit=None, remark=f"'{column.heading}' {how}")
    if key == "time" and column.unit is None:
        largest = np.fmax.reduce(numbers_in(column.cells), initial=0.0)
        for k, unit in enumerate(("s", "ms", "us", "ns")):
            if UNIX[0] < largest / 1e3**k < UNIX[1]:
                how = f"'{column.heading}' is read in {unit} since 1970"
                return replace(column, unit=unit, conversion=conversion(unit, *quantities), remark=how)
    if column.unit is None and quantities[0] is not Quantity.NUMBER:
        wanted = EXAMPLES[quantities[0]]
        has_place = key == "distance" and any(c.key == "x" for c in columns)
        if has_place or NOT_NEEDED.fullmatch(key):
            remark = f"'{column.heading}' has no unit and is left out; write '{column.heading}[{wanted}]'"
            return replace(column, key=None, remark=remark)
        offered = wanted.split(" or ")
        alike = (c.index for c in columns if c.key and quantities_of(c.key) == quantities)
        largest = max(np.fmax.reduce(abs(numbers_in(table.columns[k])), initial=0.0) for k in alike)
        too_large = (unit for unit, bound in TOO_LARGE.items() if unit in offered and largest > bound)
        first = next(too_large, offered[0])
        option = f"give columns='{key}[{first}]={column.heading}' (--columns)"
        header = f"write '{column.heading}[{first}]' in the header ({wanted}, whichever applies)"
        more = f", or {remedy(option, page=CHOOSE_ON_PAGE)}" if table.has_option else ""
        missing = table.error(f"the unit is missing: {header}{more}", column.index)
        column, is_told = replace(column, missing_unit=str(missing)), _TOLD_BY_ROWS.fullmatch(key)
        return replace(column, unit=first, conversion=conversion(first, *quantities)) if is_told else column
    try:
        found = conversion(column.unit or "", *quantities)
    except UnitError as error:
        if NOT_NEEDED.fullmatch(key) and key != normalised(parse_heading(column.heading).name):
            return TableColumn(index=column.index, heading=column.heading)
        problem = UnitError(str(table.error(str(error), column.index)), unit=column.unit or "")
        return replace(column, problem=problem)
    is_load = normalised(parse_heading(table.names[column.index]).name) == "load"
    if is_load and suits(column.unit or "", "force_x") and _is_gauge(column.cells):
        remark = f"'{column.heading}' changes as a force gauge does, not as a payload, and is left out"
        return replace(column, key=None, remark=remark)
    remarks = filter(None, (column.remark, REMARKS.get(column.unit or "")))
    si = column.unit and str(found.quantity)
    return replace(column, conversion=found, remark="; ".join(remarks), si=si)


def _is_gauge(cells: tuple[str, ...]) -> bool:
    """Whether forces change from row to row, up and down, or pull and push, as no load does."""
    way, is_new = np.diff(numbers := numbers_in(cells)), len({*cells}) > max(MIN_ROWS, len(cells) / 2)
    return bool((numbers < 0.0).any() or (is_new and (way < 0.0).any() and (way > 0.0).any()))


def _doubt_of_dates(table: Table, index: int) -> str:
    """Why a column of dates, or of times of a day that nothing tells, isn't read; empty if it is."""
    found = dates_in(cells := table.columns[index])
    if len(found) > 1:
        return "days and months may be exchanged"
    if dates_in(cells[:1])[0][1].year != NO_DAY:
        return ""
    others = (own for own in table.columns if own is not cells and len({*own}) > 1)
    has_days = any(dates_in((own[0], own[-1])) for own in others)
    is_rising = bool(found) and bool((np.diff(found[0][0]) >= 0.0).all())
    return "" if is_rising and not has_days else "times fall, or days stand beside them"


def problems(columns: tuple[TableColumn, ...]) -> list[WorkbenchError]:
    """What stands against reading the columns, whatever the rows tell; missing units are one sentence."""
    lacks = missing_units([c for c in columns if not c.conversion])
    found = [c.problem for c in columns if c.problem]
    return [UnitError(lacks, unit=""), *found] if lacks else found


def missing_units(columns: Sequence[TableColumn]) -> str:
    """What is wrong where columns lack units; empty where none does."""
    found = [c for c in columns if c.missing_unit]
    more = f" (likewise {listed([c.heading for c in found[1:]])})" if found[1:] else ""
    return f"{found[0].missing_unit}{more}" if found else ""


def decisions(columns: tuple[TableColumn, ...]) -> tuple[str, ...]:
    """Everything decided about the columns, in few sentences."""
    plainly = [c for c in columns if re.fullmatch(r"'.*' is read as q\d+", c.remark)]
    renamed = {f"'{c.heading}'": str(c.key) for c in plainly}
    renamed = renamed if len(renamed) > 1 and [*renamed.values()] == sorted(renamed.values()) else {}
    notes = [f"{span([*renamed])} are read as {span([*renamed.values()])}"] if renamed else []
    notes += [c.remark for c in columns if c.remark and f"'{c.heading}'" not in renamed]
    units = defaultdict[str, list[str]](list)
    for column in columns:
        to = column.conversion.quantity if column.conversion and column.unit else Quantity.NUMBER
        if to not in (Quantity.NUMBER, column.unit):
            units[f"{column.unit} converted to {to}"].append(str(column.key))
    notes += [f"{span(keys)}: {converted}" for converted, keys in units.items()]
    left_out = [c.heading or "(no heading)" for c in columns if c.key is None and not c.remark]
    return (*dict.fromkeys(notes), *((f"columns left out: {listed(left_out)}",) if left_out else ()))


def unread_text(columns: Mapping, key: str, lacks: int = 0, read: Sequence = (), at: Sequence = ()) -> str:
    """Columns that are left out, by heading, and how to say what they are, from `key` on; empty without any.

    Of joints so many are lacking (0: not known), those under the headings `read` are there, and a lone one
    that is left out may stand in the places `at` among them.
    """
    numbers = (n for n, own in columns.items() if any(map(NUMBER.fullmatch, own)))
    unread = [name for name in numbers if headings.meaning_of(name) != "time"]
    of_place = unread if key == "x" else []
    long = [n for n in of_place if len(columns[n]) > MIN_ROWS]  # states, times step one way
    signs = {n: {*np.sign(np.diff(numbers_in(tuple(columns[n])))).tolist()} for n in long}
    varied = [n for n in unread if not (_RATE.search(normalised(n)) or len(signs.get(n, "")) == 1)]
    kind, units = "roll" if read and not at else key, {n: headings.unit_apart(n)[1] for n in varied}
    fitting = [n for n, unit in units.items() if unit is None or suits(unit, kind)]
    measured = [n for n in fitting if units[n]]  # a number without a unit may count rows
    fitting = measured if key != "x" and len(measured) >= max(lacks, 1) else fitting
    computed = [n for n in of_place if headings.CONTROLLER.search(n) and not headings.is_of_measurement(n)]
    likely = sorted(fitting, key=lambda n: n in computed or is_commanded(n))
    bare = {normalised(parse_heading(n).name): n for n in of_place if not is_commanded(n)}
    told = headings.known_together({n: columns[h] for n, h in bare.items()}).items()
    places, left_out = {k: bare[n] for n, k in told}, listed(unread, longest=3)
    likely = [places[axis] for axis in "xyz"] if {*"xyz"} <= places.keys() else likely
    digits = {re.sub(r"\D", "", headings.unit_apart(n)[0]): n for n in likely[::-1]}
    counted = [digits[str(k)] for k in range(1, (lacks or len(likely)) + 1) if str(k) in digits]
    if len(likely) < (lacks or 1):
        words = [n for n, own in columns.items() if n not in unread and 1 < len({*own}) <= len(own) / 2]
        if key == "x" and not varied and words:
            how = remedy(f" with columns='contact={words[0]}' (--columns)", page=f": {CHOOSE_ON_PAGE}")
            return f"; if '{words[0]}' names what was touched, say so{how}"
        are = "no lengths" if key == "x" else "in other units"
        return f"; the columns left out ({left_out}) are {are}" if varied and not likely else ""
    if off := [name for plain, name in bare.items() if _DEVIATION.fullmatch(plain)]:
        return f"; {span(off)} are deviations: write nominal + deviation in columns x[mm], y[mm], z[mm]"
    if key == "x":
        sets = _triples({} if places else dict(enumerate(unread)), has_actual=False)  # as of an instrument
        counted, unit = counted * ("0" not in digits), "[mm]" * (headings.unit_apart(likely[0])[1] is None)
        keys = [f"distance{k}{unit}" for k in range(1, len(counted) + 1)] if len(counted) > 1 else "xyz"
        ways = [[*zip("xyz", (unread[k] for k in own), strict=True)] for own in sets]
        keys = keys if len(likely) > 2 else [f"distance{unit}"]
        ways = ways or [[*zip(keys, counted if len(counted) > 2 else likely, strict=False)]]
    else:
        likely = counted if len(counted) == lacks > 0 and key == "q1" else likely  # whatever their language
        joints = [f"q{k}" for k in range(1, int(key[1:]) + len(likely))]
        at = (at or (len(read), 0)) if read and len(likely) == 1 else (len(read),)  # a rail may be first
        orders = ([*read[:k], *likely[: lacks or None], *read[k:]] for k in at)
        known = {*zip(joints, read, strict=False)}
        ways = [[pair for pair in zip(joints, own, strict=False) if pair not in known] for own in orders]
    says = (",".join(f"{k}={parse_heading(name).name}" for k, name in way) for way in ways)
    options = listed([*says]).replace("', '", "' or '")
    named = f" with columns={options}" * (len(options) < LONGEST)  # a part of them helps nobody
    said = remedy(f"{named} (--columns)", page=f": {CHOOSE_ON_PAGE}")
    if likely[0] in computed:
        return f"; '{likely[0]}' … are the controller's, for 'workbench extract'; if measured, say so{said}"
    return f"; or say what the columns left out are ({left_out}){said}"


def told_twice(table: Table, used: Mapping[str, int], unread: Mapping[int, str]) -> str:
    """What to say where columns left out may be the measured ones instead of those taken; empty if not.

    Where headings tell neither, both follow one motion: joints are alike, places moved, turned and scaled.
    Columns are given by what they hold, and headings of those left out by their number.
    """
    unread = {k: name for k, name in unread.items() if parse_heading(table.names[k]).name != IGNORED}
    joints = [key for key in used if re.fullmatch(r"q\d+", key)]
    for keys, kind in (joints, "joints"), ([key for key in "xyz" if key in used], "places"):
        count, is_place = len(keys), kind == "places"
        pairs = ((key, table.names[used[key]], table.headings[used[key]]) for key in keys)
        unsaid = [key for key, a, b in pairs if parse_heading(a).name == parse_heading(b).name]
        keys = keys if is_place else unsaid
        columns = [used[key] for key in keys]
        taken = [table.headings[k] for k in columns]
        has_actual = any(map(headings.is_reached, taken))
        is_said = any(map(headings.is_of_measurement, taken))
        if not unsaid or count < 3 or is_said or (has_actual and not is_place):
            continue
        sets = _triples(unread, has_actual=has_actual) if is_place else _beside(table, columns, unread)
        marked = (name for name in taken if headings.AROUND.search(normalised(parse_heading(name).name)))
        may_be_nominal = is_place and not any(marked) and not any(map(is_commanded, unread.values()))
        for other in sets:
            own, theirs = _numbers(table, columns), _numbers(table, other)
            names, unit = [table.headings[k] for k in other], parse_heading(taken[0]).unit
            rows = np.isfinite(own).all(1) & np.isfinite(theirs).all(1)
            bare = [parse_heading(name).name for name in names]
            shown = [*zip(keys, bare, strict=True)][: 3 if is_place else 1]
            new = ",".join(f"{NamedUnit(key, unit).heading()}={name}" for key, name in shown)
            how, are = f"columns='{','.join(f'{name}=-' for _, name in shown)}'", "and deviations"
            if may_be_nominal and (theirs[rows] < 0.0).any() and _DEVIATION.fullmatch(normalised(bare[0])):
                how = f"in a file without the deviations, or {how} if {', '.join(taken)} were"
            elif not is_place or (rows.sum() >= MIN_ROWS and _follow_each_other(own[rows], theirs[rows])):
                how, are = f"columns='{new}' or {how}", "of one motion"
            else:
                continue
            how += " (--columns)" if is_place else " (--columns), and so on"
            how = remedy(how, page="in the Measure tab, under 'Columns of the file'")
            both = f"{span(taken)} and {span(names)} are {kind} {are}"
            return f"{table.source}: {both}: say which were measured, {how}"
    return ""


def _beside(table: Table, joints: list[int], unread: Mapping[int, str]) -> list[list[int]]:
    """Of each joint the column that stays nearest to it, where all that move have one that isn't a copy."""
    read = (k for k, h in unread.items() if not (is_commanded(h) or _RATE.search(normalised(h))))
    others = [k for k in read if NUMBER.fullmatch(table.columns[k][0])]
    if len(others) < len(joints):
        return []
    own, theirs = (_numbers(table, columns, COMPARED) for columns in (joints, others))
    off = np.nan_to_num(np.abs(own[:, :, None] - theirs[:, None]).mean(0), nan=np.inf)
    nearest, least = off.argmin(1), off.min(1)
    if len({*nearest.tolist()}) < len(off) or not least.any() or not (least <= NEAR * own.std(0)).all():
        return []
    return [[others[k] for k in nearest]]


def _triples(unread: Mapping[int, str], *, has_actual: bool) -> list[list[int]]:
    """Columns whose headings differ in x, y, z alone, none of a controller."""
    stems = defaultdict[tuple[str, str], dict[str, int]](dict)
    for index, heading in unread.items():
        name = normalised(parse_heading(heading).name)
        bare = name if has_actual else _REFERENCE.sub("_", name)
        if not (is_commanded(bare) or headings.CONTROLLER.search(name)):
            for found in re.finditer("[xyz]", name):
                stems[name[: found.start()], name[found.end() :]].setdefault(found[0], index)
    return [[own[axis] for axis in "xyz"] for own in stems.values() if len(own) == 3]


def _numbers(table: Table, columns: list[int], rows: int | None = None) -> np.ndarray:
    return np.array([numbers_in(table.columns[k])[:rows] for k in columns]).T


def _are_one_body(points: Sequence[np.ndarray]) -> bool:
    """Whether points keep their distances, as those of a tool do: not targets beside places, nor repeats."""
    far = np.array([np.linalg.norm(a - b, axis=1) for a, b in combinations(points, 2)])
    return bool((np.nanstd(far, axis=1) <= NEAR * np.nanmean(far, axis=1)).all())


def _follow_each_other(one: np.ndarray, other: np.ndarray) -> bool:
    one, other = ((p - p.mean(0)) / max(float(np.linalg.norm(p - p.mean(0))), 1e-300) for p in (one, other))
    turn = nearest_rotation(one.T @ other)
    return bool(np.linalg.norm(one @ turn - other) < ALIKE)
