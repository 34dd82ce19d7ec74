"""Trajectories from end to end at the command line."""

from pathlib import Path

import numpy as np

from workbench import Dataset, Frame, Motion, load_robot, read_trajectory, tool_poses, write_measurements


def test_a_compensated_path_is_corrected_where_only_positions_count(run, refused):
    """A path of ARIA's, with its poses in the robot's base and without."""
    q = np.linspace([0.1, 0.4, -1.2, 0.2, 0.5, 0.1], [0.4, 0.5, -1.0, 0.4, 0.7, 0.3], 60)
    poses, time = (
        tool_poses(load_robot("aria").with_frames(base=Frame()), Motion(q)),
        np.linspace(0.0, 8.0, 60),
    )
    write_measurements(Dataset(q, poses[:, :3, 3], poses[:, :3, :3], time=time), "c.csv")
    refused((), "compensate", "c.csv", "--robot", "ur5", "--nominal", "aria", "--out", "k.csv", status=1)
    head = ",".join(["time[s]", *(f"q{k}[deg]" for k in range(1, 7))])
    table = np.column_stack([time, np.rad2deg(q)])
    np.savetxt("d.csv", table, delimiter=",", header=head, comments="", fmt="%.17g")
    for name in "cd":
        options = ("compensate", f"{name}.csv", "--robot", "aria-table4", "--nominal", "aria")
        assert run(*options, "--out", f"k{name}.csv", "--positions-only")[0] == 0
    own, shown = (read_trajectory(f"k{name}.csv", joints=6) for name in "cd")
    np.testing.assert_allclose(shown.q, own.q, atol=1e-9)
    assert Path("kd.csv").read_text().partition("\n")[0] == head
    Path("e.csv").write_text(Path("d.csv").read_text().replace("time[s]", "timestamp"))
    options = ("--robot", "aria-table4", "--nominal", "aria", "--out", "ke.csv", "--positions-only")
    refused(["timestamp[s]"], "compensate", "e.csv", *options)
    Path("e.csv").write_text(Path("d.csv").read_text().replace("time[s]", "speed"))
    assert "columns left out: 'speed'" in run("compensate", "e.csv", *options)[1]
