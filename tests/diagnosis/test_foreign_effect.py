"""An effect from outside the package: registered once, known from the simulator to the corrected path."""

import json
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np
import pytest
from gear_sag import GearSag
from refusals import mentions
from rerun.chunk import RrdReader

from workbench.arm.built_in_arms import load_robot
from workbench.arm.effects import AbstractEffect, Loads
from workbench.arm.effects.axes import driven_names, own
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot_toml import read_toml, write_toml
from workbench.base.errors import RobotError
from workbench.data.readers import read_measurements, read_trajectory
from workbench.data.simulation.hidden_effects import hidden_effects
from workbench.data.writer import write_measurements
from workbench.parts import Parts, register
from workbench.plate.plate_toml import load_plate
from workbench.plate.simulated_measurement import measure_poses
from workbench.session import Worker, start
from workbench.session.commands.data import LoadData
from workbench.session.commands.diagnose import AddEffects, Diagnose
from workbench.session.commands.identify import Identify
from workbench.session.journal.entry import Ending, Entry
from workbench.views.recording.recorder import recorder

SIZE = 4e-4
SENTENCE = "Joint 2 winds up by"


@final
@dataclass(frozen=True)
class WarmJoint(AbstractEffect):
    """A joint whose zero follows the temperature; a law and a sentence."""

    name = "warm-joint"
    needs = ("temperature",)

    def law(self, chain, motion, wrenches):
        warmer = motion.need("temperature", self.name) - 20.0
        return np.tile(warmer[:, None, None], (1, 1, len(self.joints))) * np.eye(len(self.joints))

    def sentence(self, chain, motion):
        return f"{self.where} follows the temperature by {self.size(chain)} per kelvin"


@final
@dataclass(frozen=True)
class Shrink(AbstractEffect):
    """All joints read too little alike, with three elements and one coefficient."""

    name = "shrink"
    whole_arm = True

    def elements(self, chain):
        return tuple(chain.elements[chain.driven[j]].name for j in range(3))

    def law(self, chain, motion, wrenches):
        return -np.sin(motion.q[:, :3, None])

    def sentence(self, chain, motion):
        return f"the arm shrinks by {self.size(chain)}"


@final
@dataclass(frozen=True)
class Slump(AbstractEffect):
    """Joints 2 and 3 give way together; of the whole arm, and by loads."""

    name = "slump"
    whole_arm = True
    loads = Loads.OWN

    def elements(self, chain):
        return driven_names(chain, (1, 2))

    def law(self, chain, motion, wrenches):
        return -(own(chain, (1, 2), wrenches)[:, :, None] ** 3)

    def sentence(self, chain, motion):
        return f"The arm slumps by {self.size(chain)}"


KINDS = (GearSag, WarmJoint, Shrink, Slump)


@pytest.fixture(scope="module", autouse=True)
def registered():
    forget = register(Parts(effects=KINDS))
    yield
    forget()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("foreign")


@pytest.fixture(scope="module")
def found(folder):
    """The session of an app in which a file of such an arm was diagnosed, and the effect added."""
    _, rows = measure_poses(load_robot("aria"), 90, effects=(f"gear-sag:2:{SIZE}",), seed=2)
    path = write_measurements(rows, folder / "sag.csv")
    worker = Worker(start(load_robot("aria"), load_plate("table2")), views=[])
    try:
        for command in (LoadData(path.name, path.read_bytes()), Identify(), Diagnose(), AddEffects()):
            worker.submit(command)
            assert worker.wait(120.0)
        return worker.session
    finally:
        worker.close()


def check_found(diagnosis):
    (accepted,) = diagnosis.effects
    assert isinstance(accepted.effect, GearSag)
    assert accepted.effect.joints == (1,)
    assert accepted.effect.coefficients[0] == pytest.approx(SIZE, abs=4.0 * accepted.std[0])
    assert accepted.text.startswith(SENTENCE)
    assert diagnosis.message.startswith(SENTENCE)
    assert str(diagnosis.verdict) == "explained"


