"""Other packages whose parts are broken in all ways: one warning names them, and everything else goes on."""

from textwrap import dedent

import numpy as np
import pytest
from other_process import commands, python
from refusals import mentions, refuses

import workbench as wb
from workbench.arm.effects import EFFECTS
from workbench.base.columns import COLUMNS, Column
from workbench.base.errors import OptionError
from workbench.base.registry import Registry
from workbench.base.units import Quantity
from workbench.data.observations import OBSERVATIONS, AbstractObservation
from workbench.session.cube_fields import CUBE_FIELDS, AbstractCubeField
from workbench.views.page.panels import PANELS
from workbench.views.page.panels.panel import AbstractPanel

OBSERVATION = """
from workbench.base.columns import Column
from workbench.base.units import Quantity
from workbench.data.observations.observation import AbstractObservation

class Part(AbstractObservation):
    {body}

    @classmethod
    def of(cls, data):
        return cls()

    channels = ()

    def linearise(self, poses, unknown):
        raise ZeroDivisionError
"""
LAYOUT = """
from workbench.data.readers.layouts.layout import AbstractTableLayout

class Part(AbstractTableLayout):
    name = "theirs"

    def matches(self, headings):
        return 1 / 0

    def read(self, table):
        return None
"""
EFFECT = """
from dataclasses import dataclass
from workbench.arm.effects.joint_compliance import JointCompliance

@dataclass(frozen=True)
class Part(JointCompliance):
    name = "broken-compliance"

    def law(self, chain, motion, wrenches):
        return 1 / 0
"""
BROKEN = {
    "commands": ("import sys; sys.exit('it needs a licence')", "effects"),
    "observations": (OBSERVATION.format(body='brings = ("height",)'), "observations"),
    "preparations": (OBSERVATION.format(body=""), "observations"),
    "layouts": (LAYOUT, "layouts"),
    "effects": (EFFECT, "effects"),
    "columns": (
        "from workbench.base.columns import Column\nfrom workbench.base.units import Quantity\n"
        'Part = Column(name="q2", quantity=Quantity.LENGTH)',
        "columns",
    ),
}


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rows")
    wb.write_measurements(
        wb.measure_poses("aria", 40, seed=1, effects="joint-compliance:2")[1], folder / "x.csv"
    )
    return folder / "x.csv"


def install(folder, name, code, group):
    """A package of one part."""
    (folder / name).mkdir(parents=True)
    (folder / name / "__init__.py").write_text("")
    (folder / name / "part.py").write_text(dedent(code))
    info = folder / f"{name}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[workbench.{group}]\npart = {name}.part:Part\n")
    return folder


@pytest.mark.parametrize("case", BROKEN)
def test_a_broken_part_costs_one_warning_and_no_command(rows, tmp_path, case):
    code, group = BROKEN[case]
    package = install(tmp_path / "theirs", "theirs", code, group)
    lines = ("--help", f"identify {rows} --robot aria", f"diagnose {rows} --robot aria")
    for ended in commands(*lines, folder=tmp_path, packages=(package,)):
        assert ended.status == 0, ended.err
    warned = [line for line in ended.err.splitlines() if line.startswith("workbench:")]
    assert len(set(warned)) <= 1


def test_a_part_has_what_its_kind_declares():
    class Untyped(AbstractPanel):
        tab, order = "plate", "first"

        def build(self, gui):
            pass

    class Nameless(AbstractCubeField):
        name = "nameless"
        choice = title = "Nameless"

        def values(self, session):
            return None

    class Bringing(AbstractObservation):
        brings = (Column(name="temperature", quantity=Quantity.TEMPERATURE),)
        columns = ("temperature",)
        channels = ()

        @classmethod
        def of(cls, data):
            return cls()

        def linearise(self, poses, unknown):
            return None

    for registry, part, wrong in (
        (PANELS, Untyped, "tab"),
        (CUBE_FIELDS, Nameless, "meaning"),
        (OBSERVATIONS, Bringing, "temperature"),
        (COLUMNS, Column(name="mine", quantity=Quantity.LENGTH, also=("q1",)), "q1"),
        (COLUMNS, Column(name="mine", quantity=Quantity.LENGTH, also="xyz"), "xyz"),
    ):
        before = tuple(registry)
        with refuses(OptionError, wrong):
            registry.register(part)
        assert tuple(registry) == before


def test_a_registry_that_could_not_be_read_is_read_again(monkeypatch):
    class Part:
        name = "one"

    parts, answers = Registry("part", Part, group="workbench.nothing"), [1, 0]

    def plugins(group, what, add):
        1 / answers.pop()
        add(Part, "theirs")
        yield "one", Part

    monkeypatch.setattr("workbench.base.registry.plugins", plugins)
    with pytest.raises(ZeroDivisionError):
        list(parts)
    assert list(parts) == ["one"]


def test_every_registered_effect_is_of_a_class_with_a_name():
    class Numbered(EFFECTS["joint-compliance"]):
        name = 5

    with refuses(OptionError):
        EFFECTS.register(Numbered)


def test_verbs_of_others_get_all_their_arguments(tmp_path):
    code = """
        def Part(*numbers, scale=1.0, **more):
            return sum(numbers) * scale, sorted(more)
        """
    package = install(tmp_path / "theirs", "theirs", code, "root")
    called = "import workbench as wb; print(wb.part(1, 2, scale=2.0, a=3))"
    assert python(called, folder=tmp_path, packages=(package,)) == "(6.0, ['a'])\n"


def test_a_warning_says_where_their_code_is_wrong(rows, tmp_path):
    package = install(tmp_path / "theirs", "theirs", "import json\n\njson.loads('x')\n", "algorithms")
    (ended,) = commands(f"identify {rows} --robot aria", folder=tmp_path, packages=(package,))
    (warning,) = [line for line in ended.err.splitlines() if "theirs" in line]
    assert mentions(warning, "theirs.part:Part", "part.py, line 3")


def test_names_that_are_taken_are_said(tmp_path):
    code = """
        def Part(number: int = 1) -> None:
            "Say a number."
        """
    first = install(tmp_path / "first", "first", code, "commands")
    second = install(tmp_path / "second", "second", code, "commands")
    (ended,) = commands("part --help", folder=tmp_path, packages=(first, second))
    assert ended.status == 0
    assert np.sum([mentions(line, "part") for line in ended.err.splitlines()]) == 1
