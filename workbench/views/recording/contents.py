"""Drawing moments one after the other: the scene, and words, tables and pictures beside it; log and numbers
over the steps, each of which keeps what it needs of earlier ones. The viewer's layout: the scene on the left,
curves, bars and the result on the right, the log below. Decisions as sentences, and what
the session is of, as markdown.

The viewer has one layout for all steps, so what differs between them is drawn instead: the eye is a camera
that moves in the scene, the title a text, and bars and result are those of the step.
"""

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from workbench.base.types import Vector3
from workbench.base.wording import plural
from workbench.diagnosis.report.document import diagnosis_blocks
from workbench.diagnosis.result import Diagnosis
from workbench.identification.report.document import models, parameter_blocks, remarks
from workbench.identification.result import Identification
from workbench.parts import warn_of_broken
from workbench.report.numbers import compared
from workbench.report.result_display import as_markdown
from workbench.session.command import AbstractChore
from workbench.session.commands.drag import DropTarget, GrabTarget, MoveTarget
from workbench.session.commands.edit import MovePlate
from workbench.session.commands.messages import SetCaption
from workbench.session.cube_fields import field_of
from workbench.session.stages import before_and_after, stage_words, stages
from workbench.session.state import Focus, Session
from workbench.session.view import Ending, Entry, Moment
from workbench.views.appearance.colours import SELECTED, STAGE_COLOURS
from workbench.views.drawables.scene_contents import first_view, items, occasion, title
from workbench.views.drawables.sink import Item, differences
from workbench.views.recording.rerun_output import EYE, PATHS, STEP, Canvas
from workbench.views.recording.rerun_sink import RecordingSink, markdown

FIELD = 0.66
"""Height of the picture [rad]."""


class MomentDrawing:
    """Draws moments onto a canvas; what can't be drawn is left out, and the rest goes on."""

    def __init__(self, canvas: Canvas):
        self._canvas = canvas
        self._scene, self._sheets = RecordingSink(canvas, "world/"), RecordingSink(canvas)
        self._timelines = Log(), Series()
        canvas.arrange(blueprint())
        canvas.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        lens = rr.Pinhole(fov_y=FIELD, aspect_ratio=1.0, camera_xyz=rr.ViewCoordinates.RUB, line_width=0.0)
        canvas.log(EYE, lens, static=True)

    def draw(self, moment: Moment) -> None:
        session = moment.session
        self._canvas.at(moment.step, moment.at)
        self._try("scene", self._scene.draw, items(session, on_page=False))
        self._try("sheets", self._sheets.draw, sheets(session))
        for timeline in self._timelines:
            self._try(type(timeline).__name__, timeline.draw, self._canvas, moment)

    def end(self, step: int) -> None:
        """Lay out the viewer for all steps up to the last one."""
        self._canvas.arrange(blueprint(step))

    def _try(self, name: str, draw: Callable[..., None], *args: Any) -> None:
        try:
            draw(*args)
        except Exception as error:
            warn_of_broken(name, error)


def sheets(session: Session) -> Iterator[Item]:
    """Title, legend, result and bars (O as ARIA eq. 17) beside the scene, and the eye that looks at it."""
    results = session.results
    yield Item("title", markdown, (headline(session),))
    yield Item("about", markdown, (about(session),))
    yield Item(EYE, lambda *_: _camera(*first_view(session)), occasion(session))
    yield Item("result", _result, (results.diagnosis, results.identification, results.fit, results.accepted))
    if not (known := stages(session)) or (session.shows_plate and session.playback.focus is Focus.TARGET):
        yield Item("bars/O", _bars, (np.nan_to_num(session.score.per_target), SELECTED))
        return
    for k, stage in enumerate(known):
        rows = stage.errors.position
        if len(errors := 1e3 * rows[np.isfinite(rows)]):
            largest_first = np.quantile(errors, np.linspace(1.0, 0.0, 25))  # more bars are none to the eye
            drawn = largest_first, STAGE_COLOURS[stage.title], 0.3 * k, 0.3  # over others they turn white
            yield Item(f"bars/{PATHS[stage.title]}_mm", _bars, drawn)


