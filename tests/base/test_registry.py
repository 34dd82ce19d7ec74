"""Registries: classes or objects, once or again, and plug-ins of which some are broken."""

import threading
import warnings
from abc import ABC, abstractmethod
from importlib.metadata import EntryPoint, EntryPoints
from types import ModuleType

import pytest
from refusals import refuses

from workbench.base import registry
from workbench.base.errors import OptionError
from workbench.base.registry import Registry


class AbstractTool(ABC):
    name: str

    @abstractmethod
    def use(self) -> int: ...


class Hammer(AbstractTool):
    name = "hammer"

    def use(self) -> int:
        return 1


class Sized(AbstractTool):
    def __init__(self, name):
        self.name = name

    def use(self) -> int:
        return 2


def tools(*parts, group="tests.tools", classes=False):
    return Registry("tool", AbstractTool, *parts, group=group, classes=classes)


def again(value, name="saw"):
    """A class as a notebook cell defines it each time that it runs."""
    return type("Saw", (AbstractTool,), {"name": name, "use": lambda self: value, "__module__": "__main__"})


def test_a_class_will_do_where_objects_are_wanted():
    known = tools()
    assert known.register(Hammer) is Hammer
    assert known["hammer"].use() == 1
    made = Sized("file")
    assert known.register(made) is made
    assert [*known] == ["hammer", "file"]


@pytest.mark.parametrize(
    ("part", "classes", "message"),
    [
        (Sized, False, "Sized needs arguments"),
        (Hammer(), True, "is a class"),
        (object(), False, "must derive from AbstractTool"),
        (dict, True, "must derive from AbstractTool"),
        (AbstractTool, False, "lacks use"),
        (Sized(None), False, "lacks name"),
    ],
)
def test_the_wrong_kind_is_refused_at_once(part, classes, message):
    known = tools(classes=classes)
    with pytest.raises(OptionError, match=message):
        known.register(part)
    assert not known


@pytest.mark.parametrize("classes", [False, True])
def test_a_cell_that_runs_again_replaces_its_own(classes):
    known = tools(Hammer, classes=classes)
    known.register(again(3))
    known.register(again(4))
    assert (known["saw"]() if classes else known["saw"]).use() == 4
    with refuses(OptionError, option="tool", found="hammer"):
        known.register(again(5, "hammer"))
    known.register(again(6))
    assert [*known] == ["hammer", "saw"]


def test_nobody_replaces_what_came_with_the_package():
    known = tools(Sized("file"))
    with refuses(OptionError, option="tool", found="file"):
        known.register(Sized("file"))


def test_functions_go_by_their_own_names():
    known = Registry("drawing", None, group="tests.drawings")

    @known.register
    def circle():
        return 1

    assert known["circle"] is circle
    with refuses(OptionError, option="drawing", found=Hammer):
        known.register(Hammer)


def entries(monkeypatch, *points):
    found = EntryPoints(EntryPoint(name, value, "tests.tools") for name, value in points)
    monkeypatch.setattr(registry, "_entry_points", lambda: found)


def test_a_broken_plug_in_costs_one_warning(monkeypatch):
    entries(
        monkeypatch,
        ("first", "no_such_module_of_anybody:Thing"),
        ("second", f"{__name__}:Hammer"),
        ("third", f"{__name__}:AbstractTool"),
        ("fourth", f"{__name__}:no_such_name"),
        ("fifth", f"{__name__}:FILE"),
    )
    known = tools()
    with pytest.warns(RuntimeWarning) as reported:
        assert [*known] == ["hammer", "file"]
    messages = [str(w.message) for w in reported]
    assert len(messages) == 3
    for message, name, why in zip(
        messages, ("first", "third", "fourth"), ("no_such_module", "lacks use", "no_such_name"), strict=True
    ):
        assert f"'{name}'" in message
        assert why in message
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert known["file"].use() == 2


FILE = Sized("file")


def test_two_plug_ins_cannot_share_a_name(monkeypatch):
    module = ModuleType("somebody_else")
    module.THEIRS = Sized("file")
    monkeypatch.setitem(__import__("sys").modules, "somebody_else", module)
    entries(monkeypatch, ("a", f"{__name__}:FILE"), ("b", "somebody_else:THEIRS"))
    with pytest.warns(RuntimeWarning, match="'b'"):
        assert tools()["file"] is FILE


def test_a_second_thread_waits_until_all_are_there(monkeypatch):
    begun, go, seen = threading.Event(), threading.Event(), []

    class Slow(EntryPoint):
        def load(self):
            begun.set()
            go.wait(60.0)
            return Hammer

    point = Slow("hammer", "somewhere:Hammer", "tests.tools")
    monkeypatch.setattr(registry, "_entry_points", lambda: EntryPoints([point]))
    known = tools()
    threads = [threading.Thread(target=lambda: seen.append([*known])) for _ in range(2)]
    threads[0].start()
    begun.wait(60.0)
    threads[1].start()
    go.set()
    for thread in threads:
        thread.join(60.0)
    assert seen == [["hammer"], ["hammer"]]
