"""What causes explain at the tool: √(e₁² − e₂²) of the cross-validated rms errors without and with them.

The linear models are those of the cross-validation, but errors are in mm and degrees: whitened squares depend
on the weights and mix positions with orientations.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from workbench.diagnosis.search.candidates import candidate_columns
from workbench.diagnosis.search.evidence import Model, without_each_fold
from workbench.diagnosis.search.gram_matrices import Coefficients
from workbench.diagnosis.search.rounds import Searched

MAX_LEFT = 0.95
"""Share of an error that a correction may leave to be worth a word."""


def remaining(searched: Searched, models: Sequence[Model]) -> Float[np.ndarray, "models 2"]:
    """Cross-validated rms errors that models of a search's terms leave [mm, deg]; NaN if not measured."""
    grams, stage = searched.grams, searched.stage
    problem, x = stage.weighed, stage.fit.x
    solutions = np.stack([without_each_fold(grams, m)[0] for m in models], axis=2)
    tried = Coefficients.of(problem, x, [t.candidate.effect for t in searched.model])
    steps = solutions[:, grams.columns(tried.names)] / grams.scales(tried.names)[:, None]
    plain = np.array([p.is_plain for p in problem.parameters], bool)
    geometry = np.einsum("pg,fgk->fpk", grams.basis, solutions[:, : grams.geometry])
    pieces = {block.start: piece for block, piece in problem.pieces(x, only=plain)}
    fold, left = searched.fold[stage.keep], np.empty((problem.size, len(models)))
    for block, columns in candidate_columns(problem, x, tried.carriers, loaded=tried.loaded):
        piece, table = pieces[block.start], columns.table
        label = np.repeat(fold[block.rows], len(table) // len(block.rows))
        whole, here = piece.residual + table @ tried.present, left[block.start : block.stop]
        for f in np.unique(label):  # by the solution that left its rows out
            mine = label == f
            here[mine] = whole[mine, None] - piece.jacobian[mine] @ geometry[f] - table[mine] @ steps[f]
    squares = np.stack([problem.physical(each) for each in left.T]) ** 2
    errors = [
        unit * np.sqrt(3.0 * squares[:, mine].mean(1)) if mine.any() else np.full(len(models), np.nan)
        for mine, unit in zip(problem.channels[:2], (1e3, float(np.rad2deg(1.0))), strict=True)
    ]
    return np.stack(errors, axis=1)


def reduced(before: Sequence[float], after: Sequence[float]) -> str:
    """Which rms errors, of positions [mm] and orientations [deg], something noticeably reduces, in words."""
    changes = zip(before, after, (" mm", "°"), strict=True)
    return " and ".join(f"{old:.3g} to {new:.3g}{u}" for old, new, u in changes if new < MAX_LEFT * old)
