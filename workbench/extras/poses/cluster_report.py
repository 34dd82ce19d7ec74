"""Clusters for people and programs."""

from rich.console import Group, RenderableType
from rich.text import Text

from workbench.arm.joint_units import shown_joints
from workbench.base.wording import plural
from workbench.extras.poses.clustering import Clustering
from workbench.plate.report.plates import number_or_open
from workbench.report.json import Json, document
from workbench.report.result_fields import ResultField, ResultFields
from workbench.report.tables import new_table

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


def cluster_tables(found: Clustering) -> RenderableType:
    """The poses with their cubes, and what equal O alone would have been worth."""
    cubes = found.region.centres[found.best.cubes]
    poses = new_table(
        f"{plural(len(cubes), 'pose')}, one each of the {found.region.cube_text}, for {found.robot.name}",
        "pose",
        "cube about [mm]",
        "O",
        "joints [°, mm]",
    )
    for k, (cube, o, q) in enumerate(zip(cubes, found.best.o, found.best.q, strict=True)):
        joints = " ".join(f"{v:.1f}" for v in shown_joints(found.robot, q))
        poses.add_row(str(k + 1), " ".join(f"{1e3 * v:.0f}" for v in cube), f"{o:.5f}", joints)
    sets = {"the best": found.best, "the first found": found.plain, "joint 1 alone turned": found.turned}
    table = new_table("Sets with equal O", "", *CLUSTER.headings, found.index)
    for text, cluster in sets.items():
        table.add_row(text, *CLUSTER.cells(cluster), number_or_open(cluster.value))
    difference = found.best.difference
    equal = (
        "O is equal in all poses"
        if difference < EQUAL
        else f"O is equal to {100 * difference:.2g} % in all poses"
    )
    return Group(poses, table, Text(equal))


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
