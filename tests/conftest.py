"""What several tests share."""

import fcntl
import gc
import io
import json
import os
import sys
from collections.abc import Callable, Iterable
from functools import cache
from importlib.util import find_spec
from itertools import groupby
from pathlib import Path, PurePath
from typing import Any

import pytest
from hypothesis import HealthCheck, settings
from threadpoolctl import threadpool_limits
from xdist.scheduler import LoadFileScheduling

from workbench.parts import BROKEN, EXTRAS

gc.disable()  # until all is collected
# One thread of linear algebra a worker: several workers with several threads each only wait for each other.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Those of OpenCV spin while they wait: a third of the processor time of every search for markers.
os.environ.setdefault("OPENCV_FOR_THREADS_NUM", "1")
# Bytecode is kept even where the caller would not: every worker, and every command that a test starts in a
# process of its own, would compile the whole package and rewrite all assertions again, seconds each time.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False
# No test of drawn values depends on how busy the machine is, on a folder for every draw, or on luck:
# the same values are drawn in every run; `--hypothesis-profile explore` draws others.
ANY_MACHINE = settings(
    deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture]
)
settings.register_profile("explore", ANY_MACHINE)
settings.register_profile("any machine", ANY_MACHINE, derandomize=True)
settings.load_profile("any machine")


def pytest_configure(config: pytest.Config) -> None:
    """What one worker compiles, the others read: in a fresh checkout each compiles for half a minute."""
    if not hasattr(config, "workerinput"):
        return
    from numba.core.compiler_lock import global_compiler_lock
    from numba.core.dispatcher import Dispatcher

    alone = Dispatcher.compile

    def compile_in_turn(self: Dispatcher, sig: Any) -> Any:
        if global_compiler_lock.is_locked():  # a function that one being compiled calls
            return alone(self, sig)
        with global_compiler_lock, open(self.py_func.__code__.co_filename) as source:
            fcntl.flock(source, fcntl.LOCK_EX)
            return alone(self, sig)

    Dispatcher.compile = compile_in_turn


SHARING = ("/test_browser", "/test_round_trip", "studies/test_", "identification/report/")
"""Beginnings of tests' names that share what one worker builds for all of them."""
FIRST = ("studies", "slow", "browser", "data", "diagnosis", "identification")
"""Marks and folders that take long, longest first: what comes late and is long leaves a worker idle."""


@pytest.hookimpl(trylast=True)
def pytest_sessionstart(session: pytest.Session) -> None:
    """One browser, app and session for the tests of the core and of extras, in each process that runs tests.

    They import the package, whose checked types (`--jaxtyping-packages`) are arranged before this.
    """
    if hasattr(session.config, "workerinput") or not session.config.getoption("numprocesses", None):
        threadpool_limits(1, user_api="blas")  # a plugin may have loaded it before it was told so above
        for name in ("browser", "session_at_work", "recorded"):
            session.config.pluginmanager.import_plugin(name)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What takes long first, then longer files; what uses an extra that isn't there is skipped."""
    for item in items:
        for mark in item.iter_markers("extra"):
            assert mark.args[0] in EXTRAS, f"{item.nodeid}: there is no extra '{mark.args[0]}'"
            if find_spec(f"workbench.extras.{mark.args[0]}") is None:
                item.add_marker(pytest.mark.skip(reason=f"the extra {mark.args[0]} is not installed"))

    def rank(item: pytest.Item) -> int:
        text = {
            *PurePath(item.nodeid.partition(".py")[0]).parts,
            *(mark.name for mark in item.iter_markers()),
        }
        return next((k for k, word in enumerate(FIRST) if word in text), len(FIRST))

    files = groupby(items, key=lambda item: item.path)
    ranks = {path: (min(map(rank, group)), -path.stat().st_size) for path, group in files}
    items.sort(key=lambda item: ranks[item.path])


def pytest_collection_finish() -> None:
    """What collection made stays to the end: no search for garbage looks through it, then or later."""
    gc.freeze()
    gc.enable()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> LoadFileScheduling | None:
    return Together(config, log) if config.getvalue("dist") == "loadfile" else None