def _camera(position: Vector3, target: Vector3) -> rr.Transform3D:
    """It looks at the target, with the z axis upright."""
    forward = target - position
    right = np.cross(forward, [0.0, 0.0, 1.0])
    axes = np.stack([right, np.cross(right, forward), -forward], axis=1)
    return rr.Transform3D(translation=position, mat3x3=axes / np.linalg.norm(axes, axis=0))


def _result(
    diagnosis: Diagnosis | None, found: Identification | None, fit: str, accepted: tuple[Any, ...]
) -> rr.TextDocument:
    """The diagnosis until what it found is added, else the shown fit."""
    if diagnosis is not None and not accepted:
        return markdown(as_markdown(diagnosis_blocks(diagnosis)))
    if found is None:
        return markdown("Nothing has been identified yet.")
    parts = (*models(found), *parameter_blocks(found.runs[fit].fit), *remarks(found))
    return markdown(as_markdown(parts))


def _bars(values: np.ndarray, colour: Any, aside: float = 0.0, width: float = 1.0) -> rr.BarChart:
    """A bar for each value, counted from 1, and so far aside."""
    places = np.arange(1, len(values) + 1) - 0.5 + aside
    return rr.BarChart(values, abscissa=places, color=colour, widths=np.full(len(values), width))


LEVELS = {Ending.DONE: "INFO", Ending.CANCELLED: "INFO", Ending.REFUSED: "WARN", Ending.FAILED: "ERROR"}
COLOURS = {PATHS[stage]: colour for stage, colour in STAGE_COLOURS.items()}
DRAGS = (GrabTarget, MoveTarget, DropTarget)


class Log:
    """`log`: one line per decision, and what a demo says.

    The places of a drag are left out, what the session computes by itself, and how page and scene look.
    """

    def __init__(self) -> None:
        self._message_count = 0
        self._last: Session | None = None

    def draw(self, canvas: Canvas, moment: Moment) -> None:
        before, self._last = self._last, moment.session
        if moment.entry is None:
            self._message_count = moment.session.page.message_count
            summary = "The session begins" if moment.step == 0 else "The session continues"
            canvas.log("log", rr.TextLog(summary, level="INFO"))
            return
        messages = [m.text for m in moment.session.page.messages if m.number > self._message_count]
        self._message_count = moment.session.page.message_count
        command, is_done = moment.entry.command, moment.entry.ending is Ending.DONE
        if isinstance(command, SetCaption) and moment.session.page.caption:
            canvas.log("log", rr.TextLog(f"“{moment.session.page.caption}”", level="INFO"))
            return
        is_quiet = isinstance(command, MoveTarget | AbstractChore) or _look_alike(before, moment.session)
        if is_done and is_quiet and not messages:
            return
        text = sentence(moment.entry, moment.session, messages)
        canvas.log("log", rr.TextLog(text, level=LEVELS[moment.entry.ending]))


def _look_alike(before: Session | None, now: Session) -> bool:
    """Whether two sessions differ in nothing but the page, what is laid over the scene, and the row shown."""
    if before is None or differences(before, now) - {"page", "choices", "results", "playback"}:
        return False
    chosen, found = differences(before.choices, now.choices), differences(before.results, now.results)
    is_moved = differences(before.playback, now.playback) - {"focus"}
    return chosen <= {"overlay"} and found <= {"row"} and not is_moved


