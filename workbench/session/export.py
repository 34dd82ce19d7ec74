"""What a session hands out as files."""

import tempfile
from pathlib import Path

from workbench.errors import DataError
from workbench.robots.toml import write_toml
from workbench.session.state import Session


def calibrated_toml(session: Session) -> tuple[str, bytes]:
    """File name and content of the shown fit's calibrated robot.

    Raises:
        DataError: nothing has been identified.
    """
    if session.identification is None:
        raise DataError("nothing has been identified yet, so there is no calibrated robot to save")
    calibrated = session.identification.runs[session.fit].calibrated
    with tempfile.TemporaryDirectory(prefix="workbench-") as folder:
        path = write_toml(calibrated, Path(folder) / "calibrated.toml")
        content = path.read_bytes()
    stem = "".join(c if c.isalnum() else "-" for c in session.robot.name.lower()) or "robot"
    return f"{stem}-calibrated.toml", content
