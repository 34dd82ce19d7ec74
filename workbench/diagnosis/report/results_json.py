"""Machine-readable result of a diagnosis, the schema `workbench.diagnosis/1`, and its page."""

from pathlib import Path

import numpy as np

from workbench.arm.effects import AbstractEffect
from workbench.arm.effects.axes import turns
from workbench.arm.effects.events import AbstractEvent
from workbench.base.advice import beside
from workbench.diagnosis.claims.cause import Cause, ResidualMap
from workbench.diagnosis.drivers.evidence import FollowedDriver
from workbench.diagnosis.report.document import diagnosis_blocks
from workbench.diagnosis.result import Accepted, Diagnosis
from workbench.identification.errors.row_errors import Errors
from workbench.identification.report.results_json import excluded_json, reading_json, validation_json
from workbench.report.json import Json, document
from workbench.report.page import write_page

DIAGNOSIS = "workbench.diagnosis/1"


def write_diagnosis(result: Diagnosis, folder: Path | str) -> Path:
    """Write `diagnosis.html` and `diagnosis.json`: both or nothing; the folder is made if it is not there."""
    files, title = ("diagnosis.html", "diagnosis.json"), f"{result.robot.name}: {result.data.source}"
    blocks, plain = diagnosis_blocks(result), diagnosis_json(result)
    return write_page(folder, files, blocks, plain, title=title, kind="Diagnosis")


def diagnosis_json(result: Diagnosis) -> Json:
    """The result of a diagnosis as plain data; joints count from 1, outliers are data rows from 0."""
    return document(
        DIAGNOSIS,
        robot=result.robot.name,
        **reading_json(result.data, result.robot),
        measurements=lambda: {
            "used": len(result.after_fit.problem.data),
            "held_out": len(result.held_out_data),
            "held_out_rows": result.held_out_data.place,
            "outliers": sorted(result.data.place[result.outliers].tolist()),
            "excluded": excluded_json(result.excluded, result.data),
            "source": result.data.source,
        },
        nominal=lambda: validation_json(result.nominal),
        before=lambda: validation_json(result.before),
        effects=lambda: [_accepted(e, result) for e in result.effects],
        causes=lambda: [_cause(c) for c in result.causes],
        map=lambda: None if result.residual_map is None else _map(result.residual_map),
        after=lambda: validation_json(result.after),
        noise=lambda: result.remaining.noise.json(),
        noise_floor=lambda: None if (known := result.remaining.known_noise) is None else known.json(),
        **_joint_noise(result),
        saved_arm=None if result.now is None else {"from_row": result.now.row, "mean_mm": result.now.mean_mm},
        follows=lambda: [_followed(f) for f in result.followed],
        suspects=result.held_out_data.place[result.suspects],
        verdict=result.verdict,
        message=result.message,
        measure_next=result.measure_next,
        next_reasons=[reason.sentence for reason in result.next_reasons],
        warnings=result.warnings,
        notes=result.notes,
        seconds=result.seconds,
    )


@beside("the noise of joint readings", {})
def _joint_noise(result: Diagnosis) -> dict[str, object]:
    """Of every joint's readings; null for prismatic joints, whose noise is in mm under its own key."""
    found, chain = result.remaining.joint_noise, result.calibrated.chain
    if found is None:
        return {"joint_noise_deg": None}
    turning = [turns(chain, j) for j in range(chain.dof)]
    units = {"joint_noise_deg": np.rad2deg(1.0)} | ({} if all(turning) else {"joint_noise_mm": 1e3})
    both = tuple(zip(found.sigma, turning, strict=True))
    return {k: [u * s if t is (k == "joint_noise_deg") else None for s, t in both] for k, u in units.items()}


def _effect(effect: AbstractEffect) -> Json:
    """Name, joints from 1, and settings such as `order`."""
    settings = {key: getattr(effect, key) for key in effect.settings()}
    if isinstance(effect, AbstractEvent) and not effect.is_timed:
        settings["time_s"] = None
    return {"name": str(effect.name), "joints": [j + 1 for j in effect.joints], **settings}


def _accepted(found: Accepted, result: Diagnosis) -> Json:
    effect, keys = found.effect, ("name", "value", "std", "unit")
    units = effect.units(result.calibrated.chain)
    sizes = zip(effect.names, effect.coefficients, found.std, units, strict=True)
    return {
        **_effect(effect),
        "coefficients": [dict(zip(keys, each, strict=True)) for each in sizes],
        **_chance(found.gain),
        **_held_out("before", found.before),
        **_held_out("after", result.after.judged),
        "alternatives": [
            {**_effect(r.effect), **_held_out("after", r.errors), **_chance(r.gain)}
            for r in found.alternatives
        ],
        "words": found.text,
    }


def _chance(gain: float) -> Json:
    """Log evidence, and the largest probability that chance would add as much (Markov's inequality)."""
    return {"gain": gain, "p_value": float(np.exp(-max(gain, 0.0)))}


def _cause(cause: Cause) -> Json:
    return {
        "kind": cause.kind,
        **_effect(cause.whole),
        "confidence": str(cause.confidence),
        "odds": cause.odds,
        "contribution_mm": cause.contribution_mm if np.isfinite(cause.contribution_mm) else None,
        **({"contribution_deg": cause.contribution_deg} if np.isfinite(cause.contribution_deg) else {}),
        "sentence": cause.sentence,
        "look_alikes": [_effect(e) for e in cause.look_alikes],
    }


def _map(found: ResidualMap) -> Json:
    return {
        "joints": [j + 1 for j in found.joints],
        "effects": [_effect(e) for e in found.effects],
        **_held_out("before", found.before),
        **_held_out("after", found.after),
    }


def _held_out(which: str, errors: Errors | None) -> Json:
    """Mean errors; in degrees if orientations were measured, null if nothing was evaluated."""
    turned = None if errors is None else errors.orientation_deg
    return {
        f"{which}_held_out_mm": None if errors is None else errors.position_mm.mean,
        **({} if turned is None else {f"{which}_held_out_deg": turned.mean}),
    }


def _followed(found: FollowedDriver) -> Json:
    """The driver, with its joints, and in which parts of the arm the error is, with theirs."""
    moved: dict[str, set[int]] = {}
    for part in found.parts:
        moved.setdefault(part.part, set()).update(j + 1 for j in part.joints)
    return {
        "driver": str(found.driver),
        "joints": [j + 1 for j in found.joints],
        "in": [{"part": part, "joints": sorted(joints)} for part, joints in moved.items()],
        "confidence": str(found.confidence),
        "sentence": f"The error {found.text}",
    }
