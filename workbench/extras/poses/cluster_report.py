"""Clusters for people and programs."""

from collections.abc import Iterator

from workbench.arm.joint_units import shown_joints
from workbench.base.wording import plural
from workbench.extras.poses.clustering import Clustering
from workbench.plate.report.plates import number_or_open
from workbench.report.blocks import Block, ResultTable, Sentence
from workbench.report.json import Json, document
from workbench.report.result_fields import ResultField, ResultFields

CLUSTERING = "workbench.clustering/1"
EQUAL = 1e-6
"""Relative difference of O below which it is called equal."""
REGION = ResultFields("min", "max", "cube")
CLUSTER = ResultFields(
    "q",
    ResultField("O", of="o"),
    ResultField("cubes", title="cubes", text=lambda cubes: str(len(cubes))),
    ResultField("difference", title="O apart [%]", text=lambda share: f"{100 * share:.2g}"),
    ResultField("rank", title="rank"),
    ResultField("stacked_ratio", of="stacked", title="σmin/σmax", text=number_or_open),
    ResultField("index", of="value"),
)
"""Of a `Cluster`."""


def cluster_blocks(found: Clustering) -> Iterator[Block]:
    """The poses with their cubes, and what equal O alone would have been worth."""
    cubes = found.region.centres[found.best.cubes]
    each = zip(cubes, found.best.o, shown_joints(found.robot, found.best.q), strict=True)
    poses = [
        (str(k), " ".join(f"{1e3 * v:.0f}" for v in cube), f"{o:.5f}", " ".join(f"{v:.1f}" for v in joints))
        for k, (cube, o, joints) in enumerate(each, 1)
    ]
    title = f"{plural(len(cubes), 'pose')}, one each of the {found.region.cube_text}, for {found.robot.name}"
    yield ResultTable(title, ("pose", "cube about [mm]", "O", "joints [°, mm]"), poses)
    sets = {"the best": found.best, "the first found": found.plain, "joint 1 alone turned": found.turned}
    rows = [(text, *CLUSTER.cells(one), number_or_open(one.value)) for text, one in sets.items()]
    yield ResultTable("Sets with equal O", ("", *CLUSTER.headings, found.index), rows)
    apart = found.best.difference
    yield Sentence(f"O is equal {'' if apart < EQUAL else f'to {100 * apart:.2g} % '}in all poses")


def cluster_json(found: Clustering) -> Json:
    region = found.region
    return document(
        CLUSTERING,
        robot=found.robot.name,
        index=found.index,
        region={**REGION.json(region), "cells": region.size / region.shape},
        best=CLUSTER.json(found.best),
        plain=CLUSTER.json(found.plain),
        turned=CLUSTER.json(found.turned),
    )
