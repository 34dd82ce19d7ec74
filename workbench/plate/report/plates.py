"""Plates for people and programs: scores target by target and side by side."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Group, RenderableType
from rich.markup import escape
from rich.text import Text

from workbench.arm.confounded_constants import combinations
from workbench.arm.parameters import Parameter
from workbench.plate.observability import INDICES, I
from workbench.plate.plate_score import PlateScore, SetScore
from workbench.plate.region_poses import PLATE_CONE
from workbench.plate.target_readings import assumptions
from workbench.report.json import Json, document
from workbench.report.result_display import plot_of, summary_of
from workbench.report.result_fields import DEG, MM, ResultField, ResultFields
from workbench.report.tables import new_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SCORE = "workbench.plate-score/1"
COMPARISON = "workbench.plate-comparison/1"


@summary_of.register
def score_tables(score: PlateScore) -> RenderableType:
    """Target by target, then the set in the mixed and in the best single branch."""
    targets = new_table(
        f"{score.plate.name} for {score.robot.name}", "target", "branch", "O", "share of I [%]"
    )
    chosen = score.measured
    for k, branch in enumerate(chosen.branches):
        if why := score.can.lacking.get(k):
            targets.add_row(str(k + 1), escape(why), "–", "–")
            continue
        targets.add_row(
            str(k + 1), escape(branch), f"{chosen.per_target[k]:.4f}", f"{100 * chosen.shares[k]:.1f}"
        )
    sets = new_table("The set", "", "branches above", "one branch")
    for what, cells in _set_rows([chosen, score.single]):
        sets.add_row(escape(what), *cells)
    sentences = [
        f"predicted errors: {score.region_rows} joint positions in the region, any branch, rotated from a "
        f"target by up to {np.rad2deg(PLATE_CONE):.0f}°",
        f"included: {assumptions(score.plate, score.sigma)}",
        f"scaling: rows by these deviations, angles as arcs at {score.length:.3f} m (the arm's reach); O and "
        "σmin/σmax unscaled, as in the paper",
        "one branch: " + (escape(score.single_branch) if score.single else "none reaches all targets"),
    ]
    if score.left_out:
        sentences.insert(0, score.left_out)
    if chosen.rank < chosen.visible:
        sentences.append(f"indistinguishable: {'; '.join(_open_text(chosen))}; vary targets or branches")
    return Group(targets, sets, Text("\n".join(sentences)))


def comparison_table(scores: Sequence[PlateScore], stated: Sequence[PlateScore]) -> RenderableType:
    """Plates side by side, with the smallest predicted error named.

    Args:
        scores: With equal tolerances for all plates.
        stated: With each plate's own tolerances.
    """
    table = new_table("Plates under equal assumptions", "", *(s.plate.name for s in scores))
    table.add_row("targets", *(str(len(s.plate)) for s in scores))
    for what, cells in _set_rows([s.measured for s in scores]):
        table.add_row(escape(what), *cells)
    single = [_cell(s.single, lambda one: 1e3 * one.error.position_rms) for s in scores]
    table.add_row(escape("position error with one branch, rms [mm]"), *single)
    sentences = [
        *_included(scores),
        *(s.left_out for s in scores if s.left_out),
        f"errors are predicted in the region of {scores[0].plate.name}, about its orientations",
        f"smallest predicted position error: {_best(scores)}",
    ]
    tables: list[RenderableType] = [table]
    if any(s.plate.assumptions != c.plate.assumptions for s, c in zip(stated, scores, strict=True)):
        own = new_table(
            "With the plates' own tolerances (not comparable)", "", *(s.plate.name for s in stated)
        )
        for what, cells in _set_rows([s.measured for s in stated])[:3]:
            own.add_row(escape(what), *cells)
        tables.append(own)
        sentences += _each_includes(stated)
    return Group(*tables, Text("\n".join(sentences)))


def _included(scores: Sequence[PlateScore]) -> list[str]:
    """What errors include, once where it is the same for all plates."""
    held = {assumptions(s.plate, s.sigma) for s in scores}
    return [f"all include: {held.pop()}"] if len(held) == 1 else _each_includes(scores, ", made alike,")


def _each_includes(scores: Sequence[PlateScore], how: str = "") -> list[str]:
    return [f"{s.plate.name}{how} includes: {assumptions(s.plate, s.sigma)}" for s in scores]


def _best(scores: Sequence[PlateScore]) -> str:
    return min(scores, key=lambda s: s.measured.error.position_rms).plate.name


def _set_rows(sets: Sequence[SetScore | None]) -> list[tuple[str, list[str]]]:
    """Label and one cell per set: predicted errors, rank, indices."""
    rows: list[tuple[str, list[str]]] = [
        ("position error, rms [mm]", [_cell(s, lambda s: 1e3 * s.error.position_rms) for s in sets]),
        ("position error, mean [mm]", [_cell(s, lambda s: 1e3 * s.error.position_mean) for s in sets]),
        ("orientation error, rms [°]", [_cell(s, lambda s: np.rad2deg(s.error.rotation_rms)) for s in sets]),
        ("rank", ["–" if s is None else f"{s.rank} of {s.visible}" for s in sets]),
        ("σmin/σmax of the stacked Jacobian", [_cell(s, lambda s: s.stacked) for s in sets]),
    ]
    meanings = {name: index.meaning for name, index in INDICES.items()} | {I.name: I.meaning}
    for name, meaning in meanings.items():
        cells = ["–" if s is None else number_or_open(s.indices[name]) for s in sets]
        rows.append((f"{name}: {meaning}", cells))
    return rows


def _open_text(score: SetScore) -> list[str]:
    """Combinations that a set doesn't determine, as text."""
    parameters = tuple(Parameter(n, "", 0.0) for n in score.names)
    return [found.text for found in combinations(score.open, parameters)]


