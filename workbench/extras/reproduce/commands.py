"""Commands that reproduce the two works: `workbench reproduce aria` and `workbench reproduce katana`.

The studies belong to a checkout (`tests/studies`), not to what users install."""

import sys
from pathlib import Path
from typing import Annotated

from workbench.base.errors import FileError
from workbench.base.files import write_folder
from workbench.base.installed_package import install_command
from workbench.cli import options as opt
from workbench.cli.exit_status import group
from workbench.cli.options import option

TESTS = Path(__file__).resolve().parents[3] / "tests"
"""Location of the studies in a checkout."""

FolderOption = Annotated[Path | None, option("Write the table and all findings into this folder.")]
works = group(
    "reproduce", "Reproduce the two works behind this program: printed numbers beside ours.", section="Files"
)


@works.callback()
def reproduce() -> None:
    """Reproduce the two works behind this program: printed numbers beside ours."""
    if not (TESTS / "studies" / "__init__.py").is_file():
        raise FileError(
            "the studies of the two works are not installed with the package; run this command in a checkout "
            f"of the project, after `{install_command()}`",
            path=str(TESTS / "studies"),
        )
    if str(TESTS) not in sys.path:
        sys.path.insert(0, str(TESTS))


@works.command()
def aria(
    out: FolderOption = None,
    arms: Annotated[int, option("Number of virtual arms compared.")] = 100,
    seed: opt.SeedOption = 0,
) -> None:
    """Kinematic calibration of a lightweight manipulator: tables, pose selection, Figure 7 over many arms."""
    from studies.aria import reproduce_aria

    opt.check_writable(folder=out)
    with opt.progress_bar("reproduce"):
        found = reproduce_aria(arms=arms, seed=seed)
    _write("aria", found.findings, out)


@works.command()
def katana(
    out: FolderOption = None,
    arms: Annotated[int, option("Number of virtual arms calibrated with every method.")] = 40,
    weighed: Annotated[
        int, option("Number of arms for comparing influence-based identification with least squares.")
    ] = 200,
    seed: opt.SeedOption = 0,
) -> None:
    """Joint tilting and influences on the Katana 450: Tables 3.2 to 4.6 over many arms."""
    from studies.katana import reproduce_katana

    opt.check_writable(folder=out)
    with opt.progress_bar("reproduce"):
        found = reproduce_katana(arms=arms, weighed=weighed, seed=seed)
    _write("katana", found.findings, out)


def _write(work: str, findings: tuple, out: Path | None) -> None:
    """Show what agrees, and write the folder and the result if requested."""
    from studies.finding import findings_blocks, findings_json

    from workbench.report.json import json_text
    from workbench.report.result_display import as_markdown

    blocks, content = findings_blocks(findings), findings_json(work, findings)
    opt.show(blocks)
    if out is not None:
        files = {"tables.md": as_markdown(blocks).encode(), "result.json": json_text(content).encode()}
        opt.say(f"written: {write_folder(out, files)}")
    opt.write_result(content)
