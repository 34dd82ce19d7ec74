"""Rows as an arm's fit should take them: as given, in the convention found, or not at all."""

from dataclasses import replace
from enum import StrEnum

import numpy as np

from workbench.arm.robot import Robot
from workbench.base.errors import DataError
from workbench.data.dataset import Dataset
from workbench.identification.meaning.reading import FOREIGN_MISFIT
from workbench.identification.meaning.search import Meaning, fits_at_a_glance, read_rows

SMALL_ZERO = 0.26
"""Zeros that differ by less [rad] are errors of the arm, which an identification finds."""


class ReadAs(StrEnum):
    """What to do where another reading of the rows fits far better."""

    AUTO = "auto"
    FOUND = "found"
    GIVEN = "given"


def is_misread(meaning: Meaning) -> bool:
    """Whether the rows clearly mean something else, which the saved arm would have to share."""
    best = meaning.best
    if not meaning.is_found or best.is_plain:
        return False
    if meaning.plain is not None and best.robot.name != meaning.plain.robot.name:
        return True
    return not (best.only_zeros and np.abs(best.zero).max() < SMALL_ZERO)


def as_read(robot: Robot, data: Dataset, how: ReadAs | str = ReadAs.AUTO) -> Dataset:
    """The rows in the reading that is clearly theirs, with a note on it.

    Units and conventions that a heading leaves open are applied. Signs, zeros, couplings, order, and
    another arm end with a sentence and its remedy, since a saved arm must count its joints as the
    controller does.

    Raises:
        DataError: another reading is clearly better and `how` doesn't accept it, or the rows are of no such
        arm.
    """
    if ReadAs(how) is ReadAs.GIVEN or data.readings is not None or fits_at_a_glance(robot, data):
        return data
    meaning = read_rows(robot, data)
    if meaning is None or (data.joints != robot.dof and not meaning.is_found):
        return data
    best, plain = meaning.best, meaning.plain
    if is_misread(meaning):
        sentence = misread_text(meaning)
        if ReadAs(how) is not ReadAs.FOUND or best.robot.name != robot.name:
            raise DataError(f"{data.source}: {sentence}; {remedy(meaning, robot)}")
        return replace(best.apply(data), notes=(*data.notes, f"read so: {sentence}"), read_as=sentence)
    turned = meaning.turned
    if turned is not None and plain is not None:
        note = f"{turned.orientation}: {turned.size} instead of {plain.size} as the heading says; read so"
        data = replace(turned.apply(data), notes=(*data.notes, note), read_as=note)
        plain = turned
    if plain is None or plain.position > FOREIGN_MISFIT * robot.reach:
        raise DataError(f"{data.source}: {misread_text(meaning)}; {remedy(meaning, robot)}")
    if not meaning.is_found:
        return replace(data, notes=(*data.notes, unexplained_text(meaning)))
    return data


def misread_text(meaning: Meaning) -> str:
    """`joint 3 = q3 + q2: 0.03 mm instead of 220 mm as given (next best 7 458 times worse)`."""
    best, plain = meaning.best, meaning.plain
    if not meaning.is_found:
        return unexplained_text(meaning)
    given = "" if plain is None else f" instead of {plain.size} as given"
    next_best = f" (next best {meaning.margin:.3g} times worse)" if meaning.margin < 1e6 else ""
    blind = [text for text in meaning.blind if "left-handed" not in text]
    other = f"; these points can't tell it from {blind[0]}" if blind else ""
    return f"{best.text}: {best.size}{given}{next_best}{other}"


def unexplained_text(meaning: Meaning) -> str:
    """What was tried in full, and how near the nearest came."""
    given = meaning.turned or meaning.plain
    said = "no reading fits" if given is None else f"the nominal arm is {given.size} off"
    if not meaning.tried:
        return said
    return f"{said}; tried in full: {meaning.tried_text}; the nearest leaves {meaning.best.size}"


def remedy(meaning: Meaning, robot: Robot) -> str:
    """What to do where rows mean something else."""
    if not meaning.is_found:
        return "choose the robot that was measured, or correct its table"
    if meaning.best.robot.name != robot.name:
        return f"choose {meaning.best.robot.name}"
    return "accept it with reading 'found' (--reading found), or correct the file"
