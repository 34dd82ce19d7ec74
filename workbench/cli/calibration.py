"""The commands that turn measurements into a calibrated robot: identify, diagnose, evaluate, export."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import workbench as wb
from workbench.base.errors import OptionError
from workbench.cli import options as opt
from workbench.cli.options import argument, option

Shown = Callable[..., Any]
"""Makes what is shown of a result, or writes it."""


def identify(
    data: opt.DataArgument,
    fit: opt.FitOptions,
    out: opt.OutputOptions,
    files: opt.FileOptions,
    wanted: opt.WantedOption = None,
    robot: Annotated[
        str | None, option("--robot", "Robot: a .toml or .urdf file, or a built-in arm.")
    ] = None,
    algorithms: Annotated[
        str | None, option("--algorithm", "ols, opt1, opt2, influence, several separated by commas, or all.")
    ] = None,
    tip: opt.TipOption = None,
) -> None:
    """Identify the arm's geometry from measurements, and report its error on held-out rows."""
    from workbench.arm.built_in_arms import posed_arm
    from workbench.data.accuracy_requirement import default_requirement
    from workbench.identification.algorithms import ALGORITHMS, DEFAULT_ALGORITHMS
    from workbench.identification.report.document import identification_blocks
    from workbench.identification.report.results_json import identification_json, write_identification

    arm = posed_arm() if robot is None else wb.load_robot(robot, tip=tip)
    requested = default_requirement(arm.name) if wanted is None else opt.wanted_of(wanted)
    rows = files.read(data, arm)
    if robot is None and (rows.readings is None or not rows.readings.has_tool_poses):
        raise OptionError("give --robot; it may be omitted only for rows with tool poses instead of joints")
    out.check()
    choices = fit.choices(arm, files)
    chosen = tuple(ALGORITHMS) if algorithms == "all" else algorithms or DEFAULT_ALGORITHMS
    with opt.progress_bar("identify"):
        run = wb.identify(arm, rows, choices, algorithms=chosen)
    blocks = partial(identification_blocks, run, wanted=requested)
    write = partial(write_identification, run, wanted=requested)
    _finish(run, out, fit.force, partial(identification_json, run), blocks, write)


def diagnose(
    data: opt.DataArgument,
    robot: opt.RobotOption,
    fit: opt.FitOptions,
    out: opt.OutputOptions,
    files: opt.FileOptions,
    tip: opt.TipOption = None,
) -> None:
    """Find the effects missing from the model, add them, and report the held-out error before and after."""
    from workbench.diagnosis.report.results_json import diagnosis_json, write_diagnosis

    arm = wb.load_robot(robot, tip=tip)
    rows = files.read(data, arm)
    out.check()
    choices = fit.choices(arm, files)
    with opt.progress_bar("diagnose"):
        run = wb.diagnose(arm, rows, choices)
    json, write = partial(diagnosis_json, run), partial(write_diagnosis, run)
    _finish(run.identification(), out, fit.force, json, run.blocks, write)


def _finish(run, out: opt.OutputOptions, force: bool, json: Shown, blocks: Shown, write: Shown) -> None:
    """Write the calibrated arm, unless there are reasons not to, before anything is said; then the rest."""
    from workbench.arm.built_in_arms import refusal
    from workbench.identification.run import file_text

    path, report, best, done = out.save, out.report, run.best, None
    held = path.suffix[1:].upper() if path is not None else "TOML"
    if unknown := run.identifiability.refused:
        reason, notes = f"{path} is not written: {unknown}" if path is not None else "", []
    else:
        reason = refusal(run.robot, f".{held}")
        notes = [text for form, text in run.refused(best).items() if form not in ("", held)]
        if path is not None and (force or not reason):
            done = opt.save_robot(run.robot, path, force=True)
        if path is not None and reason:
            reason += f"; {path} is {'written because of' if force else 'not written without'} --force"
    opt.write_result(json)
    opt.describe("tables", lambda: opt.show(blocks()))
    if report is not None:
        opt.describe("report", lambda: opt.say(f"report: {write(report)}"))
    if done is not None:
        opt.say(f"calibrated robot ({best.fit.algorithm.title}): {done}")
        opt.describe("files' errors", lambda: opt.say(f"mean error of the files on {file_text(best)}"))
    opt.say_notes(notes)
    if reason:
        opt.fail(reason)
    if not best.fit.outcome.ok:
        title = best.fit.algorithm.title
        opt.fail(f"the fit ({title}) did not converge: {best.fit.outcome}; the best iterate was kept")