@pytest.mark.extra("trajectories")
def test_from_the_simulator_to_the_corrected_path_at_the_command_line(run):
    options = ("--robot", "aria", "--poses", "90", "--effect", f"gear-sag:2:{SIZE}", "--seed", "2")
    assert run("simulate", *options, "--out", "sag.csv")[0] == 0
    options = ("--save", "sag.toml", "--report", "report", "--json", "r.json")
    status, out, err = run("diagnose", "sag.csv", "--robot", "aria", *options)
    assert status == 0, err
    assert SENTENCE in " ".join(out.split())
    result = json.loads(Path("r.json").read_text())
    assert [(e["name"], e["joints"]) for e in result["effects"]] == [("gear-sag", [2])]
    assert result["effects"][0]["p_value"] < 1e-20
    assert result["message"].startswith(SENTENCE)
    page = Path("report/diagnosis.html").read_text()
    assert mentions(page, "gear-sag, joint 2")

    calibrated = read_toml(Path("sag.toml"))
    assert isinstance(calibrated.effects[0], GearSag)
    q = np.linspace([0.2, -0.4, 0.5, 0.0, 0.4, 0.0], [0.6, -0.2, 0.7, 0.2, 0.6, 0.1], 12)
    header = ",".join(["time[s]", *(f"q{j + 1}[rad]" for j in range(6))])
    np.savetxt("path.csv", np.column_stack([np.arange(12), q]), delimiter=",", header=header, comments="")
    options = ("--robot", "sag.toml", "--nominal", "aria", "--out", "corrected.csv")
    status, _, err = run("compensate", "path.csv", *options)
    assert status == 0, err
    corrected = read_trajectory("corrected.csv", joints=6).q
    nominal, here = load_robot("aria"), calibrated.base.pose
    reached = np.linalg.inv(here) @ tool_poses(calibrated, Motion(corrected))
    wanted = tool_poses(nominal.with_frames(base=nominal.base, tool=calibrated.tool), Motion(q))
    wanted = np.linalg.inv(nominal.base.pose) @ wanted
    assert np.linalg.norm((reached - wanted)[:, :3, 3], axis=1).max() < 1e-6


def test_the_app_finds_adds_and_compares_it(found):
    check_found(found.results.diagnosis)
    assert [type(e) for e in found.results.accepted] == [GearSag]
    run = found.results.identification.runs[found.results.fit]
    assert [type(e) for e in run.calibrated.effects] == [GearSag]
    assert run.held_out.position_mm.mean < 0.15
    assert any(SENTENCE in message.text for message in found.page.messages)


def test_the_recording_tells_it(found, folder):
    keeper = recorder(folder)
    keeper.begin(found, step=0, at=0.0, notify=print)
    keeper.note(1, Entry(Diagnose(), Ending.DONE, 0, 0.0, 0.0, at=1.0), found)
    keeper.close()
    stated, drawn = "", set()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that a file has no index
        for chunk in RrdReader(folder / "session.rrd").stream():
            drawn.add(chunk.entity_path)
            if chunk.entity_path == "/diagnosis/words":
                stated += str(chunk.to_record_batch().column("TextDocument:text").to_pylist())
    assert SENTENCE in stated
    assert mentions(stated, "gear-sag, joint 2")
    assert "/diagnosis/ranking" in drawn


def test_sizes_have_defaults():
    """A law and a sentence make an example that shows, and units."""
    robot = load_robot("aria")
    rng = np.random.default_rng(0)
    for name in ("gear-sag", "warm-joint", "shrink"):
        (effect,), _ = hidden_effects(robot, [name], rng=rng)
        assert effect.units(robot.with_effects(effect).chain) == ("rad",)


def test_a_saved_arm_comes_back(tmp_path):
    warm = load_robot("aria").with_effects(WarmJoint((2, 4), (1e-5, 2e-5)), Shrink((), (1e-4,)))
    again = read_toml(write_toml(warm, tmp_path / "warm.toml"))
    assert again.effects == warm.effects
    assert list(again.coefficients) == ["joint3.warm_joint", "joint5.warm_joint", "arm.shrink"]
    with pytest.raises(RobotError, match="whole"):
        warm.with_effects(Shrink((1,)))


def test_measured_rows_know_their_drivers(folder, found):
    """What the simulator wrote for a foreign effect is what its law needs."""
    rows = read_measurements(folder / "sag.csv")
    assert rows.payload is not None
    assert np.ptp(rows.payload) > 0.0
    _, warm = measure_poses(load_robot("aria"), 20, effects=("warm-joint:3",), seed=1)
    assert warm.temperature is not None
