"""Tables 3.2 to 3.4, 4.5 and 4.6 of the Katana thesis beside those of virtual arms."""

import numpy as np

from studies import katana_printed as printed
from studies.finding import Finding, judged, without
from studies.katana_study import BEFORE, CONVENTIONAL, FIRST, INFLUENCE, SIMULTANEOUS, KatanaStudy, spread

MIN, MAX, MEAN = range(3)
DISTANCE = 3
"""Row of |ΔP| in Tables 3.4 and 4.5."""
HALF_UNIT = 0.005
"""Rounding of the printed numbers [mm], [°]."""
POSITIONS = 4
"""Rows of Tables 3.4 and 4.5 that are positions; the others are angles."""
BEFORE_REASON = (
    "errors of Table 3.2's size alone move the tool about 0.6 mm; the rest is tilting, which comes to 1.2 mm "
    "in all if the printed play counts to either side, but then leaves twice the printed error"
)
AXIS_REASON = "how an error falls on the axes depends on where the cube lies; the poses are not listed"
ANGLE_REASON = (
    "Tables 3.4 and 4.5 print the same six numbers for two pairs of different methods; they can't all have "
    "been measured"
)
TWICE_REASON = (
    "the thesis's arm ends at 0.38 mm in chapter 3 and at 0.33 in chapter 4; what our arms carry beside the "
    "tilting was chosen between the two"
)
INFLUENCE_REASON = (
    "influence as a weight removes no error that the constants can't hold: here it leaves what the "
    "simultaneous way leaves, and least squares a little less"
)
MIN_REASON = (
    "among 118 errors of either sign one comes nearer to nothing: printed is what an error shows that keeps "
    "its sign at all poses, such as that of the reference corner"
)
MAX_REASON = (
    "the greatest of 118 depends on single poses, which are not listed; Φ and Ψ swing where the last link "
    "stands nearly upright"
)


def table_3_4(study: KatanaStudy) -> tuple[Finding, ...]:
    """Averages over the 118 poses: before, simultaneous, influence based."""
    means = study.measured[:, [BEFORE, SIMULTANEOUS, INFLUENCE], MEAN]
    findings = [
        _compared("Tables 3.4, 4.5", f"before: mean {name}", printed.TABLE_3_4[row, 0], means[:, 0, row],
                  AXIS_REASON if row < 3 else BEFORE_REASON)
        for row, name in enumerate(printed.COMPONENTS)
    ]  # fmt: skip
    for column, (title, reason) in enumerate(
        (("simultaneous", TWICE_REASON), ("influence based", INFLUENCE_REASON)), start=1
    ):
        findings += [
            _compared("Table 3.4", f"{title}: mean {name}", printed.TABLE_3_4[row, column],
                      means[:, column, row], reason if row == 3 or column == 2 else AXIS_REASON)
            for row, name in enumerate(printed.COMPONENTS[:POSITIONS])
        ]  # fmt: skip
        findings += _angles("Table 3.4", title, printed.TABLE_3_4[POSITIONS:, column])
    return tuple(findings)


def table_4_5(study: KatanaStudy) -> tuple[Finding, ...]:
    """Least, greatest and mean over the 118 poses: before, conventional, with tilting."""
    ours = study.measured[:, [BEFORE, CONVENTIONAL, FIRST]]
    findings = [
        _row(word, row, printed.TABLE_4_5[statistic, row], ours[:, :, statistic, row], reason)
        for statistic, word, reason in ((MIN, "least", MIN_REASON), (MAX, "greatest", MAX_REASON))
        for row in range(len(printed.COMPONENTS))
    ]
    for column, title in ((1, "conventional"), (2, "with tilting")):
        findings += [
            _compared("Table 4.5", f"{title}: mean {name}", printed.TABLE_4_5[MEAN, row, column],
                      ours[:, column, MEAN, row], AXIS_REASON)
            for row, name in enumerate(printed.COMPONENTS[:POSITIONS])
        ]  # fmt: skip
        findings += _angles("Table 4.5", title, printed.TABLE_4_5[MEAN, POSITIONS:, column])
    return tuple(findings)


def table_4_6(study: KatanaStudy) -> tuple[Finding, ...]:
    """Means of ten uncalibrated points."""
    columns = [BEFORE, CONVENTIONAL, FIRST]
    means = study.ten.mean(axis=2)[:, columns]
    titles = ("before", "conventional", "with tilting")
    reasons = (
        BEFORE_REASON,
        "here poses that took no part fare as the measured ones, 118 being many for a dozen constants; the "
        "thesis finds half as much again",
        "",
    )
    return tuple(
        _compared("Table 4.6", f"{title}: mean |ΔP| of ten points [mm]", mean, means[:, k], reason)
        for k, (title, mean, reason) in enumerate(zip(titles, printed.TABLE_4_6_MEANS, reasons, strict=True))
    )


def _compared(where: str, what: str, value: float, ours: np.ndarray, reason: str) -> Finding:
    """A printed number against the range of nine arms in ten, to the printed rounding."""
    found = spread(ours)
    inside = found.low - HALF_UNIT <= value <= found.high + HALF_UNIT
    return judged(where, what, _text(what, value), found.text(), inside, "" if inside else reason)


def _text(what: str, value: float) -> str:
    """As printed: lengths with two digits, angles with two or three."""
    return f"{value:.2f}" if "[mm]" in what or round(value, 2) == value else f"{value:.3f}"


def _row(word: str, row: int, values: np.ndarray, ours: np.ndarray, reason: str) -> Finding:
    """Three columns of a row at once: before, conventional, with tilting."""
    found = [spread(ours[:, column]) for column in range(3)]
    inside = all(f.low - HALF_UNIT <= v <= f.high + HALF_UNIT for f, v in zip(found, values, strict=True))
    return judged(
        "Table 4.5", f"{word} {printed.COMPONENTS[row]}",
        ", ".join(_text(printed.COMPONENTS[row], value) for value in values),
        ", ".join(f"{f.median:.3f}" for f in found), inside, "" if inside else reason,
    )  # fmt: skip


def _angles(where: str, title: str, values: np.ndarray) -> list[Finding]:
    shown = ", ".join(f"{value:g}" for value in values)
    return [without(where, f"{title}: mean |ΔΦ|, |Δθ|, |ΔΨ| [°]", shown, ANGLE_REASON)]