def evaluate(
    data: opt.DataArgument,
    robot: opt.RobotOption,
    files: opt.FileOptions,
    frames: Annotated[str, option("given: fit nothing; fit: fit only base and tool.")] = "given",
    reading: opt.ReadingOption = "auto",
    exclude: opt.ExcludeOption = None,
    tip: opt.TipOption = None,
) -> None:
    """Errors of a nominal or calibrated robot on measurements, without fitting the arm."""
    from workbench.identification.report.results_json import evaluation_json

    fits, arm = opt.fits_frames(frames), wb.load_robot(robot, tip=tip)
    found = wb.evaluate(arm, files.read(data, arm), fit_frames=fits, reading=reading, exclude=exclude)
    opt.show(found.blocks())
    opt.write_result(evaluation_json(found))
    if found.foreign:
        opt.fail(found.foreign)


def export(
    calibrated: Annotated[str | None, argument("A robot: .toml, .urdf, or a built-in arm.")] = None,
    urdf: Annotated[Path | None, option("Write a URDF here.")] = None,
    toml: Annotated[Path | None, option("Write a robot TOML here.")] = None,
    controller: Annotated[
        Path | None,
        option("Write the numbers to enter into a controller here (.json): joint offsets, tool, base."),
    ] = None,
    form: Annotated[
        str | None, option("--for", "Write --out in this form; `--for list` lists all forms.")
    ] = None,
    out: Annotated[Path | None, option("With --for: output file.")] = None,
    source: Annotated[
        Path | None,
        option(
            "--into", "--source", "With --for: your file of this form, copied to --out with these numbers."
        ),
    ] = None,
    nominal: Annotated[
        str | None, option("The controller's robot model, for --controller and some forms of --for.")
    ] = None,
    tip: opt.TipOption = None,
) -> None:
    """Write a robot in another form: URDF, TOML, or a file for a controller, driver or program."""
    from workbench.arm.calibrated_region import region_text
    from workbench.arm.usable_arm import carried_text
    from workbench.base.wording import capital
    from workbench.exports import FORMS, form_named

    if form == "list":
        for name, each in FORMS.items():
            opt.say(f"{name:20} {each.title}")
        return
    if calibrated is None:
        raise OptionError("name the robot to export; only `--for list` works without")
    if (form is None) != (out is None) or (source is not None and form is None):
        raise OptionError("--for NAME and --out FILE belong together; --into goes with them")
    if not (paths := [path for path in (out, urdf, toml, controller) if path is not None]):
        raise OptionError("give at least one of --for NAME --out FILE, --urdf, --toml, --controller FILE")
    if controller is not None and nominal is None:
        raise OptionError("--controller needs --nominal ROBOT, the controller's own model")
    chosen, arm = None if form is None else form_named(form), wb.load_robot(calibrated, tip=tip)
    if chosen is not None and (reason := chosen.refusal(arm)):
        opt.fail(f"{reason}; {out} is not written")
    opt.check_writable(*paths)
    own, advice = opt.load_nominal(nominal, arm), ""
    content: dict[str, Any] = {"schema": "workbench.export/1", "robot": arm.name, "files": [*map(str, paths)]}
    if form is not None and out is not None:
        done = wb.export(arm, form, out, nominal=own, into=source, force=True)
        opt.say(f"{arm.name}: {done.path}")
        opt.say(capital(done.verdict))
        opt.say_notes(done.notes)
        left = {"position_m": done.position, "rotation_rad": done.rotation, "poses": done.rows}
        content |= {"for": form, "file": str(done.path), "left": left, "notes": [*done.notes]}
    for path in filter(None, (urdf, toml)):
        opt.say(f"{arm.name}: {opt.save_robot(arm, path)}")
    if urdf is not None:
        branches = f"{urdf} keeps all its branches; the chain ends at '{tip}', by its link calibrated_tool"
        opt.say_notes([*([] if tip is None else [branches]), *carried_text(arm)])
    opt.say_notes(() if urdf is None and toml is None else [*arm.notes, *region_text(arm)])
    if controller is not None and own is not None:
        from workbench.exports.controller_parameters import use_of
        from workbench.identification.checks.arm_match import require_same_arm
        from workbench.report.json import write_json

        require_same_arm(arm, own)
        use = use_of(arm, own)
        advice = use.advice if use.advised is None else ""
        opt.show(use.blocks())
        content["controller"] = use.json()
        opt.say(f"controller: {write_json(controller, {'robot': arm.name, 'controller': use.json()})}")
    opt.write_result(content)
    if advice:
        opt.fail(advice)
