"""What is drawn, without any viewer: made only where its inputs have changed, and then always."""

from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pytest

from workbench import Motion, load_robot, tool_poses
from workbench.base import se3
from workbench.base.assets import built_in_robots
from workbench.session.state import Focus, Measurements
from workbench.views.appearance.bodies import body_frames, make_bodies
from workbench.views.drawables.plate import plate
from workbench.views.drawables.scene_contents import items
from workbench.views.drawables.sink import AbstractSink, Item, is_same


class Notebook(AbstractSink):
    """Notes what a view would be told."""

    def __init__(self):
        super().__init__()
        self.there, self.made, self.shown = {}, [], set()

    def puts_off(self, item):
        return item.can_wait or not item.shown

    def show(self, path, drawn, *, is_shown):
        self.shown = self.shown | {path} if is_shown else self.shown - {path}

    def change(self, item, old, new):
        assert (old is None) == (item.path not in self.there)
        self.there[item.path] = new
        self.made.append(item.path)
        self.shown.add(item.path)

    def remove(self, path):
        del self.there[path]
        self.shown.discard(path)


def test_a_plate_that_was_given_is_drawn_beside_measured_rows(first):
    """As `wb.show(robot, data, plate)` shows them; a plate that nobody gave stays out of the way."""
    rows = Measurements(loaded=SimpleNamespace(virtual=False))
    for is_given in (True, False):
        given = replace(first, is_plate_given=is_given, measurements=rows)
        shown = {item.path: item.shown for item in plate(given.updated("playback", focus=Focus.ROW))}
        assert shown["plate/solid"] is shown["plate/targets/1"] is is_given
    assert all(item.shown for item in plate(first))


def moved(session, number, by):
    target = session.plate.targets[number]
    targets = list(session.plate.targets)
    targets[number] = replace(target, xyz=target.xyz + by)
    return replace(session, plate=replace(session.plate, targets=tuple(targets)))


def test_only_what_has_changed_is_made(first):
    sink = Notebook()
    sink.draw(items(first, on_page=True))
    assert {"arm/nominal", "plate/solid", "plate/targets/10/number", "region/outline"} <= set(sink.made)
    sink.made.clear()
    sink.draw(items(replace(first, page=replace(first.page, revision=first.page.revision + 1)), on_page=True))
    assert sink.made == []
    then = moved(first, 3, 0.01)
    sink.draw(items(then, on_page=True))
    assert sink.made == ["plate/targets/4", "plate/targets/4/number"]
    sink.made.clear()
    sink.draw(items(replace(then, selected=2), on_page=True))
    assert sink.made == ["arm/nominal", "plate/targets/1", "plate/targets/3"]


def test_what_is_drawn_step_by_step_is_what_is_drawn_at_once(first):
    sink = Notebook()
    fewer = replace(first.plate, targets=first.plate.targets[:7])
    steps = [
        first,
        replace(first, selected=4),
        moved(first, 0, 0.02),
        replace(first, plate=fewer, states=first.states[:7]),
        first,
    ]
    for step in steps:
        sink.draw(items(step, on_page=True))
        fresh = Notebook()
        fresh.draw(items(step, on_page=True))
        assert sink.shown == fresh.shown
        for path in fresh.shown:
            one, other = sink.there[path], fresh.there[path]
            for f in fields(one):
                if f.name != "solid":
                    assert is_same(getattr(one, f.name), getattr(other, f.name)), (path, f.name)


def test_what_is_hidden_is_made_when_it_is_shown(first):
    requested, sink = [], Notebook()
    make = lambda size: requested.append(size) or SimpleNamespace(size=size)  # noqa: E731
    for size, shown in ((1, False), (2, False), (3, True), (3, False), (4, False), (4, True)):
        sink.draw([Item("thing", make, (size,), shown=shown)])
        assert ("thing" in sink.shown) is shown
    assert requested == [3, 4]
    sink.draw([])
    assert sink.there == {}


@pytest.mark.parametrize("name", built_in_robots())
def test_the_last_body_ends_at_the_tool(name):
    robot = load_robot(name)
    q = np.random.default_rng(3).uniform(-1, 1, robot.dof)
    bodies, frames = make_bodies(robot), body_frames(robot, q)
    assert len(bodies) == len(frames) == robot.dof + 1
    tool = (se3.inverse(robot.base.pose) @ tool_poses(robot, Motion(q[None]))[0])[:3, 3]
    vertices = se3.apply(frames[-1], bodies[-1].solid.vertices)
    assert np.linalg.norm(vertices - tool, axis=1).min() < 0.06 * robot.reach