class Together(LoadFileScheduling):
    """A file goes to one worker, and so do all that share a costly thing: the browser, a work done again."""

    def _split_scope(self, nodeid: str) -> str:
        return next((text for text in SHARING if text in nodeid), super()._split_scope(nodeid))


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of the real measurements beside the project; without it a test is skipped, but fails in CI.

    `WORKBENCH_WITHOUT_DATA` says that a CI has none: they are not part of the project.
    """
    folder = Path(__file__).resolve().parents[2] / "shared" / "data"
    if not folder.is_dir():
        reason = f"the real measurements are not beside the project ({folder})"
        in_ci = os.environ.get("CI", "").lower() == "true"
        if in_ci and "WORKBENCH_WITHOUT_DATA" not in os.environ:
            pytest.fail(reason)
        pytest.skip(reason)
    return folder


@pytest.fixture(scope="session")
def aria():
    """The built-in arm of the ARIA paper."""
    from workbench.arm.built_in_arms import load_robot

    return load_robot("aria")


@pytest.fixture(scope="session")
def katana():
    """The built-in arm of the Katana thesis."""
    from workbench.arm.built_in_arms import load_robot

    return load_robot("katana450")


@pytest.fixture(scope="session")
def plate():
    """Table 2 of the ARIA paper."""
    from workbench.plate.measured_plate import load_plate

    return load_plate("table2")


@pytest.fixture(scope="module")
def short_polish():
    """Searches for a plate whose last part is a third as long: what they keep to is the same."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("workbench.plate.optimiser.search.POLISH_STEP_SIZES", (1.0, 0.35, 0.1))
        yield


@pytest.fixture(scope="session")
def solutions(aria, plate):
    """All branches of its targets."""
    from workbench.plate.target_branches import plate_solutions

    return plate_solutions(aria, plate)


@pytest.fixture(scope="session")
def built() -> Callable:
    """The commands as typer builds them, once a process and not once a call."""
    from typer.main import get_command

    return cache(get_command)


@pytest.fixture
def run(monkeypatch, capfd, tmp_path, built):
    """Run a command in this process, as the installed one is run: exit status, output, errors."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.setattr("typer.main.get_command", built)

    from workbench import cli

    def call(*options: str | Path) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["workbench", *map(str, options)])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        out, err = capfd.readouterr()
        return int(ended.value.code or 0), out, err

    return call


@pytest.fixture
def told(run):
    """Run a command that ends with this status: its result, and what it says."""

    def call(*options: str | Path, status: int = 0) -> tuple[Any, str]:
        ended, out, err = run(*options, "--json", "told.json")
        assert ended == status, err
        return json.loads(Path("told.json").read_text("utf-8")), out + err

    return call


@pytest.fixture
def refused(run):
    """A command ends with one sentence that names what is wrong, status 1 or 64, and no new file."""

    def call(names: Iterable[str], *options: str | Path, status: int | None = None) -> None:
        before = set(Path().rglob("*"))
        ended, out, err = run(*options)
        assert ended in ((1, 64) if status is None else (status,)), err
        (line,) = err.strip().splitlines()
        assert line.startswith("workbench: ")
        for name in names:
            assert name in line
        assert out == ""
        assert set(Path().rglob("*")) == before

    return call


class ClosedPipe(io.TextIOBase):
    """Standard output whose reader has gone."""

    encoding = "utf-8"

    def write(self, text: str) -> int:
        raise BrokenPipeError(32, "Broken pipe")


@pytest.fixture
def run_unread(run, monkeypatch):
    """Run a command whose output nobody reads."""

    def call(*options: str | Path) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "stdout", ClosedPipe())
        return run(*options)

    return call


@pytest.fixture(autouse=True)
def nothing_left_out(monkeypatch):
    """What one test leaves out on purpose is no news for the next; mistakes in what describes are raised."""
    monkeypatch.setattr("workbench.base.advice.is_strict", True)
    yield
    BROKEN.clear()
