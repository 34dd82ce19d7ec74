"""A one-page certificate, as PDF and as HTML: what was verified, how, with what result, and by whom.

Both are made from the same words. The page needs nothing else: no network, no scripts, its picture inside.
"""

import hashlib
from collections.abc import Sequence
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

from workbench.base.errors import FileError
from workbench.base.files import check_folder, write_bytes
from workbench.base.installed_package import package_version
from workbench.base.wording import plural
from workbench.identification.verification.iso9283 import cycle_words
from workbench.identification.verification.plots import CAPTION, draw_error_map, error_map
from workbench.identification.verification.results import (
    REPEATS,
    error_lines,
    repeat_cells,
    verification_json,
    worst_first,
)
from workbench.identification.verification.verify import Verification
from workbench.report.figures import Drawing, svg
from workbench.report.html import write_page
from workbench.report.numbers import short
from workbench.report.paper import MARGIN, QUIET, WIDTH, Paper, Place

PAGE, PAPER, MAP = "certificate.html", "certificate.pdf", "error-map"
REPEATED = 5
"""Repeated poses in the table: as many as the standard's cycle has."""
GOOD, BAD, PLAIN = "#00704f", "#b03a00", "#5d6672"
ROOM = {"left": 0.07, "right": 0.99, "bottom": 0.15, "top": 0.91, "wspace": 0.3}
SIGNATURES = ("Measured by", "Approved by")


def _words(result: Verification, inputs: Sequence[Path | str], day: date) -> dict[str, Any]:
    """The words of the page: names and texts in two columns, tables with their headings first, sentences."""
    data = result.data
    arm = [("Arm", f"{result.robot.name}, {result.robot.dof} joints"), *result.facts.items()]
    if (calibration := result.robot.calibration) is not None:
        arm.append(("Calibrated from", f"{calibration.source}, {len(calibration.poses)} rows"))
    arm.append(("Measurements", f"{Path(data.source).name}, {plural(len(data), 'row')}"))
    return {
        "title": result.robot.name,
        "stamp": {True: "PASSED", False: "FAILED", None: "VERIFIED"}[result.passed],
        "passed": result.passed,
        "verdict": result.verdict,
        "arm": arm,
        "conditions": _conditions(result),
        "errors": _errors(result),
        "repeats": _repeats(result),
        "method": _method(result),
        "warnings": result.warnings,
        "inputs": [(Path(path).name, _sha256(Path(path))) for path in inputs],
        "made": f"{day.isoformat()}, workbench {package_version()}",
    }


def _paper(words: dict[str, Any], result: Verification) -> bytes:
    """The page as PDF, A4."""
    page = Paper()
    colour = {True: GOOD, False: BAD, None: PLAIN}[result.passed]
    page.badge(words["stamp"], colour, at=Place(WIDTH - MARGIN - 38.0, 38.0))
    left = Place(MARGIN, WIDTH - 2 * MARGIN - 44.0)
    page.words("CERTIFICATE OF VERIFICATION", size=7.5, colour=QUIET, at=left)
    page.words(words["title"], size=19.0, bold=True, at=left, most=2)
    page.y += 1.5
    page.words(words["verdict"], size=9.5, bold=True, colour=colour)
    page.y += 3.0
    half, top = 0.5 * (WIDTH - 2 * MARGIN) - 3.0, page.y
    page.pairs(words["arm"][:9], at=Place(MARGIN, half))
    low, page.y = page.y, top
    page.pairs(words["conditions"], at=Place(MARGIN + half + 6.0, half))
    page.y = max(low, page.y) + 2.0
    page.table(words["errors"][0], words["errors"][1:], (0.25, 0.12, 0.21, 0.12, 0.12, 0.18))
    page.y += 2.0
    draw_error_map(page.picture(76.0), result, ROOM)
    page.words(CAPTION, size=6.5, colour=QUIET)
    if repeats := words["repeats"]:
        page.y += 2.0
        page.table(repeats[0], repeats[1:], (0.18, 0.1, 0.12, 0.12, 0.24, 0.24))
    page.y += 2.0
    for sentence in words["method"]:
        page.words(sentence, size=7.0)
    for sentence in words["warnings"][:4]:
        page.words(f"Note: {sentence}.", size=7.0, bold=True, most=3)
    page.y += 2.0
    for name, digest in words["inputs"][:4]:
        page.words(f"{name}: sha256 {digest}", size=6.0, colour=QUIET, most=2)
    page.words(words["made"], size=6.0, colour=QUIET)
    page.y = max(page.y + 14.0, 274.0)
    for k, who in enumerate(SIGNATURES):
        place = Place(MARGIN + k * (half + 6.0), half)
        page.rule(at=place)
        low = page.y
        page.words(f"{who}: name, date, signature", size=6.5, colour=QUIET, at=place)
        page.y = low
    return page.pdf()


