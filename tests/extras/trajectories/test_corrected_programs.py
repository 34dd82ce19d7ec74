"""A program corrected: its joint targets change, not another byte."""

import re

import numpy as np
import pytest

import workbench as wb
from workbench.extras.trajectories.programs import read_program

Q = np.deg2rad([[10.0, -80.0, 95.0, -100.0, -85.0, 20.0], [-25.5, -95.25, 110.0, -70.0, -60.0, 0.0]])


DEGREES = "1.0,2.0,3.0,4.0,5.0,6.0"
STAY = "[9E9,9E9,9E9,9E9,9E9,9E9]"
RAPID_TARGET = f"VAR jointtarget p:=[[{DEGREES}],{STAY}];"
KRL_TARGET = "{A1 1.0,A2 2.0,A3 3.0,A4 4.0,A5 5.0,A6 6.0}"


def degrees(row, form="{:.2f}"):
    return [form.format(v) for v in np.rad2deg(row)]


def rapid(rows) -> str:
    lines = [f"  CONST jointtarget p{k}:=[[{','.join(degrees(r))}],{STAY}];" for k, r in enumerate(rows)]
    head, main = "MODULE Main ! [[1,2,3,4,5,6],[1,1,1,1,1,1]] é", "    MoveAbsJ p0,v100,z10,tool0;"
    return "\r\n".join([head, *lines, "  PROC main()", main, "  ENDPROC", "ENDMODULE"])


def krl(rows) -> str:
    parts = [", ".join(f"A{k + 1} {v}" for k, v in enumerate(degrees(r))) for r in rows]
    moves = "\n".join(f"PTP {{{part}, E1 5.0}} C_PTP" for part in parts)
    return f"&ACCESS RVP\nDEF p()\n;FOLD PTP P1\n{moves}\nEND\n"


def urscript(rows) -> str:
    first, second = (", ".join(f"{v:.5f}" for v in row) for row in rows)
    moves = f"  home = [{first}]\n  movej(home, a=1.4, v=1.05)\n  movej([{second}], a=1.4)\n"
    return f"def job(): # [1,2,3,4,5,6]\n{moves}  force_mode([0,0,1,0,0,0])\nend\n"


WRITTEN = {"a.mod": rapid, "a.pgf": rapid, "a": rapid, "b.src": krl, "b.bak": krl, "d.script": urscript}
WRITTEN |= {"d.txt": urscript}


@pytest.fixture
def calibrated(tmp_path):
    nominal = wb.load_robot("ur5e")
    moved = {"joint2.theta": 0.002, "joint3.a": float(nominal.values(("joint3.a",))[0]) + 1e-3}
    return nominal.with_values(moved).save(tmp_path / "calibrated.toml")


@pytest.mark.parametrize("name", WRITTEN)
def test_only_the_numbers_of_joint_targets_change(run, tmp_path, calibrated, name):
    (tmp_path / name).write_bytes(WRITTEN[name](Q).encode("latin-1"))
    asked = ("--robot", calibrated, "--nominal", "ur5e", "--out")
    status, out, err = run("compensate", name, *asked, f"new_{name}")
    assert status == 0, err
    before, after = ((tmp_path / n).read_bytes().decode("latin-1") for n in (name, f"new_{name}"))
    number = r"-?\d+\.\d+"
    assert re.sub(number, "#", before) == re.sub(number, "#", after)
    wb.write_measurements(wb.Dataset(Q), tmp_path / "q.csv")
    assert run("compensate", "q.csv", *asked, "q_new.csv")[0] == 0
    expected = wb.compensate(calibrated, tmp_path / "q.csv", nominal="ur5e").q
    shown = expected if name[0] == "d" else np.rad2deg(expected)
    found = [float(v) for v in re.findall(number, after)]
    assert all(np.abs(np.array(found) - v).min() < 1e-4 for v in shown.ravel())
    largest = float(re.search(r"maximum change: ([\d.]+)°", out)[1])
    assert largest == pytest.approx(np.rad2deg(np.abs(expected - Q).max()), abs=2e-3)


