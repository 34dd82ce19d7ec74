"""What several tests share."""

import os
import sys
from pathlib import Path

import pytest

# One thread of linear algebra a worker: several workers with several threads each only wait for each other.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Bytecode is kept even where the caller would not: every worker, and every command that a test starts in a
# process of its own, would compile the whole package and rewrite all assertions again, seconds each time.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files with a browser or measured arms first: a long one at the end leaves a worker idle."""
    items.sort(key=lambda item: not any(item.iter_markers("browser")) and not any(item.iter_markers("data")))


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of the real measurements beside the project; skips without it, fails in CI."""
    folder = Path(__file__).resolve().parents[2] / "shared" / "data"
    if not folder.is_dir():
        reason = f"the real measurements are not beside the project ({folder})"
        if os.environ.get("CI", "").lower() == "true":
            pytest.fail(reason)
        pytest.skip(reason)
    return folder


@pytest.fixture(scope="session")
def aria():
    """The built-in arm of the ARIA paper."""
    from workbench.arm.built_in_arms import load_robot

    return load_robot("aria")


@pytest.fixture
def run(monkeypatch, capfd, tmp_path):
    """Run a command in this process, as the installed one is run: exit status, output, errors."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")

    from workbench import cli

    def call(*words: str | Path) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["workbench", *map(str, words)])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        out, err = capfd.readouterr()
        return int(ended.value.code or 0), out, err

    return call
