"""What `plate export` writes for a workshop, each by the name that follows `--formats`."""

from functools import lru_cache

from workbench.extras.workshop.csv_lists import (
    blocks_csv,
    bores_csv,
    distances_csv,
    holes_csv,
    parts_csv,
    targets_csv,
)
from workbench.extras.workshop.drawing import pdf_of, svg_of
from workbench.extras.workshop.drawing_set import drawings_of
from workbench.extras.workshop.fixture import fixture_of
from workbench.extras.workshop.inspection import inspection_csv
from workbench.extras.workshop.meshes import mesh_of, stl
from workbench.extras.workshop.parts import Fixture
from workbench.extras.workshop.sheet import PlateSheet
from workbench.extras.workshop.solids import step_of, three_mf
from workbench.plate.export import PlateFile, PlateJob
from workbench.plate.score import score
from workbench.plate.stock import made_as_drawn


@lru_cache(maxsize=1)
def parts_of(job: PlateJob) -> Fixture:
    """The parts of its plate, once for all formats."""
    return fixture_of(job.plate, stock=job.stock, robot=job.robot)


def _solids(job: PlateJob) -> dict[str, bytes]:
    return {f"{name}.stl": stl(mesh_of(part)) for name, part in parts_of(job).made}


def _lists(job: PlateJob) -> dict[str, bytes]:
    fixture, plate = parts_of(job), job.plate
    lists = {"holes": holes_csv(fixture), "blocks": blocks_csv(fixture), "bores": bores_csv(fixture)}
    lists |= {"targets": targets_csv(plate), "parts": parts_csv(fixture)}
    if plate.anchors is not None:
        lists["distances"] = distances_csv(plate)
    return {f"{name}.csv": text.encode() for name, text in lists.items()}


@lru_cache(maxsize=1)
def _sheet_of(job: PlateJob) -> PlateSheet:
    """What is expected of the plate as drawn, and where its file says otherwise, of that."""
    fixture, scores = parts_of(job), []
    if job.robot is not None:
        drawn, poses = made_as_drawn(job.plate, job.stock), job.evaluation_poses
        plates = (drawn,) if drawn.production == job.plate.production else (drawn, job.plate)
        scores = [score(job.robot, p, sigma=job.sigma, evaluation_poses=poses) for p in plates]
    return PlateSheet(
        fixture=fixture,
        score=scores[0] if scores else None,
        as_stated=scores[-1] if len(scores) > 1 else None,
        towards="the targets'" if job.evaluation_poses is None else "those of the plate as it was loaded",
        notes=(*fixture.notes, *job.plate.notes),
    )


def _drawings(job: PlateJob) -> dict[str, bytes]:
    return {f"{name}.dxf": sheet.dxf().encode() for name, sheet in drawings_of(parts_of(job)).items()}


def _step(job: PlateJob) -> dict[str, bytes]:
    return {f"{name}.step": step_of(part, f"{job.plate.name} {name}") for name, part in parts_of(job).made}


def _pictures(job: PlateJob) -> dict[str, bytes]:
    return {f"{name}.svg": svg_of(sheet, name).encode() for name, sheet in drawings_of(parts_of(job)).items()}


STL = PlateFile("stl", _solids)
CSV = PlateFile("csv", _lists)
DXF = PlateFile("dxf", _drawings)
PDF = PlateFile("pdf", lambda job: {"drawings.pdf": pdf_of(drawings_of(parts_of(job)).values())})
SVG = PlateFile("svg", _pictures, is_usual=False)
THREE_MF = PlateFile("3mf", lambda job: {"fixture.3mf": three_mf(parts_of(job))})
STEP = PlateFile("step", _step, is_usual=False)
INSPECTION = PlateFile(
    "inspection", lambda job: {"inspection.csv": inspection_csv(job.plate, parts_of(job)).encode()}
)
SHEET = PlateFile(
    "sheet",
    lambda job: {"sheet.html": _sheet_of(job).html().encode()},
    notes=lambda job: (*_sheet_of(job).notes, *_sheet_of(job).difference),
)
