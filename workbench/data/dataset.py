"""The table of measurements that every reader makes and every fit reads.

A `Dataset` is plain SI data: joint positions and what an instrument saw, one row a measurement. Columns
that a file does not have are None; single values that a row lacks are NaN (numbers) or "" (labels).
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field, fields, replace
from functools import cached_property
from itertools import zip_longest
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from jaxtyping import Bool, Float, Int, Shaped

from workbench.base import se3
from workbench.base.arguments import Reads, admit
from workbench.base.array_checks import check_rotations, numbers
from workbench.base.columns import Per
from workbench.base.errors import DataError, OptionError, ShapeError, UnitError
from workbench.base.frames import data_frame
from workbench.base.types import frozen
from workbench.data.observation import AbstractReadings, known_columns
from workbench.data.orientations import WrittenOrientation

if TYPE_CHECKING:
    from pandas import DataFrame


def _labels(value: Any, given: Any) -> np.ndarray:
    """Text in every row; empty where there is none."""
    array = np.asarray(value)
    if array.dtype.kind != "U":
        array = np.array(["" if v is None or v != v else str(v) for v in array.ravel()]).reshape(array.shape)
    return array.astype(str)


def _marks(value: Any, given: Any) -> np.ndarray:
    """True or False in every row, from truth values or from 0 and 1."""
    array = np.asarray(value)
    return array.astype(bool) if array.dtype.kind in "iuf" and np.isin(array, (0, 1)).all() else array


Labels = Annotated[Shaped[np.ndarray, " rows"], Reads("text in every row", _labels)]
Marks = Annotated[Bool[np.ndarray, " rows"], Reads("True or False in every row", _marks)]
PER_JOINT = {"q", "torque", "direction"}
UNSHOWN = {"q", "row", "place", "more", "anchor", "group", "exclude", "reason", "unread", "written"}
"""Columns that are not named where a table is printed."""
SIGMA = ("sigma_x[m]", "sigma_y[m]", "sigma_z[m]", "sigma_rx[rad]", "sigma_ry[rad]", "sigma_rz[rad]")
WRENCH = tuple(f"force_{a}[N]" for a in "xyz") + tuple(f"moment_{a}[N*m]" for a in "xyz")
"""Headings of columns that stand together."""


@dataclass(frozen=True, eq=False, repr=False)
class Dataset:
    """Rows of joint positions and observations, in SI and in the measuring frame.

    Lists are welcome wherever arrays are meant.

    Args:
        q: Joint positions [rad or m], as the controller reported them; never wrapped.
        position: Measured position of the tool point [m]; NaN where a row has none.
        rotation: Measured orientation of the tool, as rotation matrices.
        row: Number of each row for people, from before anything was left out; 0, 1, … if not given.
        counter: Heading of the file's own numbers, which `row` then holds; empty: counted from 0.
        place: Data row of the file, counted from 0; as `row` without a counter.
        markers: Measured positions of the markers on the tool [m]; NaN where one was hidden.
        distance: Measured distance of the tool point from the row's anchor [m].
        anchor: Name of that anchor.
        contact: Name of the fixed point that the tool touched; the same name is the same point.
        point: Name of the socket that the tool was in.
        session: Rows of one placement of robot or instrument; base and tool may differ between sessions.
        group: Rows that are held out together.
        time: Time [s].
        temperature: Temperature [°C].
        payload: Mass at the tool [kg].
        torque: Measured joint torques [N m].
        direction: Sign of each joint's last motion (-1, 0, +1).
        sigma: Standard deviation per row of position (first three, m) and rotation (last three, rad).
        tilt: Inclinometer readings about x and y of a link [rad], by link number counted from 1.
        wrench: [f; τ] that pulls at the tool from outside, in the axes of the robot's gravity [N, N m].
        more: Columns of other packages, by name (`base/columns.py`).
        readings: What an instrument of another package saw.
        unread: Cells of columns that were left out but may tell rows that belong together, by heading.
        written: The file's own numbers of the orientation; None where it is known what they mean.
        exclude: Rows that the file keeps out.
        reason: Why, for such rows.
        source: Where the rows came from, for messages.
        notes: Each decision that the reader took, in one sentence.
        read_as: What the rows were taken to mean where that isn't what their headings say.
        is_of_later: Whether they were measured after all that happened while others were, which then is over.
        joint_units: Unit of each joint's column in the file; empty where nothing says it.
        missing_units: What is wrong where the file lacks units, until the rows tell them.
    """

    q: Float[np.ndarray, "rows n"]
    position: Float[np.ndarray, "rows 3"] | None = None
    rotation: Float[np.ndarray, "rows 3 3"] | None = None
    _: KW_ONLY
    row: Int[np.ndarray, " rows"] = field(default_factory=lambda: np.zeros(0, np.int64))
    counter: str = ""
    place: Int[np.ndarray, " rows"] = field(default_factory=lambda: np.zeros(0, np.int64))
    markers: Float[np.ndarray, "rows markers 3"] | None = None
    distance: Float[np.ndarray, " rows"] | None = None
    anchor: Labels | None = None
    contact: Labels | None = None
    point: Labels | None = None
    session: Labels | None = None
    group: Labels | None = None
    time: Float[np.ndarray, " rows"] | None = None
    temperature: Float[np.ndarray, " rows"] | None = None
    payload: Float[np.ndarray, " rows"] | None = None
    torque: Float[np.ndarray, "rows n"] | None = None
    direction: Float[np.ndarray, "rows n"] | None = None
    sigma: Float[np.ndarray, "rows 6"] | None = None
    tilt: Mapping[int, Float[np.ndarray, "rows 2"]] | None = None
    wrench: Float[np.ndarray, "rows 6"] | None = None
    more: Mapping[str, np.ndarray] = field(default_factory=dict)
    readings: AbstractReadings | None = None
    unread: Mapping[str, np.ndarray] = field(default_factory=dict)
    written: WrittenOrientation | None = None
    exclude: Marks | None = None
    reason: Labels | None = None
    source: str = "data"
    notes: Annotated[
        tuple[str, ...],
        Reads("a list of sentences", lambda value, _: (value,) if isinstance(value, str) else value),
    ] = field(default=())
    read_as: str = ""
    is_of_later: bool = False
    joint_units: tuple[str, ...] = ()
    missing_units: str = ""

    def __post_init__(self):
        admit(self, is_finite=False)
        known = known_columns()
        for name in self.more.keys() - known.keys():
            raise DataError(f"{self.source}: there is no column '{name}'; register it in COLUMNS")
        checked: dict[str, Any] = {"row": self.row if self.row.size else np.arange(len(self))}
        checked["place"] = self.place if self.counter else checked["row"]
        for name, value in (vars(self) | checked).items():
            if isinstance(value, np.ndarray):
                size = (self.joints,) if name in PER_JOINT else value.shape[1:]
                checked[name] = self._sized(name, value, *size)
        checked["tilt"] = {k: self._sized("tilt", v, 2) for k, v in (self.tilt or {}).items()} or None
        checked["more"] = more = {}
        for name, value in self.more.items():
            column = known[name]
            array = _labels(value, {}) if column.is_label else numbers(value, name)
            more[name] = self._sized(name, array, *(self.joints,) * (column.per is Per.JOINT))
        for name, value in checked.items():
            object.__setattr__(self, name, value)
        if self.rotation is not None:
            check_rotations(self.rotation, f"{self.source}: orientations")
        if self.sigma is not None and (self.sigma < 0.0).any():
            row = int(np.argmax((self.sigma < 0.0).any(1)))
            raise DataError(f"{self.source}: 'sigma' is negative in row {row}", row=row, column="sigma")
        unknown = ~np.isfinite(self.q) & self.included[:, None]
        if unknown.any():
            index, joint = np.argwhere(unknown)[0].tolist()
            row = int(self.row[index])
            text = f"{self.source}: joint {joint + 1} has no finite position in row {row}"
            raise DataError(f"{text}; correct the row, or set its 'exclude' to True", row=row, joint=joint)

    def _sized(self, name: str, array: np.ndarray, *size: int) -> np.ndarray:
        """A column, read-only, with as many rows as there are joint positions."""
        for expected, found in zip_longest((len(self), *size), array.shape, fillvalue=0):
            if found != expected:
                text = f"{self.source}: '{name}' must have shape {(len(self), *size)}, got {array.shape}"
                raise ShapeError(text, expected=expected, found=found)
        return frozen(array)

    def __repr__(self) -> str:
        named = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in UNSHOWN}
        columns = np.ndarray | Mapping | AbstractReadings
        seen = [*(name for name, value in named.items() if isinstance(value, columns)), *self.more]
        return f"<Dataset {self.source}: {len(self)} rows of {self.joints} joints; {', '.join(seen)}>"

    def __len__(self) -> int:
        return len(self.q)

    @property
    def said(self) -> "Dataset":
        """These rows, for those who take them as they stand; refused if the file lacks units."""
        if self.missing_units:
            raise UnitError(self.missing_units, unit="")
        return self

    @property
    def counted(self) -> str:
        """What the numbers of its rows are, for messages."""
        return f"rows as in its '{self.counter}'" if self.counter else "rows count from 0"

    def places(self, rows: Iterable[int]) -> list[int]:
        """Data rows of the file, counted from 0, by number."""
        known = dict(zip(self.row.tolist(), self.place.tolist(), strict=True))
        return [known.get(row, row) for row in rows]

    def column(self, name: str) -> np.ndarray | None:
        return getattr(self, name) if name in self.__dataclass_fields__ else self.more.get(name)

    @property
    def joints(self) -> int:
        """Number of joint columns."""
        return self.q.shape[1]

    @cached_property
    def sessions(self) -> tuple[str, ...]:
        """Session names in order of appearance; one unnamed session when the file has none."""
        if self.session is None:
            return ("",)
        return tuple(dict.fromkeys(self.session.tolist()))

    @cached_property
    def included(self) -> Bool[np.ndarray, " rows"]:
        """Rows that the file does not keep out."""
        return np.ones(len(self), bool) if self.exclude is None else ~self.exclude

    def in_session(self, name: str) -> Bool[np.ndarray, " rows"]:
        """Rows of a session; all of them where the file has none."""
        return np.ones(len(self), bool) if self.session is None else self.session == name

    def to_frame(self, *, prismatic: Collection[int] = ()) -> "DataFrame":
        """A data frame with headings as in a file (`q1[rad]`, `x[m]` …), which reads back as the same rows.

        Args:
            prismatic: Joints, counted from 0, whose positions are lengths [m].
        """
        return data_frame(self.columns(prismatic=prismatic))

    def columns(self, *, prismatic: Collection[int] = ()) -> dict[str, np.ndarray]:
        """The columns of a file by heading, in the order of formats.md; arguments as `to_frame`."""
        number, table = self.joints, [column for column in known_columns().values() if column.kept]
        found: list[tuple[Sequence[str], np.ndarray | None]] = [
            ([f"q{j + 1}[{'m' if j in prismatic else 'rad'}]" for j in range(number)], self.q),
            (("x[m]", "y[m]", "z[m]"), self.position),
        ]
        if self.rotation is not None:
            whole = ~np.isnan(self.rotation).any((1, 2))
            quaternions = np.full((len(self), 4), np.nan)
            quaternions[whole] = se3.matrix_to_quaternion(self.rotation[whole])
            found.append((("qw", "qx", "qy", "qz"), quaternions))
        found += [(c.headings(number), self.column(c.name)) for c in table if c.driver]
        found.append((SIGMA, self.sigma))
        if (markers := self.markers) is not None:
            names = [f"m{m + 1}{axis}[m]" for m in range(markers.shape[1]) for axis in "xyz"]
            found.append((names, markers.reshape(len(self), len(names))))
        others = (c for c in table if not (c.driver or c.is_label))
        found += [(c.headings(number), self.column(c.name)) for c in others]
        found += [((f"tilt_x{k}[rad]", f"tilt_y{k}[rad]"), v) for k, v in (self.tilt or {}).items()]
        found.append((WRENCH, self.wrench))
        found += [([c.name], self.column(c.name)) for c in table if c.is_label]
        pairs = ((names, np.atleast_2d(values.T)) for names, values in found if values is not None)
        return {name: column for names, each in pairs for name, column in zip(names, each, strict=True)}

    def take(self, rows: Int[np.ndarray, " k"] | Bool[np.ndarray, " rows"]) -> "Dataset":
        """The chosen rows, by index or mask, in the order given; itself for all of them in their order."""
        chosen, why = np.zeros(()), "they have several dimensions"
        try:
            chosen = np.arange(len(self))[rows if isinstance(rows, slice) or len(rows) else np.zeros(0, int)]
        except (IndexError, TypeError, ValueError) as error:
            why = str(error)
        if chosen.ndim != 1:
            text = f"rows must be a list of indices, or a truth value for each of the {len(self)} rows: {why}"
            raise OptionError(text, option="rows", found=rows)
        if len(chosen) == len(self) and (chosen == np.arange(len(self))).all():
            return self
        taken = object.__new__(Dataset)  # rows of a checked table are checked
        vars(taken).update({n: _taken(vars(self)[n], chosen) for n in self.__dataclass_fields__})
        return taken

    def kept_out(self, reasons: Mapping[int, str]) -> "Dataset":
        """With some more rows kept out, by index, each with its reason."""
        if not reasons:
            return self
        exclude, reason = ~self.included, np.full(len(self), "", object)
        reason = reason if self.reason is None else self.reason.astype(object)
        for row, text in reasons.items():
            exclude[row], reason[row] = True, text
        return replace(self, exclude=exclude, reason=reason)

    def joined(self, other: "Dataset") -> "Dataset":
        """These rows and then the other's; where one of them lacks a column its values are missing.

        Missing are numbers as NaN, labels as "", marks as False. Source and notes are these rows' own; the
        other's row numbers go on after them.
        """
        if not isinstance(other, Dataset):
            text = f"only a Dataset can be joined, got {type(other).__name__}; wb.read_measurements makes one"
            raise OptionError(text, option="other", found=other)
        if other.joints != self.joints:
            text = f"{other.source}: rows of {other.joints} joints can't be joined to rows of {self.joints}"
            raise ShapeError(text, expected=self.joints, found=other.joints)
        columns, sizes = dict[str, Any](), (len(self), len(other))
        for f in fields(self):
            pair = getattr(self, f.name), getattr(other, f.name)
            if any(isinstance(value, np.ndarray) for value in pair):
                columns[f.name] = _stacked(pair, sizes)
            elif any(isinstance(value, Mapping) for value in pair):
                first, second = (value or {} for value in pair)
                names = sorted({*first, *second})
                columns[f.name] = {k: _stacked((first.get(k), second.get(k)), sizes) for k in names}
        columns["row"] = np.concatenate([self.place, other.place + 1 + self.place.max(initial=-1)])
        columns["counter"] = ""
        written = [own for own in (self.written, other.written) if own is not None]
        is_one = len(written) == 2 and written[0].name == written[1].name
        together = np.concatenate([own.numbers for own in written]) if is_one else None
        columns["written"] = None if together is None else WrittenOrientation(written[0].name, together)
        return replace(self, **columns)


def _taken(value: Any, rows: np.ndarray) -> Any:
    """Some rows of a field; what has no rows stays as it is."""
    if isinstance(value, np.ndarray):
        return frozen(value[rows])
    if isinstance(value, Mapping):
        return {key: frozen(values[rows]) for key, values in value.items()}
    return value.take(rows) if isinstance(value, AbstractReadings | WrittenOrientation) else value


def _stacked(pair: tuple[np.ndarray | None, np.ndarray | None], sizes: tuple[int, int]) -> np.ndarray:
    """Two parts of a column, one of which may be missing."""
    like = next(value for value in pair if value is not None)
    nothing: object = {"f": np.nan, "b": False}.get(like.dtype.kind, "")
    size, sized = like.shape[1:], zip(pair, sizes, strict=True)
    filled = [np.full((n, *size), nothing, like.dtype) if v is None else v for v, n in sized]
    return np.concatenate(filled)
