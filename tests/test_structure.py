"""The package's own rules, read from its source: who imports whom, what is abstract."""

import ast
import re
import subprocess
import sys
import tomllib
from collections import Counter
from collections.abc import Iterable
from dataclasses import fields
from functools import cache
from importlib import import_module
from pathlib import Path

from workbench import WorkbenchError, parts

ROOT = Path(__file__).resolve().parents[1] / "workbench"
WINGS = [
    "parts", "base", "report", "arm", "data", "plate", "identification", "diagnosis", "exports", "session",
    "views", "cli", "extras", "__main__",
]  # fmt: skip
PLACE = {name: i for i, name in enumerate(WINGS)}
HOMES = {
    "viser": {"views/page", "extras"},
    "rerun": {"views/recording", "extras/review"},
    "typer": {"cli"},
    "yourdfpy": {"arm"},
    "ezdxf": {"extras/workshop"},
    "matplotlib": {"extras/workshop"},
    "OCP": {"extras/workshop"},
    "rosbags": {"extras/logs"},
    "playwright": set(),
}
"""With the order of the wings they keep viewers and the command line out of the numeric core."""
UPWARDS = {("arm/robot.py", name) for name in ("robot_from_rows", "save_robot", "tool_poses")}
"""`Robot.from_dh`, `save` and `predict` call these, which take or make a `Robot`."""
LONGEST = 600
BUDGETS = {
    "root": 251,
    "base": 2_041,
    "report": 798,
    "arm": 8_733,
    "data": 5_356,
    "plate": 4_720,
    "identification": 9_158,
    "diagnosis": 6_818,
    "exports": 588,
    "session": 6_080,
    "views": 6_704,
    "cli": 1_338,
    "extras": 1,
    "extras/camera": 3_481,
    "extras/controllers": 686,
    "extras/hobby": 739,
    "extras/katana": 998,
    "extras/live": 1_024,
    "extras/logs": 895,
    "extras/pendant": 2_027,
    "extras/poses": 876,
    "extras/production": 447,
    "extras/reproduce": 88,
    "extras/review": 266,
    "extras/service": 1_165,
    "extras/trajectories": 895,
    "extras/workshop": 828,
    "tests": 38_291,
}
"""Lines of Python that each wing, each extra and all tests may have: they may only fall."""
READING_SET = 17_771
"""Lines of the files that `workbench/README.md` lists to be read first: they may only fall, to 17,000."""
FILES = sorted(p for p in ROOT.rglob("*.py"))
EXTRAS = [p.parent for p in ROOT.glob("extras/*/__init__.py")]
OF_EXTRAS = ("extras", "studies", "benchmarks")
"""Folders of tests that use extras."""


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def module(path: Path) -> str:
    """Dotted name of a file's module."""
    parts = path.relative_to(ROOT.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module(p): p for p in FILES}


def part(path: Path) -> str:
    """The wing of a file: the name right below the package."""
    return path.relative_to(ROOT).parts[0].removesuffix(".py")