class Series:
    """Numbers of the session at every step.

    `index/O`: what the targets tell. `predicted/position_mm`, `predicted/rotation_deg`: mean errors in the
    region after a calibration. `error/nominal_mm`, `geometry_mm` and `effects_mm` (`_deg`): mean errors on
    held-out rows, on the fitted ones without any.
    """

    def __init__(self) -> None:
        self._drawn: dict[str, float] = {}

    def draw(self, canvas: Canvas, moment: Moment) -> None:
        session, entry = moment.session, moment.entry
        is_all = entry is not None and not isinstance(entry.command, DRAGS)
        for path, value in _numbers(session):
            if path not in self._drawn:
                self._style(canvas, path, session)
            if is_all or self._drawn.get(path) != value:
                self._drawn[path] = value
                canvas.log(path, rr.Scalars(value if math.isfinite(value) else math.nan))

    def _style(self, canvas: Canvas, path: str, session: Session) -> None:
        name, _, unit = path.split("/")[1].partition("_")
        colour, words = COLOURS.get(name, SELECTED), stage_words(session)
        title = {PATHS[stage]: words[stage] for stage in words}.get(name, name)
        step = rr.components.InterpolationMode.StepAfter
        line = rr.SeriesLines(names=f"{title} {unit}".strip(), colors=colour, interpolation_mode=step)
        canvas.log(path, line, rr.SeriesPoints(colors=colour, marker_sizes=4.0), static=True)


def _numbers(session: Session) -> Iterator[tuple[str, float]]:
    yield "index/O", float(session.score.indices["O"])
    yield "predicted/position_mm", 1e3 * float(session.score.position)
    yield "predicted/rotation_deg", math.degrees(float(session.score.rotation))
    for stage in stages(session):
        yield f"error/{PATHS[stage.title]}_mm", stage.error
        if (turned := stage.errors.orientation_deg) is not None:
            yield f"error/{PATHS[stage.title]}_deg", turned.mean


GROUND = (246, 248, 251)
NO_LEGEND = rrb.PlotLegend(visible=False)
EACH = "grey nominal, blue geometry, orange with what was added"
PLOTS: dict[str, dict[str, tuple[str, tuple[str, ...]]]] = {
    "Position": {
        "predicted error [mm]": ("predicted", ("position_mm",)),
        f"error [mm]: {EACH}": ("error", tuple(f"{path}_mm" for path in PATHS.values())),
    },
    "Observability": {"O": ("index", ("O",))},
    "Orientation": {
        "predicted error [°]": ("predicted", ("rotation_deg",)),
        f"error [°]: {EACH}": ("error", tuple(f"{path}_deg" for path in PATHS.values())),
    },
}
"""Tabs of curves: by its heading, where each one's numbers are."""


