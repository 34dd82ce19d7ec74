"""What leaves: sets × entrances × formats, each file's error by other code beside the nominal arm's.

Rows that no command saw are the judge, in mm and in degrees; base and tool are fitted to those that it saw,
alike for a file and for the nominal arm. Of a virtual arm the flange's own orientation judges, if none is
measured. Nothing worse than nominal may leave with status 0. `pytest -m slow -s` prints the table.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
import round_trip as trip
from generator import four
from real_arms import SETS
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

import workbench as wb
from tests.exports import readers
from tests.session.direct_commands import done
from workbench.arm.robot_toml import robot_text
from workbench.base.errors import WorkbenchError
from workbench.exports import FORMS
from workbench.session import export, start
from workbench.session.commands.data import LoadData
from workbench.session.commands.diagnose import AddEffects, Diagnose
from workbench.session.commands.identify import Identify

pytestmark = [pytest.mark.slow, pytest.mark.extra("controllers"), pytest.mark.extra("trajectories")]
ROWS, FRESH, CHANCE = 240, 80, 0.5
"""Rows of a set; those kept apart; rise of a mean, over the root of their number, that is chance."""
H = np.pi / 2
COUPLED = [(0, 0.45, 0.15, H), (H, 0, 0.6, 0), (0, 0, 0.12, H), (0, 0.64, 0, -H), (0, 0, 0, H),
           (0, 0.1, 0, 0)]  # fmt: skip
VIRTUAL = {"ur10": (True, 4e-5), "ur5": (False, 0.0), "panda": (False, 2e-5), "iiwa14": (True, 0.0),
           "coupled": (True, 0.0)}  # fmt: skip
"""Whether orientations are measured, and how joints 2 and 3 give way [rad/(N·m)]."""
REAL = ("ur10", "ur5", "wam", "panda_3", "iiwa14")
OWN_FORMS = {"ur": ("ur-calibration", "ur-kinematics"), "panda": ("franka-kinematics",)}
KEYS = {"ur-kinematics": ("kinematics", ""), "xarm-kinematics": ("kinematics", ""),
        "franka-kinematics": ("", "kinematic")}  # fmt: skip
Flange = Callable[[trip.Rows], np.ndarray]


@dataclass(frozen=True, eq=False)
class Measured:
    """Rows that are given to the program, and those that judge; flanges of a virtual arm."""

    name: str
    robot: str
    path: Path
    given: trip.Rows
    fresh: trip.Rows
    actual: Flange | None = None

    @property
    def nominal(self) -> Flange:
        arm = trip.toml_arm(robot_text(wb.load_robot(self.robot).with_effects()))
        return lambda rows: arm(rows)[0]

    @property
    def forms(self) -> tuple[str, ...]:
        own = OWN_FORMS.get(Path(self.robot).stem.rstrip("0123456789"), ("xarm-kinematics",))
        return ("mjcf", "dh-csv", *own)

    def errors(self, flange: Flange) -> tuple[float, float]:
        """Mean distance [mm] and angle [°] on the fresh rows; the latter NaN if nobody knows orientations."""
        off, turned = _errors(flange, self.given, self.fresh)
        if self.fresh.rotation is None and (actual := self.actual) is not None:
            known = [replace(r, position=(at := actual(r))[:, :3, 3], rotation=at[:, :3, :3])
                     for r in (self.given, self.fresh)]  # fmt: skip
            turned = _errors(flange, *known)[1]
        return off, turned


def _errors(flange: Flange, given: trip.Rows, fresh: trip.Rows) -> tuple[float, float]:
    bases, tool = _placed(flange(given), given)(fresh.session)
    found = trip.errors(lambda rows: (tool, bases @ flange(rows) @ tool), fresh)
    return 1e3 * found.position, float(np.rad2deg(found.rotation))


def _placed(flange: np.ndarray, rows: trip.Rows) -> Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """The base of each session and the tool that fit rows best."""
    names, session = np.unique(rows.session, return_inverse=True)
    mine = [session == k for k in range(len(names))]
    bases = np.array([trip.aligned(flange[own, :3, 3], rows.position[own]) for own in mine])

    def poses(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        places, turns = np.split(x.reshape(-1, 6), 2, axis=1)
        parts = four(Rotation.from_rotvec(turns).as_matrix(), places)
        return parts[:-1] @ bases, parts[-1]

    def residual(x: np.ndarray) -> np.ndarray:
        base, tool = poses(x)
        found = base[session] @ flange @ tool
        turned = [] if rows.rotation is None else [0.3 * (found[:, :3, :3] - rows.rotation).ravel()]
        return np.concatenate([(found[:, :3, 3] - rows.position).ravel(), *turned, 1e-6 * x])

    first = np.zeros(6 * len(names) + 6)
    if rows.rotation is not None:
        turned = np.swapaxes(bases[session] @ flange, 1, 2)[:, :3, :3] @ rows.rotation
        first[-3:] = Rotation.from_matrix(turned).mean().as_rotvec()
    base, tool = poses(least_squares(residual, first, method="lm").x)
    return lambda which: (base[np.searchsorted(names, which)], tool)


def real(name: str, shared: Path, folder: Path) -> Measured:
    place, robot = SETS[name]
    head, lines = trip.thinned(shared / place / "measurements.csv", ROWS)
    for part, rows in (("given", [n for k, n in enumerate(lines) if k % 3]), ("fresh", lines[::3])):
        (folder / f"{part}.csv").write_text("\n".join([head, *rows]) + "\n")
    given, fresh = (trip.read_rows(folder / f"{part}.csv") for part in ("given", "fresh"))
    return Measured(name, robot, folder / "given.csv", given, fresh)


def virtual(name: str, folder: Path) -> Measured:
    """An arm made a little otherwise than its table says, on a base and with a tool that nobody knows."""
    (turned, compliance), robot = VIRTUAL[name], name
    rng = np.random.default_rng(sorted(VIRTUAL).index(name))
    if name == "coupled":
        robot = str(folder / "coupled.toml")
        joints = [f"[[joint]]\ntheta = {t}\nd = {d}\na = {a}\nalpha = {al}\n" for t, d, a, al in COUPLED]
        joints[2] += "follows = 2\nratio = 1.0\n"
        Path(robot).write_text('name = "coupled"\nconvention = "dh"\n' + "".join(joints))
    nominal = wb.load_robot(robot).with_effects()
    arm = trip.toml_arm(robot_text(nominal))
    steps = [(kind, value + rng.normal(0.0, 7e-4), label) for kind, value, label in arm.steps]
    soft = [{"name": "joint-compliance", "joints": [2, 3], "coefficients": [compliance] * 2}]
    actual = replace(arm, steps=steps, effects=soft if compliance else [])
    rows = trip.rows_of(rng.uniform(*np.clip(nominal.search_limits.T, -2.2, 2.2), (ROWS, nominal.dof)))
    base, tool = trip.placed([0.7, -0.4, 0.3], [0.1, 0.0, 0.9]), trip.placed([0.03, -0.02, 0.12], [0.2, 0, 0])
    pose = base @ actual(rows)[0] @ tool
    noise = Rotation.from_rotvec(rng.normal(0.0, 1e-4, (ROWS, 3))).as_matrix()
    position = pose[:, :3, 3] + rng.normal(0.0, 3e-5, (ROWS, 3))
    rows = replace(rows, position=position, rotation=noise @ pose[:, :3, :3] if turned else None)
    m = Measured(name, robot, folder / "given.csv", rows.take(np.s_[FRESH:]), rows.take(np.s_[:FRESH]),
                 lambda rows: actual(rows)[0])  # fmt: skip
    trip.write_rows(m.path, m.given)
    return m


SETS_READ = [*VIRTUAL, *(pytest.param(f"real {name}", marks=pytest.mark.data) for name in REAL)]


@pytest.fixture(scope="module", params=SETS_READ)
def measured(request, tmp_path_factory) -> Measured:
    folder, (kind, _, name) = tmp_path_factory.mktemp("set"), request.param.partition(" ")
    return real(name, request.getfixturevalue("shared_data"), folder) if name else virtual(kind, folder)


def read(path: Path, form: str, robot: str) -> Flange:
    """The flange of a file, or where its format ends; what is behind it is fitted."""
    if path.suffix in trip.READERS:
        arm = trip.read_arm(path)
        return lambda rows: arm(rows)[0]
    if form == "mjcf":
        one = readers.mjcf(str(path))
    elif form in KEYS:
        one = readers.kinematics_file(path.read_text(), *KEYS[form])
    elif form == "dh-csv":
        one = readers.spreadsheet(path.read_text())
    else:
        table = re.findall(r"^(?:theta|d|a|alpha) = (\S+)$", robot_text(wb.load_robot(robot)), re.M)
        one = readers.ur_controller(path.read_text(), np.array(table[:24], float).reshape(6, 4))
    return lambda rows: np.array([one(q) for q in rows.q])


Left = Iterator[tuple[str, Path, str, str]]
"""What left: its label, file and form, and why it did not."""


def by_commands(m: Measured, folder: Path, verb: str, run: Callable) -> Left:
    given = (m.path, "--robot", m.robot)
    toml, urdf, again = (folder / name for name in ("arm.toml", "arm.urdf", "again.urdf"))
    asked = [(f"--save {p.suffix}", p, "", (verb, *given, "--save", p)) for p in (urdf, toml)]
    asked.append(("export --urdf", again, "", ("export", toml, "--urdf", again)))
    for form in m.forms:
        path = folder / f"{form}{FORMS[form].ending}"
        asked.append((form, path, form, ("export", toml, "--for", form, "--out", path, "--nominal", m.robot)))
    for label, path, form, options in asked:
        status, _, err = run(*options)
        assert path.exists() == (status == 0), err
        yield label, path, form, err.strip().rpartition("\n")[2][:150] if status else ""


def by_page(m: Measured, folder: Path, *_) -> Left:
    """The commands that the page sends, and the files behind its buttons."""
    session = start(wb.load_robot(m.robot), wb.load_plate("table2"))
    makers = {"arm.toml": ("", export.calibrated_toml), "arm.urdf": ("", export.calibrated_urdf)}
    makers |= {f"{f}{FORMS[f].ending}": (f, export.exported_as(FORMS[f])) for f in m.forms}
    for steps in ([LoadData(m.path.name, m.path.read_bytes()), Identify()], [Diagnose()], [AddEffects()]):
        if not (isinstance(steps[0], AddEffects) and not session.results.diagnosis.effects):
            session = done(session, *steps)
        for name, (form, make) in makers.items():
            path, why = folder / name, ""
            try:
                path.write_bytes(make(session)[1])
            except WorkbenchError as error:
                why = str(error)[:150]
            yield f"{type(steps[-1]).__name__} {name}", path, form, why


@pytest.mark.parametrize("entrance", ["identify", "diagnose", "page"])
def test_nothing_leaves_that_is_worse_than_nominal(measured, entrance, run, tmp_path):
    nominal = measured.errors(measured.nominal)
    worst, worse, left = 1.0 + CHANCE / np.sqrt(len(measured.fresh)), [], 0
    print(f"\n{measured.name}, {entrance}: nominal {nominal[0]:.3f} mm {nominal[1]:.4f}°")
    enter = by_page if entrance == "page" else by_commands
    for label, path, form, why in enter(measured, tmp_path, entrance, run):
        if why:
            print(f"  {label}: {why}")
            continue
        found, left = measured.errors(read(path, form, measured.robot)), left + 1
        print(line := f"  {label}: {found[0]:.3f} mm {found[1]:.4f}°")
        worse += [line] if any(a > worst * b for a, b in zip(found, nominal, strict=True)) else []
    assert not worse
    assert left


@pytest.fixture
def calibrated(measured, run, tmp_path) -> Path:
    if measured.actual is None:
        pytest.skip("the truth of a real arm is not known")
    run("diagnose", measured.path, "--robot", measured.robot, "--save", tmp_path / "arm.toml")
    return tmp_path / "arm.toml"


@pytest.mark.extra("service")
@pytest.mark.parametrize("joint", [1, 3])
def test_a_rezeroed_arm_is_better_than_before(measured, joint, run, calibrated, tmp_path):
    """A zero that moved by 0.2° after the calibration."""
    knock = np.deg2rad(0.2) * np.eye(measured.given.q.shape[1])[joint]
    given, fresh = (replace(r, q=r.q - knock) for r in (measured.given, measured.fresh))
    now = replace(measured, given=given, fresh=fresh,
                  actual=lambda rows: measured.actual(replace(rows, q=rows.q + knock)))  # fmt: skip
    trip.write_rows(tmp_path / "moved.csv", given.take(np.s_[:40]))
    saved = tmp_path / "rezeroed.toml"
    assert run("rezero", tmp_path / "moved.csv", "--robot", calibrated, "--save", saved)[0] == 0
    models = (now.nominal, *(read(path, "", "") for path in (calibrated, saved)))
    nominal, before, after = (np.array(now.errors(model)) for model in models)
    print(f"\n{measured.name}, joint {joint + 1}: nominal {nominal}, {before} → {after} mm, °")
    assert (after < 0.8 * before).all()
    assert (after < nominal).all()


def test_a_corrected_path_is_nearer_to_what_was_commanded(measured, run, calibrated, tmp_path):
    """Near the posture of the fresh rows that is farthest from singular."""
    rows, h = measured.fresh, 1e-5
    start, *moved = (measured.nominal(replace(rows, q=rows.q + step))[:, :3]
                     for step in h * np.eye(rows.q.shape[1] + 1, rows.q.shape[1], -1))  # fmt: skip
    jacobian = np.array([(m - start).reshape(len(rows), -1) for m in moved]).transpose(1, 2, 0) / h
    best = rows.q[np.argmax(np.linalg.svd(jacobian, compute_uv=False)[:, -1])]
    inside = 0.85 * best + 0.15 * measured.given.q.mean(0)  # the path stays within the limits
    rows = replace(rows, q=inside + np.linspace(-0.1, 0.1, len(rows))[:, None])
    path, out = tmp_path / "path.csv", tmp_path / "corrected.csv"
    trip.write_rows(path, rows)
    asked = ("compensate", path, "--robot", calibrated, "--nominal", measured.robot, "--out", out)
    assert run(*asked)[0] == 0
    tool = trip.toml_arm(calibrated.read_text()).table["tool"]
    point = trip.placed(tool["xyz"], tool["rpy"])
    wanted, corrected = measured.nominal(rows) @ point, replace(rows, q=trip.read_rows(out).q)
    left = []
    for found in (measured.actual(r) @ point for r in (rows, corrected)):
        placed = trip.aligned(found[:, :3, 3], wanted[:, :3, 3]) @ found
        left.append(sum(np.array(trip.pose_difference(placed, wanted)) * [1.0, 0.3]))
    print(f"\n{measured.name}, compensate: {1e3 * left[0]:.3f} → {1e3 * left[1]:.3f} mm, angles at 0.3 m")
    assert left[1] < 0.8 * left[0]
