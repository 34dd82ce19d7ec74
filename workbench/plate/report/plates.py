"""Scores of plates, for people and programs."""

from collections.abc import Iterator

import numpy as np

from workbench.arm.confounded_constants import combinations
from workbench.arm.parameters import Parameter
from workbench.plate.observability import INDICES, I
from workbench.plate.plate_score import PlateScore, SetScore
from workbench.plate.region_poses import PLATE_CONE
from workbench.plate.target_readings import assumptions
from workbench.report.blocks import Block, ResultTable, Sentence
from workbench.report.json import Json, document
from workbench.report.numbers import short
from workbench.report.result_display import blocks_of
from workbench.report.result_fields import DEG, MM, ResultField, ResultFields

SCORE = "workbench.plate-score/1"


@blocks_of.register
def score_blocks(score: PlateScore) -> Iterator[Block]:
    """Target by target, then the set in the mixed and in the best single branch."""
    chosen = score.measured
    rows = [
        (f"{k + 1}", why, "–", "–")
        if (why := score.can.lacking.get(k))
        else (f"{k + 1}", branch, f"{chosen.per_target[k]:.4f}", short(100.0 * chosen.shares[k], 1))
        for k, branch in enumerate(chosen.branches)
    ]
    headings = ("target", "branch", "O", "share of I [%]")
    yield ResultTable(f"{score.plate.name} for {score.robot.name}", headings, rows, words=2)
    sets = (SET.cells(chosen), SET.cells(score.single) if score.single else ["–"] * len(SET.headings))
    lines = [*zip(SET.headings, *sets, strict=True)]
    yield ResultTable("The set", ("", "branches above", "one branch"), lines)
    if score.left_out:
        yield Sentence(score.left_out)
    yield Sentence(
        f"predicted errors: {len(chosen.error.twists)} joint positions in the region, any branch, rotated "
        f"from a target by up to {np.rad2deg(PLATE_CONE):.0f}°"
    )
    yield Sentence(f"included: {assumptions(score.plate, score.sigma)}")
    yield Sentence(
        f"scaling: rows by these deviations, angles as arcs at {score.robot.reach:.3f} m (the arm's reach); "
        "O and σmin/σmax unscaled, as in the paper"
    )
    yield Sentence(f"one branch: {score.single_branch if score.single else 'none reaches all targets'}")
    if chosen.rank < chosen.visible:
        yield Sentence(f"indistinguishable: {'; '.join(_open_text(chosen))}; vary targets or branches")


def _open_text(score: SetScore) -> list[str]:
    """Combinations that a set doesn't determine, as text."""
    parameters = tuple(Parameter(n, "", 0.0) for n in score.names)
    return [found.text for found in combinations(score.open, parameters)]


def number_or_open(value: float) -> str:
    return f"{value:.4g}" if np.isfinite(value) else "open"


def score_json(score: PlateScore) -> Json:
    """The same in SI, with angles in rad but errors in mm and degrees as everywhere."""
    return document(
        SCORE,
        robot=score.robot.name,
        plate=score.plate.name,
        noise={"position_mm": 1e3 * score.sigma[0], "orientation_deg": np.rad2deg(score.sigma[1])},
        holds=assumptions(score.plate, score.sigma),
        left_out=score.left_out,
        scaling_length_m=score.robot.reach,
        targets=[
            {"target": k + 1, "branch": branch, "q": score.measured.q[k], "O": o, "share": share}
            | ({"blocked": score.can.hits[k]} if score.can.hits[k] else {})
            | ({"out_of_reach": score.can.away[k]} if score.can.away[k] else {})
            for k, (branch, o, share) in enumerate(
                zip(score.measured.branches, score.measured.per_target, score.measured.shares, strict=True)
            )
        ],
        set=SET.json(score.measured),
        one_branch=score.single and {"branch": score.single_branch, **SET.json(score.single)},
    )


def _sizes(kind: str) -> ResultFields:
    """Mean, rms and maximum of a predicted error."""
    largest = ResultField("max", of=lambda error: getattr(error, kind).max(initial=0.0))
    return ResultFields(ResultField("mean", of=f"{kind}_mean"), ResultField("rms", of=f"{kind}_rms"), largest)


def _index(name: str, meaning: str) -> ResultField:
    of, title = (lambda score: score.indices[name]), f"{name}: {meaning}"
    return ResultField("", of=of, title=title, text=number_or_open)


PREDICTED = ResultFields(
    ResultField("position", MM, of=lambda error: error, each=_sizes("position")),
    ResultField("orientation", DEG, of=lambda error: error, each=_sizes("rotation")),
)
"""Of a `PredictedError`."""
MEANINGS = {name: index.meaning for name, index in INDICES.items()} | {I.name: I.meaning}
SET = ResultFields(
    ResultField("predicted", of="error", each=PREDICTED),
    ResultField("", MM, "error.position_rms", "position error, rms", number_or_open),
    ResultField("", MM, "error.position_mean", "position error, mean", number_or_open),
    ResultField("", DEG, "error.rotation_rms", "orientation error, rms", number_or_open),
    ResultField("", of=lambda score: f"{score.rank} of {score.visible}", title="rank"),
    "indices",
    ResultField(
        "stacked_ratio", of="stacked", title="σmin/σmax of the stacked Jacobian", text=number_or_open
    ),
    "rank",
    "visible",
    ResultField("parameters", of=lambda score: len(score.names)),
    ResultField("open", of=_open_text),
    *(_index(*each) for each in MEANINGS.items()),
)
"""Of the `SetScore` of one set of measurements."""
