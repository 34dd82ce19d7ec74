"""A program corrected: its joint targets change, not another byte."""

import re

import numpy as np
import pytest

import workbench as wb

Q = np.deg2rad([[10.0, -80.0, 95.0, -100.0, -85.0, 20.0], [-25.5, -95.25, 110.0, -70.0, -60.0, 0.0]])


def degrees(row, form="{:.2f}"):
    return [form.format(v) for v in np.rad2deg(row)]


def rapid(rows) -> str:
    lines = [
        f"  CONST jointtarget p{k}:=[[{','.join(degrees(r))}],[9E9,9E9,9E9,9E9,9E9,9E9]];"
        for k, r in enumerate(rows)
    ]
    return "\r\n".join(
        [
            "MODULE Main ! [[1,2,3,4,5,6],[1,1,1,1,1,1]] é",
            *lines,
            "  PROC main()",
            "    MoveAbsJ p0,v100,z10,tool0;",
            "  ENDPROC",
            "ENDMODULE",
        ]
    )


def krl(rows) -> str:
    parts = [", ".join(f"A{k + 1} {v}" for k, v in enumerate(degrees(r))) for r in rows]
    return (
        "&ACCESS RVP\nDEF p()\n;FOLD PTP P1\n"
        + "\n".join(f"PTP {{{p}, E1 5.0}} C_PTP" for p in parts)
        + "\nEND\n"
    )


def jbi(rows) -> str:
    lines = [f"C{k:05d}={','.join(degrees(r))}" for k, r in enumerate(rows)]
    return "\r\n".join(
        [
            "/JOB",
            "//NAME A",
            "//POS",
            "///NPOS 2,0,0,0,0,0",
            "///POSTYPE ANGLE",
            "///ANGLE",
            *lines,
            "//INST",
            "MOVJ C00000 VJ=10.00",
            "END",
            "",
        ]
    )


def urscript(rows) -> str:
    first, second = (", ".join(f"{v:.5f}" for v in row) for row in rows)
    moves = f"  home = [{first}]\n  movej(home, a=1.4, v=1.05)\n  movej([{second}], a=1.4)\n"
    return f"def job(): # [1,2,3,4,5,6]\n{moves}  force_mode([0,0,1,0,0,0])\nend\n"


WRITTEN = {"a.mod": rapid, "b.src": krl, "c.jbi": jbi, "d.script": urscript}


@pytest.fixture
def calibrated(tmp_path):
    nominal = wb.load_robot("ur5e")
    moved = {"joint2.theta": 0.002, "joint3.a": float(nominal.values(("joint3.a",))[0]) + 1e-3}
    return nominal.with_values(moved).save(tmp_path / "calibrated.toml")


@pytest.mark.parametrize("name", WRITTEN)
def test_only_the_numbers_of_joint_targets_change(run, tmp_path, calibrated, name):
    (tmp_path / name).write_bytes(WRITTEN[name](Q).encode("latin-1"))
    status, out, err = run(
        "compensate", name, "--robot", calibrated, "--nominal", "ur5e", "--out", f"new_{name}"
    )
    assert status == 0, err
    before, after = ((tmp_path / n).read_bytes().decode("latin-1") for n in (name, f"new_{name}"))
    number = r"-?\d+\.\d+"
    assert re.sub(number, "#", before) == re.sub(number, "#", after)
    wb.write_measurements(wb.Dataset(Q), tmp_path / "q.csv")
    assert (
        run("compensate", "q.csv", "--robot", calibrated, "--nominal", "ur5e", "--out", "q_new.csv")[0] == 0
    )
    expected = wb.compensate(calibrated, tmp_path / "q.csv", nominal="ur5e").q
    shown = expected if name == "d.script" else np.rad2deg(expected)
    found = [float(v) for v in re.findall(number, after)]
    assert all(np.abs(np.array(found) - v).min() < 1e-4 for v in shown.ravel())
    largest = float(re.search(r"largest change: ([\d.]+)°", out)[1])
    assert largest == pytest.approx(np.rad2deg(np.abs(expected - Q).max()), abs=2e-3)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.mod", "CONST robtarget p:=[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];", "Cartesian"),
        ("a.src", "PTP {A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}\nLIN {X 1,Y 2,Z 3,A 0,B 0,C 0}", "line 2"),
        ("a.jbi", "///POSTYPE PULSE\n///PULSE\nC00000=1,2,3,4,5,6", "pulses"),
        ("a.script", "movej(p[0.1,0.2,0.3,0,0,0])", "pose"),
        ("a.script", "movej([d2r(10),0,0,0,0,0])", "computed"),
        ("a.mod", "CONST jointtarget p:=[[0,0,0,0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];", "7 joints"),
        ("a.mod", "MODULE x\nENDMODULE", "no joint target"),
    ],
)
def test_what_can_not_be_read_is_refused(run, tmp_path, calibrated, name, text, words):
    (tmp_path / name).write_text(text)
    status, _, err = run("compensate", name, "--robot", calibrated, "--nominal", "ur5e", "--out", "new.txt")
    assert status == 1
    assert words in err
    assert not (tmp_path / "new.txt").exists()