def label(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def called(node: ast.Call) -> str:
    """What a call calls: a name, or an attribute after its dot; by hand, as `ast.unparse` takes seconds."""
    return f".{node.func.attr}" if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")


@cache
def nodes(path: Path) -> list[ast.Import | ast.ImportFrom | ast.Call]:
    """What the rules look at, in one walk of each file."""
    kinds = ast.Import | ast.ImportFrom | ast.Call
    return [node for node in ast.walk(tree(path)) if isinstance(node, kinds)]


@cache
def imports(path: Path) -> list[tuple[str, int]]:
    """Dotted names that a file imports anywhere, deferred ones and those of `import_module` too."""
    package = module(path).split(".")[: None if path.name == "__init__.py" else -1]
    return imports_of(nodes(path), package)


def imports_of(nodes: Iterable[ast.AST], package: list[str]) -> list[tuple[str, int]]:
    """The same of nodes of a file in a package."""
    found = []
    for node in nodes:
        if isinstance(node, ast.Import):
            found += [(a.name, node.lineno) for a in node.names]
        elif isinstance(node, ast.ImportFrom):
            up = package[: len(package) - node.level + 1] if node.level else []
            base = ".".join([*up, *([node.module] if node.module else [])])
            found += [(f"{base}.{a.name}", node.lineno) for a in node.names]
        elif isinstance(node, ast.Call) and called(node).endswith("import_module"):
            found += [(a.value, node.lineno) for a in node.args[:1] if isinstance(a, ast.Constant)]
    return found


def test_wings_import_earlier_wings_only():
    wrong = []
    for path in FILES:
        mine = part(path)
        for name, line in imports(path):
            text = name.split(".")
            if text[0] != "workbench":
                continue
            other = text[1] if len(text) > 1 else "__init__"
            # the package itself hands names out by need; commands call its verbs
            if mine == "__init__" or (mine in ("cli", "extras") and other == "__init__"):
                continue
            if other != mine and PLACE.get(other, len(WINGS)) >= PLACE[mine]:
                wrong.append(f"{label(path)}, line {line}: imports {name}")
    assert not wrong
    at_once = imports_of(tree(ROOT / "__init__.py").body, ["workbench"])
    assert not [name for name, _ in at_once if name.startswith("workbench")]


def test_files_import_each_other_in_no_circle():
    """Deferred imports count; those of a robot's conveniences alone lead upwards."""
    from networkx import DiGraph, simple_cycles

    graph: dict[str, set[str]] = {label(path): set() for path in FILES}
    upwards = set()
    for path in FILES:
        for name, _ in imports(path):
            home = name if name in MODULES else name.rpartition(".")[0]
            if (label(path), name.rpartition(".")[2]) in UPWARDS:
                upwards.add((label(path), name.rpartition(".")[2]))
            elif home in MODULES and home != module(path) and name.split(".")[-1] not in for_types(path):
                graph[label(path)].add(label(MODULES[home]))
    assert not next(simple_cycles(DiGraph(graph)), None)
    assert upwards == UPWARDS
    named = [label(path) for path in FILES if "resolve_name" in path.read_text(encoding="utf-8")]
    assert not named  # an import by a name in a string counts too


@cache
def for_types(path: Path) -> set[str]:
    """Names that a file imports for type checkers alone."""
    blocks = [
        node
        for node in tree(path).body
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
    ]
    return {name.split(".")[-1] for block in blocks for name, _ in imports_of(ast.walk(block), [])}


def extra(name: str) -> str:
    """The extra that a dotted name belongs to; empty for the core."""
    text = name.split(".")
    return text[2] if text[:2] == ["workbench", "extras"] and len(text) > 2 else ""


def test_the_core_imports_no_extra_and_an_extra_no_other():
    wrong = [
        f"{label(path)}, line {line}: imports {name}"
        for path in FILES
        for name, line in imports(path)
        if extra(name) not in ("", extra(module(path))) or name == "workbench.extras"
    ]
    assert not wrong
    assert {extra(name) for name in MODULES} > {""}


def test_no_test_of_the_core_imports_an_extra():
    """The works done again and benchmarks use what they need; a test of the core goes on without."""
    tests = ROOT.parent / "tests"
    files = [p for p in tests.rglob("*.py") if p.relative_to(tests).parts[0] not in OF_EXTRAS]
    assert len(files) > 100
    wrong = [p.name for p in files if re.search(r"^\s*(from|import) workbench\.extras", p.read_text(), re.M)]
    assert not wrong


def test_every_extra_has_a_documentation_page():
    table = re.findall(r"^\| `(\w+)/` \| .*? \| `(\w+\.md)` \|", (ROOT / "README.md").read_text(), re.M)
    assert {name for name, _ in table} == {path.name for path in EXTRAS}
    assert all((ROOT.parent / "assets/docs" / page).is_file() for _, page in table)


def test_extras_come_in_by_their_records():
    """Each names parts of its own, which are there; what the typed root shows of extras is among them."""
    assert set(parts.EXTRAS) == {path.name for path in EXTRAS}
    every = [each for field in fields(parts.Parts) for each in parts.offered(field.name)]
    assert {origin for _, _, origin in every} == {f"workbench.extras.{name}" for name in parts.EXTRAS}
    assert not [part for _, part, origin in every if not part.startswith(f"{origin}.")]
    assert all(map(parts.resolved, (part for _, part, _ in every)))
    root = imports_of(ast.walk(ast.parse((ROOT / "__init__.pyi").read_text())), ["workbench"])
    typed = {name.rpartition(".")[2]: name for name, _ in root if extra(name)}
    assert typed == {name: part.replace(":", ".") for name, part, _ in parts.offered("root")}


def test_libraries_stay_where_their_idea_lives():
    wrong = [
        f"{label(path)}, line {line}: imports {name}"
        for path in FILES
        for name, line in imports(path)
        if name.split(".")[0] in HOMES
        and not any(label(path).startswith(f"{home}/") for home in HOMES[name.split(".")[0]])
    ]
    assert not wrong


def test_what_takes_long_to_load_is_loaded_when_it_is_used():
    """By arms, fits, readers, and the page before its first picture; each of these takes up to a second.

    Nor does an import read parts: a record that imports half the program must be able to, whatever is first.
    """
    heavy = ("scipy.interpolate", "scipy.signal", "scipy.stats", "matplotlib", "pandas", "pint", "openpyxl")
    heavy += ("trimesh", "rerun", "joblib")
    steps = (
        "import workbench as wb, workbench.diagnosis.diagnose, workbench.cli; from workbench import parts",
        unread := "assert not parts._installed.cache_info()[1]",
        "wb.load_robot('aria'); wb.identify; wb.diagnose; print('coal' in sys.modules)",
        "parts._installed.cache_clear()",
        "import workbench.data.readers, workbench.views.page.app, workbench.views.recording.recorder",
        unread,
        "from workbench.views.page.panels import panels; panels()",
        "import workbench.identification.report.document",
        f"print([n for n in {heavy!r} if n in sys.modules])",
    )
    run = subprocess.run(
        [sys.executable, "-c", "; ".join(("import sys", *steps))],
        capture_output=True,
        text=True,
        cwd=ROOT.parent,
        check=False,
    )
    assert (run.returncode, run.stdout.split()) == (0, ["False", "[]"]), run.stderr


IMPORTED_AS = {"coal": "pin", "pinocchio": "pin", "PIL": "pillow", "rerun": "rerun-sdk", "tomli_w": "tomli-w",
               "cv2": "opencv-python-headless", "OCP": "cadquery-ocp-novtk"}  # fmt: skip
"""Distributions that are called otherwise than what is imported of them."""


def names(requirements: list[str]) -> set[str]:
    """Of distributions, without their versions."""
    return {re.match(r"[\w.-]+", text)[0].lower() for text in requirements}


def test_the_package_imports_what_it_declares():
    """Always what a plain installation has; inside functions what an extra brings as well."""
    project = tomllib.loads((ROOT.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    base, kinds = names(project["dependencies"]), project["optional-dependencies"]
    extras = base.union(*(names(kinds[kind]) for kind in kinds if kind not in ("test", "docs", "dev")))
    undeclared = set()
    for path in FILES:
        for node in nodes(path):
            if isinstance(node, ast.Import):
                modules = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and not node.level:
                modules = [node.module or ""]
            else:
                continue
            for module in {name.split(".")[0] for name in modules} - set(sys.stdlib_module_names):
                declared = extras if node.col_offset else base
                if IMPORTED_AS.get(module, module).lower() not in declared | {"workbench"}:
                    undeclared.add((label(path), module))
    assert undeclared == {("extras/reproduce/commands.py", "studies")}  # the checkout's own folder


def test_modules_named_in_texts_exist():
    """In docstrings, in READMEs, and in scripts that tests hand to another Python."""
    top = ROOT.parent
    texts = [p for folder in ("workbench", "tests") for p in (top / folder).rglob("*.[pm][yd]")]
    wrong = []
    for path in [*texts, top / "README.md"]:
        text = path.read_text(encoding="utf-8")
        for name in re.findall(r"\bworkbench(?:\.[a-z_]\w*)+\b(?!/)", text):
            if name not in MODULES and name.rpartition(".")[0] not in MODULES:
                wrong.append(f"{path.relative_to(top)}: {name}")
        for name in re.findall(r"`((?:\w+/)+\w+\.py)`", text):
            if not any((home / name).is_file() for home in (top, ROOT, top / "tests", path.parent)):
                wrong.append(f"{path.relative_to(top)}: {name}")
    assert not wrong


def test_annotations_are_not_postponed():
    """Nor `Self`: what checks shapes at run time reads neither in a method that it checks by itself."""
    refused = ("__future__.annotations", "typing.Self")
    assert not [label(p) for p in FILES for name, _ in imports(p) if name in refused]


def test_files_are_short():
    assert not {label(p): lines(p) for p in FILES if lines(p) > LONGEST}


def test_budgets_hold():
    """By wing and extra, and all tests."""
    sizes = Counter(tests=sum(map(lines, (ROOT.parent / "tests").rglob("*.py"))))
    for path in FILES:
        *folders, _ = path.relative_to(ROOT).parts
        sizes["/".join(folders[: 1 + (folders[:1] == ["extras"])]) or "root"] += lines(path)
    assert not {name: (n, BUDGETS.get(name, 0)) for name, n in sizes.items() if n > BUDGETS.get(name, 0)}


def test_the_reading_set_is_short():
    listed = (ROOT / "README.md").read_text(encoding="utf-8").partition("## To read in two days")[2]
    names = re.findall(r"`(\w[\w/]*(?:\.py|/))`", listed.partition("\n## ")[0])
    paths = [ROOT / name for name in names]
    assert not [str(path) for path in paths if not path.exists()]
    size = sum(lines(p) for path in paths for p in ([path] if path.is_file() else path.rglob("*.py")))
    assert len(names) > 40
    assert size <= READING_SET


def lines(path: Path) -> int:
    return len(path.read_text(encoding="utf-8").splitlines())


@cache
def classes() -> list[type]:
    modules = [import_module(name) for name in MODULES if not name.endswith("__main__")]
    found = {kind for home in modules for kind in vars(home).values() if isinstance(kind, type)}
    return sorted((kind for kind in found if kind.__module__ in MODULES), key=path_of)


def path_of(kind: type) -> str:
    return f"{kind.__module__}.{kind.__qualname__}"


def bases(kind: type) -> list[type]:
    """Of the package, all the way up."""
    return [base for base in kind.__mro__[1:] if base.__module__ in MODULES]


def is_abstract(kind: type) -> bool:
    """Abstract by name, or a protocol, which has nothing but abstract members."""
    return getattr(kind, "_is_protocol", False) or kind.__name__.removeprefix("_").startswith("Abstract")


def test_records_are_frozen():
    records = [kind for kind in classes() if "__dataclass_params__" in vars(kind)]
    assert len(records) > 100
    assert not [path_of(kind) for kind in records if not kind.__dataclass_params__.frozen]


def test_classes_are_abstract_or_final():
    concrete = [kind for kind in classes() if not is_abstract(kind)]
    for kind in concrete:
        marked = [name for name, part in vars(kind).items() if getattr(part, "__isabstractmethod__", False)]
        assert not marked, f"{path_of(kind)} has abstract methods but not the name"
    assert {base for kind in classes() for base in bases(kind) if not is_abstract(base)} == {WorkbenchError}


def test_one_class_name_is_one_class():
    names = Counter(kind.__name__ for kind in classes())
    assert not [name for name, count in names.items() if count > 1]


def test_private_parts_of_viser_stand_in_one_file():
    """What a new version of viser may break is found there."""
    wrong = [
        f"{label(path)}, line {line}: {name}"
        for path in FILES
        for name, line in imports(path)
        if (name.startswith("viser.") and ("._" in name or name.startswith("viser.infra")))
        or name.startswith("unittest")
    ]
    private = ("_websock", "._impl", "_server_thread", "_tab_labels", "rich.print =")
    wrong += [f"{label(path)}: {word}" for path in FILES for word in private if word in path.read_text()]
    assert wrong
    assert {line.partition(",")[0].partition(":")[0] for line in wrong} == {"views/page/viser_internals.py"}


def test_the_top_level_holds_nothing_else():
    """Wheels of 131 MB and a designed plate were once committed there."""
    kept = {"LICENSE", "README.md", "assets", "pyproject.toml", "recordings", "tests", "workbench"}
    run = subprocess.run(["git", "-C", ROOT.parent, "ls-files"], capture_output=True, text=True, check=False)
    assert {name.partition("/")[0] for name in run.stdout.split("\n") if name[:1] not in ("", ".")} <= kept