@pytest.mark.parametrize("name", WRITTEN)
def test_a_target_that_can_not_be_corrected_is_named_by_its_line(run, tmp_path, calibrated, name):
    """The second target is beyond the limits of joint 2: 7 rad."""
    rows = np.array([Q[0], [0.0, 7.0, 1.0, 0.0, 0.0, 0.0]])
    text = WRITTEN[name](rows)
    (tmp_path / name).write_text(text, encoding="latin-1", newline="")
    number = "7.00000" if name[0] == "d" else f"{np.rad2deg(7.0):.2f}"
    line = next(k for k, own in enumerate(text.split("\n"), 1) if number in own)
    status, _, err = run("compensate", name, "--robot", calibrated, "--nominal", "ur5e", "--out", "new.txt")
    assert status == 1
    assert f"{name}, line {line}: " in err
    assert len(err.strip().splitlines()) == 1


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.mod", "CONST robtarget p:=[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];", "Cartesian"),
        ("a.src", "PTP {A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}\nLIN {X 1,Y 2,Z 3,A 0,B 0,C 0}", "line 2"),
        ("a.script", "movej(p[0.1,0.2,0.3,0,0,0])", "Cartesian"),
        ("a.mod", f"{RAPID_TARGET}\nMoveJ pHome,v100,fine,tool0;", "line 2"),
        ("a.mod", f"{RAPID_TARGET}\np.robax.rax_2:=p.robax.rax_2+5;", "'p' is a joint target"),
        ("a.mod", f"{RAPID_TARGET}\nMoveAbsJ pHome,v100,fine,tool0;", "'pHome' is not a list"),
        ("a.mod", f"{RAPID_TARGET}\nMoveAbsJ [[10+5,0,0,0,0,0],{STAY}],v1,z1,tool0;", "computed"),
        ("a.src", f"PTP {KRL_TARGET}\nPTP {{A3 45}}", "1 joints"),
        ("a.src", f"PTP {KRL_TARGET}\nPTP XP7", "'XP7' is not a list"),
        ("a.src", f"E6AXIS XP1={KRL_TARGET}\nXP1.A3=XP1.A3+5\nPTP XP1", "line 2"),
        ("a.script", "q = [0,0,0,0,0,0]\nq[0] = q[0] + 0.1\nmovej(q)", "line 2"),
        ("a.drl", "movej(posj(10, 0, 9, 0, 60, 15), v=30)", "Doosan's DRL"),
    ],
)
def test_what_can_not_be_read_is_refused(refused, tmp_path, calibrated, name, text, message):
    (tmp_path / name).write_text(text)
    command = ("compensate", name, "--robot", calibrated, "--nominal", "ur5e", "--out", "new.txt")
    refused([message], *command, status=1)


AROUND = {
    "a.mod": "PERS tooldata t:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];\n"
    f"CONST jointtarget p{{2}}:=[[[{DEGREES}],{STAY}],\r\n"
    " [[1E+1,-.5,3,4,5,6.],[100,9E9,9E9,9E9,9E9,9E9]]];\n"
    f"MoveAbsJ \\Conc, p{{1}}, v100, z10, t;\nmoveabsj [[{DEGREES}],{STAY}]\\NoEOffs,v1,z1,t;",
    "a.src": "$TOOL={X 0,Y 0,Z 100,A 0,B 0,C 0}\nPTP $AXIS_ACT\n"
    f"ptp {KRL_TARGET.lower()} c_ptp ;{KRL_TARGET}\n"
    "E6AXIS XP1={E6AXIS: A2 2.0,A1 1.0,A3 3.0,A4 4.0,A5 5.0,A6 6.0,E1 7.0}\nXP1.E1=8\nPTP XP1\n",
    "a.script": "set_tcp(p[0,0,0.1,0,0,0])\nglobal home = [1.0,2.0,3.0,4.0,5.0,6.0]\n"
    'popup("movej([9,9,9,9,9,9])")\nmovej(q=[1e-1,2,3,4,5,6], a=1)\n'
    "movej(home)\nspeedj([0,0,0,0,0,0.1],1,2)\n",
}


@pytest.mark.parametrize(("name", "count"), [("a.mod", 3), ("a.src", 2), ("a.script", 2)])
def test_what_stands_around_the_targets_is_no_target(tmp_path, name, count):
    (tmp_path / name).write_bytes(AROUND[name].encode())
    program = read_program(tmp_path / name, 6)
    assert len(program.q) == count
    program.save(program.q + np.arange(6) * program.language.unit, tmp_path / f"new_{name}")
    again = read_program(tmp_path / f"new_{name}", 6)
    np.testing.assert_allclose(
        (again.q - program.q) / program.language.unit, np.tile(np.arange(6), (count, 1)), atol=1e-3
    )
    assert _around(program) == _around(again)


def _around(program) -> str:
    """The text without the numbers of its targets."""
    spans = sorted(span for row in program.spans for span in row)
    cuts = [0, *(at for span in spans for at in span), len(program.text)]
    return "|".join(program.text[a:b] for a, b in zip(cuts[::2], cuts[1::2], strict=True))
