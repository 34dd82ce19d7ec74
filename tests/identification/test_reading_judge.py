"""A judge of what rows are taken to mean: files by other code, each changed in one way or in none.

A file is right if its reading predicts what would be measured at postures that it doesn't hold. Silence about
a file that is wrong is the worst, then a wrong claim, then valid rows that are refused.
"""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from generator import VirtualArm, shift, turn
from scipy.spatial.transform import Rotation

from tests.identification.test_meaning import ARMS, H
from workbench import Dataset, Robot
from workbench.base.errors import DataError
from workbench.data.orientations import ORIENTATIONS, WrittenOrientation
from workbench.identification.meaning.as_read import as_read, understood
from workbench.identification.meaning.read_rows import read_rows

FANUC = [(0, 0, 0.055, -H), (-H, 0, 0.345, np.pi), (0, 0, 0.03, -H), (0, -0.36, 0, H), (0, 0, 0, -H),
         (0, -0.085, 0, np.pi)]  # fmt: skip
UR = [(0, 0.15, 0, H), (0, 0, -0.43, 0), (0, 0, -0.39, 0), (0, 0.11, 0, H), (0, 0.09, 0, -H), (0, 0.08, 0, 0)]
FIVE = [(0, 0.2, 0, H), (0, 0, 0.19, 0), (0, 0, 0.14, 0), (H, 0, 0, H), (0, 0.2, 0, 0)]
MADE = ARMS | {"fanuc": (FANUC, "rrrrrr"), "ur": (UR, "rrrrrr"), "five": (FIVE, "rrrrr")}
KINDS = ("plain", "plain", "plain", "own base", "signs", "signs", "coupling", "coupling and signs",
         "exchange", "zero", "free zero", "unit of joints", "unit of lengths", "convention", "inverse",
         "foreign")  # fmt: skip
FRESH = 30