def blueprint(steps: int | None = None) -> rrb.Blueprint:
    """The layout; once it is known how many steps there are, their curves have room for the last points."""
    bars = rrb.BarChartView(origin="bars", name="Targets by O, or rows by error [mm]", plot_legend=NO_LEGEND)
    at, axis = rr.TimeRangeBoundary.absolute, None
    if steps is not None:
        room = 1 + steps // 50
        axis = rrb.TimeAxis(view_range=rr.TimeRange(start=at(seq=-room), end=at(seq=steps + room)))
    plots = (
        rrb.Grid(*(_plot(each, where, axis) for each, where in of.items()), grid_columns=1, name=tab)
        for tab, of in PLOTS.items()
    )
    result = rrb.TextDocumentView(origin="result", name="Result")
    beside = rrb.Vertical(rrb.Tabs(*plots), bars, result, row_shares=[3, 2, 3])
    scene = rrb.Spatial3DView(
        origin="world",
        name="Scene",
        background=GROUND,
        line_grid=rrb.LineGrid3D(visible=True, spacing=0.25, color=(186, 195, 208)),
        eye_controls=rrb.EyeControls3D(tracking_entity=EYE),
    )
    left = rrb.Vertical(rrb.TextDocumentView(origin="title", name="Session"), scene, row_shares=[1, 5])
    log = rrb.TextLogView(
        origin="log", name="Steps", columns=rrb.TextLogColumns(text_log_columns=["LogLevel", "Body"])
    )
    below = rrb.Tabs(log, rrb.TextDocumentView(origin="about", name="About"))
    return rrb.Blueprint(
        rrb.Vertical(rrb.Horizontal(left, beside, column_shares=[5, 4]), below, row_shares=[5, 1]),
        rrb.TimePanel(state="collapsed", timeline=STEP, play_state="following"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
    )


def _plot(heading: str, where: tuple[str, tuple[str, ...]], axis: rrb.TimeAxis | None) -> rrb.TimeSeriesView:
    """What has the same unit and meaning has one scale."""
    origin, paths = where
    contents = [f"$origin/{path}" for path in paths]
    return rrb.TimeSeriesView(
        origin=origin, contents=contents, name=heading, plot_legend=NO_LEGEND, axis_x=axis
    )


def sentence(entry: Entry, session: Session, messages: list[str]) -> str:
    """A command and its result."""
    sentence = entry.command.title
    if isinstance(entry.command, MoveTarget | DropTarget | MovePlate) and entry.ending is Ending.DONE:
        sentence += _place(session, is_plate=isinstance(entry.command, MovePlate))
    if entry.ending in (Ending.CANCELLED, Ending.FAILED):
        sentence += f" ({entry.ending})"
    text = "; ".join(messages) or entry.text
    return f"{sentence}: {text}" if text else sentence


def _place(session: Session, *, is_plate: bool) -> str:
    """Where the target, or the plate, stands now, and what that means."""
    state, target = session.states[session.selected], session.plate.targets[session.selected]
    x, y, z = 1e3 * (session.plate if is_plate else target).xyz
    text = f": {'it' if is_plate else f'target {session.selected + 1}'} is at {x:.1f}, {y:.1f}, {z:.1f} mm"
    if not is_plate and not state.measurable:
        return f"{text}, {state.obstacle}"
    error = session.score.position
    return f"{text}; predicted error {compared(1e3 * error)} mm rms" if np.isfinite(error) else text


def headline(session: Session) -> str:
    """What is seen, how good it is, and what a demo says of it, as markdown."""
    score = session.score
    figures = f"predicted error {compared(1e3 * score.position)} mm, O {score.indices['O']:.3f}"
    figures = before_and_after(session) if session.results.identification else figures
    return f"**{title(session)}:** {figures}\n\n{session.page.caption}"


def about(session: Session) -> str:
    """Robot, plate, measurements, and a legend of the recording, as markdown."""
    loaded, noise = session.measurements.loaded, session.noise
    measured = "none yet" if loaded is None else f"{loaded.name}, {plural(len(loaded.dataset), 'row')}"
    lines = [
        f"**{session.robot.name}:** {session.robot.dof} joints, convention {session.robot.convention}.",
        f"Plate “{session.plate.name}” with {plural(len(session.plate), 'target')}.",
        f"Instrument: {1e3 * noise.position:.3g} mm, {np.rad2deg(noise.rotation):.3g}°.",
        "",
        f"**Measurements:** {measured}",
        "",
        "**Timelines:** `step`: commands; `session_time`: seconds.",
        "",
        *cube_text(session),
        "**O** is the observability index: how evenly the targets tell all constants, 0 (some not) to 1.",
        "**Blocks:** sand where reached, blue where selected, brown where the arm is blocked, red where",
        "out of reach. **Arms:** solid, J1 … at its joints: nominal; orange: the real one as far as known.",
        "**Points** were measured: coloured by their error once there is a fit.",
        "**Arrows** lead from predicted to measured positions, in the colour of the model's stage: grey",
        "nominal, blue with its geometry identified, orange with what was added; likewise lines and bars.",
        f"All errors, of arms and arrows alike, are drawn × {session.choices.overlay.exaggeration:g}.",
    ]
    return "\n".join(lines)


def cube_text(session: Session) -> Iterator[str]:
    """What the colours of the region's cubes mean, where they are shown."""
    field = field_of(session)
    if field is None or (shown := field.values(session)) is None:
        return
    low, high = (f"{field.factor * bound:.3g} {field.unit}".strip() for bound in (shown.low, shown.high))
    worst, best = (low, high) if field.larger_is_better else (high, low)
    title = field.title.lower()
    yield f"**Cubes:** {title}, orange-red {worst} or worse, blue {best} or better; grey: not reached."
    yield ""
