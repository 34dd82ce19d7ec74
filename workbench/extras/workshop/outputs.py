"""What `plate export` writes for a workshop, each by the name that follows `--formats`."""

from workbench.extras.workshop.drawing import pdf_of, svg_of
from workbench.extras.workshop.drawing_set import drawings_of
from workbench.extras.workshop.inspection import inspection_csv
from workbench.extras.workshop.sheet import PlateSheet
from workbench.extras.workshop.solids import step_of, three_mf
from workbench.plate.parts.export import PlateFile, PlateJob
from workbench.plate.score import score_plate


def _sheet(job: PlateJob) -> dict[str, bytes]:
    score = None if job.robot is None else score_plate(job.robot, job.drawn, sigma=job.sigma)
    sheet = PlateSheet(fixture=job.fixture, score=score, notes=(*job.fixture.notes, *job.plate.notes))
    return {"sheet.html": sheet.html().encode()}


def _drawings(job: PlateJob) -> dict[str, bytes]:
    return {f"{name}.dxf": sheet.dxf().encode() for name, sheet in drawings_of(job.fixture).items()}


def _step(job: PlateJob) -> dict[str, bytes]:
    return {f"{name}.step": step_of(part, f"{job.plate.name} {name}") for name, part in job.fixture.made}


def _pictures(job: PlateJob) -> dict[str, bytes]:
    return {f"{name}.svg": svg_of(sheet, name).encode() for name, sheet in drawings_of(job.fixture).items()}


DXF = PlateFile("dxf", _drawings)
PDF = PlateFile("pdf", lambda job: {"drawings.pdf": pdf_of(drawings_of(job.fixture).values())})
SVG = PlateFile("svg", _pictures, is_usual=False)
THREE_MF = PlateFile("3mf", lambda job: {"fixture.3mf": three_mf(job.fixture)})
STEP = PlateFile("step", _step, is_usual=False)
INSPECTION = PlateFile(
    "inspection", lambda job: {"inspection.csv": inspection_csv(job.plate, job.fixture).encode()}
)
SHEET = PlateFile("sheet", _sheet)
