"""Clusters for people and programs."""

from rich.console import Group, RenderableType
from rich.text import Text

from workbench.arm.joint_units import shown_joints
from workbench.base.wording import plural
from workbench.extras.poses.clustering.search import Cluster, Clustering
from workbench.plate.report.plates import Json, number_or_open
from workbench.report.tables import new_table

CLUSTERING = "workbench.clustering/1"
EQUAL = 1e-6
"""Relative difference of O below which it is called equal."""


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
    sets = new_table("Sets with equal O", "", "cubes", "O apart [%]", "rank", "σmin/σmax", found.index)
    for text, cluster in (
        ("the best", found.best),
        ("the first found", found.plain),
        ("joint 1 alone turned", found.turned),
    ):
        numbers = (f"{100 * cluster.difference:.2g}", str(cluster.rank))
        values = (number_or_open(cluster.stacked), number_or_open(cluster.value))
        sets.add_row(text, str(len(cluster.cubes)), *numbers, *values)
    difference = found.best.difference
    equal = (
        "O is equal in all poses"
        if difference < EQUAL
        else f"O is equal to {100 * difference:.2g} % in all poses"
    )
    return Group(poses, sets, Text(equal))


def cluster_json(found: Clustering) -> Json:
    sets = {"best": found.best, "plain": found.plain, "turned": found.turned}
    return {
        "schema": CLUSTERING,
        "robot": found.robot.name,
        "index": found.index,
        "region": {
            "min": found.region.min,
            "max": found.region.max,
            "cube": found.region.cube,
            "cells": found.region.size / found.region.shape,
        },
        **{name: _cluster_json(cluster) for name, cluster in sets.items()},
    }


def _cluster_json(cluster: Cluster) -> Json:
    return {
        "q": cluster.q,
        "O": cluster.o,
        "difference": cluster.difference,
        "cubes": cluster.cubes,
        "rank": cluster.rank,
        "stacked_ratio": cluster.stacked,
        "index": cluster.value,
    }
