"""Self-contained programs that correct joints: a Python file for numpy, a C header for libc and libm.

The program is that of `compensate` (`extras/trajectories/correction.py`, iterated), in `standalone.py` and
`standalone.h`; the export fills in the arm: elements, constants, masses, and effects as terms (`terms.py`).
"""

import json
from collections.abc import Iterable
from importlib.resources import files
from typing import Any, final

import numpy as np

from workbench.arm.inverse.damped_newton import ROTATION_WEIGHT
from workbench.arm.inverse.reduced_arm import compile_arm
from workbench.arm.robot import Robot
from workbench.arm.statics.wrenches import masses, mounts
from workbench.base.errors import OptionError
from workbench.exports.export_format import AbstractForm, Job
from workbench.extras.controllers.programs.terms import CodeTerm, TermKind, terms_of
from workbench.identification.errors.comparable_arms import comparable

EMPTY = "ARM: dict = {}  # filled in by the export"


def arm_data(job: Job, form: str) -> dict[str, Any]:
    """What `standalone.py` needs of an arm."""
    arms = comparable(job.robot, job.require_nominal(form))
    robot, nominal = arms.calibrated, arms.nominal
    chain, arm, plain = robot.chain, compile_arm(robot), compile_arm(nominal)
    terms = [term for effect in robot.effects for term in terms_of(effect, chain)]
    loaded = any(term.kind >= TermKind.LOAD for term in terms)
    if loaded and not robot.has_masses:
        raise OptionError(
            f"--for {form}: effects of '{robot.name}' need the moments of its joints, but not all masses "
            "are known; add 'mass' and 'com' to each [[joint]]",
            option="--for",
            found=form,
        )
    if list(arm.columns) != list(range(robot.dof)) or list(arm.columns) != list(plain.columns):
        raise OptionError(f"--for {form}: joints of '{robot.name}' must be in the order of q")
    links = []
    if loaded:
        w = masses(robot)
        links = [(int(a), float(m), *c.tolist()) for a, m, c in zip(w.after, w.mass, w.com, strict=True)]
    return {
        "name": robot.name,
        "dof": robot.dof,
        "task": int(arms.task),
        "weight": ROTATION_WEIGHT * arm.length,
        "limits": robot.limits.tolist(),
        "slides": arm.slides.tolist(),
        "rigid": arm.constants.tolist(),
        "nominal": plain.constants.tolist(),
        "chain": [
            (int(e.axis), int(d), float(v), None if e.matrix is None else e.matrix.tolist())
            for e, d, v in zip(chain.elements, chain.drivers, chain.values, strict=True)
        ],
        "driven": chain.driven.tolist(),
        "mounts": mounts(robot).tolist(),
        "gravity": robot.gravity.tolist(),
        "masses": links,
        "warm": any(t.kind is TermKind.WARM for t in terms),
        "directed": any(t.kind is TermKind.DIRECTION for t in terms),
        "terms": [t._asdict() | {"kind": int(t.kind)} for t in terms],
    }


class AbstractProgram(AbstractForm):
    """A program that computes with the whole calibrated model."""

    takes_calibrated = True

    def read(self, text: str, job: Job) -> Robot | None:
        return None

    def notes(self, job: Job) -> Iterable[str]:
        yield from comparable(job.robot, job.require_nominal(self.name)).notes
        yield "poses are in the robot's base, with the calibrated tool; loads are those of the arm at rest"


@final
class PythonModule(AbstractProgram):
    """`standalone.py` with an arm in it."""

    name = "python-module"
    title = "Python file (numpy) that corrects joints and poses, with all effects"
    ending = ".py"

    def write(self, job: Job) -> str:
        data = arm_data(job, self.name)
        text = files(__package__).joinpath("standalone.py").read_text(encoding="utf-8")
        lines = ",\n".join(f"    {key!r}: {_python(value)}" for key, value in data.items())
        return text.replace(EMPTY, f"ARM: dict = {{\n{lines},\n}}", 1)


def _python(value: Any) -> str:
    return repr(value).replace("inf", 'float("inf")')