def _cell(score: SetScore | None, value) -> str:
    return "–" if score is None else number_or_open(value(score))


def number_or_open(value: float) -> str:
    return f"{value:.4g}" if np.isfinite(value) else "open"


def score_json(score: PlateScore) -> Json:
    """The same in SI, with angles in rad but errors in mm and degrees as everywhere."""
    return document(SCORE, **_plate_json(score))


def comparison_json(scores: Sequence[PlateScore], stated: Sequence[PlateScore]) -> Json:
    """Scores of several plates, all made alike, and what each would be as its own file says."""
    return document(
        COMPARISON,
        robot=scores[0].robot.name,
        region_of=scores[0].plate.name,
        best=_best(scores),
        plates=[
            {
                **_plate_json(score),
                "as_stated": {
                    "holds": assumptions(own.plate, own.sigma),
                    "predicted": PREDICTED.json(own.measured.error),
                },
            }
            for score, own in zip(scores, stated, strict=True)
        ],
    )


def _plate_json(score: PlateScore) -> Json:
    return {
        "robot": score.robot.name,
        "plate": score.plate.name,
        "noise": {"position_mm": 1e3 * score.sigma[0], "orientation_deg": np.rad2deg(score.sigma[1])},
        "holds": assumptions(score.plate, score.sigma),
        "left_out": score.left_out,
        "scaling_length_m": score.length,
        "targets": [
            {"target": k + 1, "branch": branch, "q": score.measured.q[k], "O": o, "share": share}
            | ({"blocked": score.can.hits[k]} if score.can.hits[k] else {})
            | ({"out_of_reach": score.can.away[k]} if score.can.away[k] else {})
            for k, (branch, o, share) in enumerate(
                zip(score.measured.branches, score.measured.per_target, score.measured.shares, strict=True)
            )
        ],
        "set": SET.json(score.measured),
        "one_branch": score.single and {"branch": score.single_branch, **SET.json(score.single)},
    }


def _sizes(kind: str) -> ResultFields:
    """Mean, rms and maximum of a predicted error."""
    largest = ResultField("max", of=lambda error: getattr(error, kind).max(initial=0.0))
    return ResultFields(ResultField("mean", of=f"{kind}_mean"), ResultField("rms", of=f"{kind}_rms"), largest)


PREDICTED = ResultFields(
    ResultField("position", MM, of=lambda error: error, each=_sizes("position")),
    ResultField("orientation", DEG, of=lambda error: error, each=_sizes("rotation")),
)
"""Of a `PredictedError`."""
SET = ResultFields(
    ResultField("predicted", of="error", each=PREDICTED),
    "indices",
    ResultField("stacked_ratio", of="stacked"),
    "rank",
    "visible",
    ResultField("parameters", of=lambda score: len(score.names)),
    ResultField("open", of=_open_text),
)
"""Of the `SetScore` of one set of measurements."""


@plot_of.register(PlateScore)
def _figure(score: PlateScore) -> "Figure":
    from workbench.plate.report.figures import score_figure

    return score_figure(score)
