"""Live samples: lines, sockets, standstill, capture."""

import io
import json
import socket
import threading
from dataclasses import replace

import numpy as np
import pytest

from workbench.base import se3
from workbench.base.errors import FileError, OptionError
from workbench.extras.live.connection import connect, lines_from, parse_address
from workbench.extras.live.sample import Sample, parse_sample, samples
from workbench.extras.live.standstill import ArmState, StandstillDetector

LINE = '{"time": 12.3, "q": [0.1, 0.2], "xyz": [1, 2, 3], "quat": [0.6, 0.8, 0, 0], "capture": true}'


def test_one_line():
    sample = parse_sample(LINE, line=1)
    assert (sample.time, sample.q.tolist(), sample.position.tolist()) == (12.3, [0.1, 0.2], [1, 2, 3])
    np.testing.assert_allclose(sample.rotation, [[1, 0, 0], [0, -0.28, -0.96], [0, 0.96, -0.28]], atol=1e-14)
    assert sample.capture
    assert not sample.q.flags.writeable
    again = parse_sample(json.dumps(replace(sample, time=1.0 / 3.0).plain()), line=1)
    assert (again.time, again.q.tolist(), again.position.tolist()) == (1.0 / 3.0, [0.1, 0.2], [1, 2, 3])
    assert again.rotation == pytest.approx(sample.rotation)
    bare = parse_sample('{"time": 1, "q": [0], "xyz": null}', line=1)
    assert (bare.position, bare.rotation, bare.capture) == (None, None, False)


@pytest.mark.parametrize(
    ("text", "column"),
    [
        ("[1, 2]", None),
        ("{}", "time"),
        ('{"time": 1, "q": "0.1"}', "q"),
        ('{"time": 1, "q": [NaN]}', "q"),
        ('{"q": [1]}', "time"),
        ('{"time": Infinity, "q": [1]}', "time"),
        ('{"time": 1, "q": [1], "xyz": [1, 2]}', "xyz"),
        ('{"time": 1, "q": [1], "quat": [0, 0, 0, 0]}', "quat"),
        ("[" * 60000, None),
        (" " * 70000 + "{}", None),
    ],
)
def test_bad_lines_name_their_number(text, column):
    with pytest.raises(FileError) as caught:
        parse_sample(text, line=7)
    assert (caught.value.line, caught.value.column) == (7, column)


def test_bad_lines_are_passed_over_and_told():
    messages = []
    text = io.StringIO(f"{LINE}\n\nhello\n{LINE}\n")
    assert len(list(samples(text, source="arm", on_error=messages.append))) == 2
    assert [error.line for error in messages] == [3]


def test_addresses():
    for text, address in (
        ("localhost:5000", ("localhost", 5000)),
        (":5000", ("127.0.0.1", 5000)),
        ("5000", ("127.0.0.1", 5000)),
        ("[::1]:7", ("::1", 7)),
    ):
        assert parse_address(text) == address
    for text in ("", "localhost", "localhost:", "localhost:port", "localhost:70000"):
        with pytest.raises(OptionError):
            parse_address(text)


def test_the_end_of_the_block_ends_the_iteration():
    ours, theirs = socket.socketpair()
    found = []
    with lines_from(ours) as lines:
        reader = threading.Thread(target=lambda: found.extend(lines))
        reader.start()
        theirs.sendall((LINE + "\n").encode())
    reader.join(60.0)
    theirs.close()
    assert not reader.is_alive()


def test_nobody_there():
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    with pytest.raises(FileError), connect(f"127.0.0.1:{port}"):
        pass


def sample(time, q=(0.0, 0.0), xyz=(1.0, 2.0, 3.0), angle=0.0):
    return Sample(
        time=float(time),
        q=np.array(q, float),
        position=None if xyz is None else np.array(xyz, float),
        rotation=None if xyz is None else se3.rotvec_to_matrix(np.array([0.0, 0.0, angle])),
    )


def states(samples, **options):
    detector = StandstillDetector()
    return [detector.update(one, **options) for one in samples]


def test_standing_still_takes_the_whole_window():
    found = states(sample(t) for t in (0.0, 0.2, 0.4, 0.5, 0.6))
    assert found == [ArmState.UNKNOWN, ArmState.MOVING, ArmState.MOVING, ArmState.STILL, ArmState.STILL]


@pytest.mark.parametrize(
    "moved",
    [{"q": (0.01, 0.0)}, {"xyz": (1.002, 2, 3)}, {"angle": 0.01}, {"xyz": None}, {"q": (0.0,)}],
    ids=["joint", "position", "orientation", "lost", "another arm"],
)
def test_any_motion_breaks_the_standstill(moved):
    later = [sample(t, **moved) for t in np.arange(1.0, 2.0, 0.1)]
    found = states([*(sample(t) for t in np.arange(0.0, 1.0, 0.1)), *later])
    assert found[9] is ArmState.STILL
    assert found[10] is ArmState.MOVING
    assert found.index(ArmState.STILL, 10) - 10 in (5, 6)


def test_the_noise_of_the_instrument_is_no_motion():
    rng = np.random.default_rng(0)
    noisy = [sample(t, xyz=1e-3 * rng.normal(size=3)) for t in np.arange(0.0, 3.0, 0.05)]
    assert set(states(noisy, noise=(1e-3, 0.0))[11:]) == {ArmState.STILL}
    assert ArmState.STILL not in states(noisy)


@pytest.mark.parametrize(
    ("times", "creep", "last"),
    [
        (np.arange(0.0, 5.0, 0.01), 2e-3, ArmState.MOVING),  # 1 mrad in a window
        (np.arange(0.0, 5.0, 1.0), 2e-3, ArmState.UNKNOWN),
        (np.arange(0.0, 5.0, 0.001), 0.0, ArmState.STILL),
        ([0.0, 0.3, 0.6, 0.1], 0.0, ArmState.MOVING),  # the source was restarted
    ],
    ids=["creep", "seldom", "fast", "step back"],
)
def test_streams(times, creep, last):
    assert states(sample(t, q=(creep * t, 0.0)) for t in times)[-1] is last