@final
class CHeader(AbstractProgram):
    """`standalone.h` with an arm in it."""

    name = "c-header"
    title = "C header (libc, libm) that corrects joints and poses, with all effects"
    ending = ".h"

    def write(self, job: Job) -> str:
        text = files(__package__).joinpath("standalone.h").read_text(encoding="utf-8")
        return text.replace("/*DATA*/", _c_data(arm_data(job, self.name)), 1)


def _c_data(data: dict[str, Any]) -> str:
    """The arm as C: sizes, tables, terms."""
    axes, drivers, values, matrices = zip(*data["chain"], strict=True)
    constants = [m for m in matrices if m is not None]
    places = np.cumsum([m is not None for m in matrices]) - 1
    terms = [CodeTerm(**term) for term in data["terms"]]
    knots = [x for t in terms for x in t.knots]
    cubics = [c for t in terms for row in t.cubics for c in row]
    rows, first, cubic = [], 0, 0
    for t in terms:
        numbers = [
            int(t.kind),
            *t[1:5],
            *map(_number, t[5:11]),
            _row(t.direction),
            first,
            cubic,
            len(t.cubics),
        ]
        rows.append(f"{{{', '.join(map(str, numbers))}}}")
        first, cubic = first + len(t.knots), cubic + len(t.cubics)
    flat = [[v for row in m[:3] for v in row] for m in constants]
    sizes = {"N": data["dof"], "K": len(axes), "LINKS": len(data["masses"]), "TERMS": len(terms)}
    sizes |= {"TASK": data["task"], "WARM": int(data["warm"]), "DIRECTED": int(data["directed"])}
    links = data["masses"] or [(0, 0.0, 0.0, 0.0, 0.0)]
    lines = [
        f"#define ARM_NAME {json.dumps(data['name'], ensure_ascii=True)}",
        *(f"#define ARM_{name} {value}" for name, value in sizes.items()),
        f"#define ARM_WEIGHT {_number(data['weight'])}",
        "",
        "typedef struct {",
        "    int kind, element, i, j, k;",
        "    double a, b, c, low, high, span, direction[3];",
        "    int first, cubic, pieces; /* of a spline: knot, polynomial, number of pieces */",
        "} arm_term;",
        "",
        _table("int ARM_AXIS[]", axes),
        _table("int ARM_DRIVER[]", drivers),
        _table("double ARM_VALUE[]", map(_number, values)),
        _table(
            "int ARM_CONSTANT[]", [p if m is not None else -1 for p, m in zip(places, matrices, strict=True)]
        ),
        _table("double ARM_CONSTANTS[][12]", map(_row, flat or [[0.0] * 12])),
        _table("int ARM_DRIVEN[]", data["driven"]),
        _table("int ARM_MOUNT[]", data["mounts"]),
        _table("int ARM_SLIDES[]", map(int, data["slides"])),
        _table("double ARM_LIMITS[][2]", map(_row, data["limits"])),
        _table("double ARM_GRAVITY[]", map(_number, data["gravity"])),
        _table("int ARM_AFTER[]", [link[0] for link in links]),
        _table("double ARM_MASS[]", [_number(link[1]) for link in links]),
        _table("double ARM_COM[][3]", [_row(link[2:]) for link in links]),
        _table("double ARM_RIGID[][12]", [_row(np.ravel(m)[:12]) for m in data["rigid"]]),
        _table("double ARM_NOMINAL[][12]", [_row(np.ravel(m)[:12]) for m in data["nominal"]]),
        _table("double ARM_KNOTS[]", map(_number, knots or [0.0, 0.0])),
        _table("double ARM_CUBICS[]", map(_number, cubics or [0.0] * 4)),
        _table("arm_term ARM_TERM[]", rows or ["{0}"]),
    ]
    return "\n".join(lines)


def _number(value: float) -> str:
    return repr(float(value)).replace("inf", "INFINITY")


def _row(values: Iterable[float]) -> str:
    return f"{{{', '.join(map(_number, values))}}}"


def _table(head: str, entries: Iterable[Any]) -> str:
    return f"static const {head} = {{{', '.join(map(str, entries))}}};"
