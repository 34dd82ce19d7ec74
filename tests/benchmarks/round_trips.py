"""Print, for measured arms, what was shown of each saved file and what the file itself gives by other code.

    python tests/benchmarks/round_trips.py                      # all sets, entrances and formats, as markdown
    python tests/benchmarks/round_trips.py --sets ur5,iiwa14

The readers of the files are plain numpy (`tests/round_trip.py`). The flange is that of the arm in memory, and
of the nominal arm, in the arm's own base.
"""

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]
sys.path[:1] = [str(TESTS.parent), str(TESTS)]  # not this folder: the readers have this file's name

import numpy as np
import round_trip as trip
import test_round_trip as tested
from real_arms import set_names

import workbench as wb
from tests.exports.readers import spreadsheet
from tests.extras.controllers import test_round_trip_of_forms as forms
from workbench.arm.frame import Frame
from workbench.arm.robot import Robot
from workbench.arm.usable import usable_arm
from workbench.base.errors import WorkbenchError
from workbench.data.directions import with_directions
from workbench.data.prediction import predict
from workbench.exports import FORMS, Job, export_robot

DATA = TESTS.parents[1] / "shared" / "data"
SETS = ("ur5", "wam", "panda_3", "iiwa14", "ur10")
FILES = (
    "set",
    "entrance",
    "after",
    "file",
    "shown",
    "file's own",
    "difference",
    "flange, memory",
    "flange, nominal",
)
READERS = {"dh-csv": lambda nominal, text: spreadsheet(text), **forms.READERS}
FORMATS = ("set", "after", "format", "says, at most", "file's own", "difference")


def in_a_process(*options: object) -> tuple[int, str, str]:
    """A command as a person types it."""
    done = subprocess.run(
        [sys.executable, "-m", "workbench", *map(str, options)], capture_output=True, text=True
    )
    return done.returncode, done.stdout, done.stderr


def flange(robot: Robot, measured: tested.Measured) -> np.ndarray:
    """Flanges that the package predicts, in the arm's own base."""
    bare = replace(robot.with_frames(base=Frame(), tool=Frame()), sessions={})
    return predict(bare, with_directions(wb.read_measurements(measured.path)))


def sizes(position: float, rotation: float, *, digits: str = ".4g") -> str:
    """A length [m] and an angle [rad], for people."""
    turned = "" if np.isnan(rotation) else f", {np.rad2deg(rotation):{digits}}°"
    return f"{1e3 * position:{digits}} mm{turned}"


def pose_difference(a: np.ndarray, b: np.ndarray) -> str:
    """Greatest distance [µm] and angle [°] between poses."""
    distance, angle = trip.pose_difference(a, b)
    return f"{1e6 * distance:.1g} µm, {np.rad2deg(angle):.1g}°"


def from_nominal(a: np.ndarray, b: np.ndarray) -> str:
    """Mean distance and angle of flanges, the second on the base on which it is closest."""
    base = trip.aligned(b[:, :3, 3], a[:, :3, 3])
    placed = base @ b
    return sizes(
        float(np.linalg.norm(placed[:, :3, 3] - a[:, :3, 3], axis=1).mean()),
        float(trip.angle(placed, a).mean()),
        digits=".3f",
    )


def files(name: str, measured: tested.Measured, folder: Path) -> Iterable[tuple[str, ...]]:
    """A line for each entrance, stage and file."""
    rows, nominal = measured.rows, flange(wb.load_robot(measured.robot).with_effects(), measured)
    for diagnosed in (False, True):
        for entrance, saves in tested.ENTRANCES.items():
            place = folder / f"{entrance}-{diagnosed}"
            place.mkdir()
            saved = saves(measured, place, diagnosed=diagnosed, run=in_a_process)
            shown = {n: (mm, turned) for n, mm, turned in trip.SHOWN.findall(saved.judged[0])}
            arm = wb.load_robot(str(saved.toml))
            for label, path in (("TOML", saved.toml), ("URDF", saved.urdf)):
                found = trip.errors(saved.arm(path), rows.take(saved.judged[1]))
                mm, turned = shown[label]
                memory = arm if label == "TOML" else usable_arm(arm, effects=False).robot
                own = trip.read_arm(path)(rows)[0]
                away = f"{1e3 * abs(float(mm) - 1e3 * found.position):.2g} µm"
                if turned:
                    away += f", {abs(float(turned) - np.rad2deg(found.rotation)):.1g}°"
                yield (
                    name,
                    entrance,
                    "diagnose" if diagnosed else "identify",
                    label,
                    f"{mm} mm" + (f", {turned}°" if turned else ""),
                    sizes(found.position, found.rotation),
                    away,
                    pose_difference(own, flange(memory, measured)),
                    from_nominal(own, nominal),
                )


def formats(name: str, measured: tested.Measured, folder: Path) -> Iterable[tuple[str, ...]]:
    """A line for each other format of the arm that the command saved."""
    nominal = wb.load_robot(measured.robot)
    for diagnosed in (False, True):
        place = folder / f"command-{diagnosed}"
        saved = trip.Saved(place / "arm.toml", place / "arm.urdf", "", np.zeros(0), None)
        job = Job(robot=wb.load_robot(str(saved.toml)), nominal=nominal)
        rows, (_, wanted) = tested.at_observed(saved)
        for form, read in READERS.items():
            path = place / f"{form}{FORMS[form].ending}"
            try:
                done = export_robot(FORMS[form], path, job)
            except WorkbenchError:
                continue
            found = tested.arm_of(read(nominal, path.read_text()), done.notes, saved)(rows)[1]
            position, rotation = trip.pose_difference(found, wanted)
            seen = measured.rows.rotation is not None
            yield (
                name,
                "diagnose" if diagnosed else "identify",
                form,
                sizes(done.position, done.rotation if seen else np.nan),
                sizes(position, rotation if seen else np.nan),
                f"{1e6 * abs(position - done.position):.1g} µm"
                + (f", {np.rad2deg(abs(rotation - done.rotation)):.1g}°" if seen else ""),
            )


def table(head: Iterable[str], lines: Iterable[Iterable[str]]) -> None:
    """Markdown, line by line as it comes."""
    head = list(head)
    print(f"| {' | '.join(head)} |\n|{'---|' * len(head)}")
    for line in lines:
        print(f"| {' | '.join(line)} |", flush=True)
    print()


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sets", type=set_names, default=SETS, help="names with commas between")
    parser.add_argument("--data", type=Path, default=DATA, help="folder of the sets")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as room:
        folders = {name: Path(room, name) for name in given.sets}
        for folder in folders.values():
            folder.mkdir()
        measured = {name: tested.real(name, given.data, folder) for name, folder in folders.items()}
        table(FILES, (line for n, folder in folders.items() for line in files(n, measured[n], folder)))
        table(FORMATS, (line for n, folder in folders.items() for line in formats(n, measured[n], folder)))


if __name__ == "__main__":
    main()