def write_certificate(
    result: Verification, target: Path | str, *, inputs: Sequence[Path | str] = (), day: date | None = None
) -> Path:
    """Write the certificate: one PDF, or a folder with PDF, page, picture and numbers.

    Args:
        target: A name ending in `.pdf`, or a folder, which is made if it is not there.
        inputs: Files whose sha256 is given.
        day: Of the certificate; today if None.

    Returns:
        Path of the PDF, or of the page in the folder.
    """
    target = Path(target)
    words = _words(result, inputs, day or date.today())
    paper = _paper(words, result)
    if target.suffix.lower() == ".pdf":
        return write_bytes(target, paper)
    check_folder(target)
    drawing = Drawing(MAP, "Where the errors are", CAPTION, svg(error_map(result), MAP))
    files = {PAPER: paper, f"{MAP}.svg": drawing.svg.encode()}
    return write_page(
        target, PAGE, [drawing], verification_json(result), files=files, c=words, signatures=SIGNATURES
    )


def _conditions(result: Verification) -> list[tuple[str, str]]:
    data = result.data
    rows = [("Poses", f"{result.poses} different, none of them used for the calibration")]
    if result.robot.calibration is None:
        rows = [("Poses", f"{result.poses} different")]
    if len(data.sessions) > 1:
        rows.append(("Placements", f"{len(data.sessions)}: {', '.join(map(str, data.sessions))}"))
    for name, values, unit in (
        ("Temperature", data.temperature, "°C"),
        ("Payload", data.payload, "kg"),
        ("Duration", None if data.time is None else (data.time - np.nanmin(data.time)) / 3600.0, "h"),
    ):
        if values is not None and np.isfinite(values).any():
            low, high = float(np.nanmin(values)), float(np.nanmax(values))
            span = f"{low:.3g}" if high - low < 1e-9 else f"{low:.3g} to {high:.3g}"
            rows.append((name, f"{high:.3g} h" if unit == "h" else f"{span} {unit}"))
    wanted = (
        "no figure was given" if result.wanted is None else f"at most {result.wanted.words} at every pose"
    )
    return [*rows, ("Wanted", wanted)]


def _errors(result: Verification) -> list[tuple[str, ...]]:
    lines: list[tuple[str, ...]] = [("Error", "mean", "95 % interval", "rms", "largest", "95 % of all poses")]
    for name, spread, bounds, scale in error_lines(result):
        interval = f"{short(scale * bounds.mean.low)} … {short(scale * bounds.mean.high)}"
        most = f"≤ {short(scale * bounds.most)}" if np.isfinite(bounds.most) else "too few poses"
        lines.append((name, short(spread.mean), interval, short(spread.rms), short(spread.max), most))
    return lines


def _repeats(result: Verification) -> list[tuple[str, ...]]:
    if not result.repeated:
        return []
    return [("ISO 9283: rows", *REPEATS[1:]), *map(repeat_cells, worst_first(result)[:REPEATED])]


def _method(result: Verification) -> list[str]:
    said = [
        "Method: an error is the distance between the measured tool point and the one that the calibrated "
        "model computes from the joint positions; orientation, the angle between both. Intervals of means "
        "are bootstrapped over poses; the bound of 95 % of all poses holds with 95 % confidence whatever the "
        "errors' distribution.",
        f"Repeatability: {cycle_words(result.repeated)}.",
    ]
    if result.repeated:
        said[1] += (
            f" Visits are rows whose joints agree within {np.rad2deg(result.same):.2g}°; AP: barycentre "
            "of the visits against the command pose; RP: mean + 3 S of their distances from it."
        )
        if (more := len(result.repeated) - REPEATED) > 0:
            said[1] += f" The least accurate {REPEATED} are listed, {more} more are in the result file."
    return said


def _sha256(path: Path) -> str:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise FileError(error.strerror or "can't be read", path=str(path)) from None