class File:
    """One arm, where it stands, what it moved, and how a file shows that."""

    def __init__(self, seed: int):
        rng = self.rng = np.random.default_rng(seed)
        self.kind = KINDS[seed % len(KINDS)]
        name = rng.choice([n for n in MADE if "coupling" not in self.kind or n in ("fanuc", "ur", "puma")])
        table, self.kinds = MADE[name]
        n, with_rotation = len(table), bool(rng.random() < 0.6) or self.kind in ("convention", "inverse")
        made = np.array(table, float) + rng.uniform(-1e-3, 1e-3, (n, 4))
        self.turns = np.array([kind == "r" for kind in self.kinds])
        if self.kind == "foreign":
            made[:, 1:3] *= rng.uniform(0.6, 1.4, (n, 2))
        base = shift(rng.uniform(-1.5, 1.5, 3)) @ turn("z", rng.uniform(-3, 3))
        base = base @ turn("x", rng.uniform(-0.5, 0.5))
        base = np.eye(4) if self.kind == "own base" else base
        tool = shift(rng.uniform(0.03, 0.12, 3)) @ turn("y", rng.uniform(-1, 1))
        rows = int(rng.integers(20, 80))
        q = rng.uniform(-1, 1, (rows + FRESH, n)) * np.where(self.turns, rng.uniform(1.2, 2.2), 0.4)
        made = np.pad(made, ((0, 0), (0, 1)))
        poses = VirtualArm("dh", made, base, tool, slides=tuple(~self.turns)).pose(q)
        self.columns, self.w, self.zero = self._shown(q)
        xyz, rotation = poses[:, :3, 3] + rng.normal(0.0, 3e-5, (rows + FRESH, 3)), poses[:, :3, :3]
        if self.kind == "inverse":
            rotation = np.swapaxes(rotation, 1, 2)
            xyz = -(rotation @ xyz[..., None])[..., 0]
        if self.kind == "unit of lengths":
            xyz = xyz * rng.choice([1e3, 1e-3])
        self.rotation, self.xyz = rotation if with_rotation else None, xyz
        keys = ("theta", "d", "a", "alpha")
        joints = [
            {"type": "prismatic" if k == "p" else "revolute", **dict(zip(keys, row, strict=True))}
            for row, k in zip(table, self.kinds, strict=True)
        ]
        self.robot = Robot.from_dh(joints, name=name)
        self.rows = self._dataset(slice(0, rows))
        self.fresh = slice(rows, None)

    def _shown(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        n, rng = len(self.kinds), self.rng
        w, zero, signs = np.eye(n), np.zeros(n), np.diag(rng.choice([-1.0, 1.0], n))
        turning = np.flatnonzero(self.turns)
        signs[(k := rng.choice(n)), k] = -1.0
        inner = [k for k in turning if 0 < k < n - 1]
        if self.kind == "signs":
            w = signs
        elif self.kind.startswith("coupling"):
            w[2, 1] = rng.choice([-1.0, 1.0])
            w = w @ signs if "signs" in self.kind else w
        elif self.kind == "exchange":
            i, j = rng.choice(turning, 2, replace=False)
            w[[i, j]] = w[[j, i]]
        elif self.kind == "zero" and inner:
            zero[rng.choice(inner)] = H * rng.choice([-1, 1, 2])
        elif self.kind == "free zero" and inner:
            zero[rng.choice(inner)] = rng.uniform(0.4, 1.4) * rng.choice([-1, 1])
        elif self.kind == "unit of joints":
            w = np.diag(np.where(self.turns, np.pi / 180.0, 1.0))
        return q @ w.T + zero, w, zero

    def _dataset(self, rows: slice) -> Dataset:
        rotation, written = self.rotation, None
        if rotation is not None and self.kind == "convention":
            kinds = [k for k in ORIENTATIONS if k.numbers == 3]
            kind = kinds[self.rng.integers(len(kinds))]
            turned = Rotation.from_matrix(rotation)
            numbers = turned.as_rotvec() if kind.name == "rotvec" else turned.as_euler(kind.name)
            name = self.rng.choice(["rotvec", "xyz"])
            declared = next(k for k in ORIENTATIONS if k.name == name)
            written = WrittenOrientation(declared.name, numbers[rows])
            rotation = declared.matrices(numbers)
        return Dataset(
            q=self.columns[rows],
            position=self.xyz[rows],
            rotation=None if rotation is None else rotation[rows],
            written=written,
            source=self.kind,
        )

    def off(self, found) -> float:
        """How far a reading's points are from those at fresh postures, as a share of the reach."""
        best, columns = found.best, self.columns[self.fresh]
        flange = best.base @ best.robot.bare.predict(best.joints(columns)) @ best.tool
        if best.inverse:
            flange = np.linalg.inv(flange)
        points = flange[:, :3, 3] @ best.axes.T
        distance = np.linalg.norm(points - best.scale * self.xyz[self.fresh], axis=1)
        return float(distance.max() / self.robot.reach)


def judged(seed: int) -> tuple[str, str]:
    """Kind of a file, and what became of it."""
    file = File(seed)
    try:
        rows, refused = as_read(file.robot, file.rows)[1], False
    except DataError:
        rows, refused = file.rows, True
    if file.kind in ("plain", "own base"):
        return file.kind, "refused" if refused else "right"
    if file.kind == "convention" and not refused:
        is_right = bool(np.abs(rows.rotation - file.rotation[: len(rows)]).max() < 1e-6)
        return file.kind, "right" if is_right else "wrong"
    _, found = understood(file.robot, file.rows)  # as it was read above
    assert found is not None
    said = refused or len(rows.notes) > len(file.rows.notes)
    if file.off(found) < (0.02 if file.kind == "foreign" else 0.012):  # a calibration absorbs as much
        return file.kind, "right"
    if file.kind == "foreign":
        return file.kind, "right" if said and not found.is_found else "wrong"
    return file.kind, "said open" if said and not found.is_found else "wrong"


def judge(seeds: range) -> tuple[Counter, list[tuple[int, str, str]]]:
    outcomes = [(seed, *judged(seed)) for seed in seeds]
    return Counter(outcome for *_, outcome in outcomes), [o for o in outcomes if o[2] != "right"]


def test_few_files_of_every_kind():
    seeds = range(32)
    count, other = judge(seeds)
    assert count["right"] >= len(seeds) - 1, other
    assert not count["wrong"], other
    assert not count["refused"], other


@pytest.mark.parametrize("seed", [18, 21, 36, 40])  # as given, two of signs, an exchange
def test_sessions_of_five_rows_are_read_together(seed):
    """Alone, with a base and a tool of their own, they would fit nearly anything."""
    file = File(seed)
    rows, rng, session = file.rows, np.random.default_rng(seed), np.arange(len(file.rows)) // 5
    elsewhere = [shift(rng.uniform(-1, 1, 3)) @ turn("z", rng.uniform(-3, 3)) for _ in range(20)]
    where = np.array([np.eye(4), *elsewhere])[session]
    position = (where[:, :3, :3] @ rows.position[..., None])[..., 0] + where[:, :3, 3]
    rotation = None if rows.rotation is None else where[:, :3, :3] @ rows.rotation
    rows = replace(rows, position=position, rotation=rotation, session=np.char.zfill(session.astype(str), 2))
    found = read_rows(file.robot, rows)
    assert found.is_found
    assert file.off(found) < 0.012


@pytest.mark.slow
def test_many_files_of_every_kind():
    seeds = range(32, 288)
    count, other = judge(seeds)
    assert not count["wrong"], other
    assert count["refused"] <= 0.01 * len(seeds), other
    assert count["right"] + count["said open"] >= 0.99 * len(seeds), other
    assert count["right"] >= 0.95 * len(seeds), other
