"""The package's own rules, read from its source: who imports whom, what is abstract."""

import ast
import re
import subprocess
import sys
import tomllib
from collections import Counter
from collections.abc import Iterable
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1] / "workbench"
LADDER = [
    "base",
    "report",
    "arm",
    "data",
    "plate",
    "identification",
    "diagnosis",
    "paths",
    "exports",
    "session",
    "views",
    "cli",
    "extras",
    "__main__",
]
RUNG = {name: i for i, names in enumerate(LADDER) for name in names.split()}
HOMES = {
    "viser": {"views/page", "extras"},
    "rerun": {"views/recording"},
    "typer": {"cli"},
    "yourdfpy": {"arm"},
    "ezdxf": {"extras/workshop"},
    "OCP": {"extras/workshop"},
    "rosbags": {"extras/logs"},
    "ezc3d": {"extras/logs"},
    "playwright": set(),
}
"""With the ladder they keep viewers and the command line out of the numeric core."""
NOTHING = {"None", "()", "{}", "''", "self", "NONE", "NO_UNKNOWNS"}
"""What a method that says nothing returns."""
LONGEST = 450
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
    """The rung's word of a file: the name right below the package."""
    return path.relative_to(ROOT).parts[0].removesuffix(".py")


def label(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def called(node: ast.Call) -> str:
    """What a call calls: a name, or an attribute after its dot; by hand, as `ast.unparse` takes seconds."""
    return f".{node.func.attr}" if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")


@cache
def nodes(path: Path) -> list[ast.Import | ast.ImportFrom | ast.Call | ast.ClassDef]:
    """What the rules look at, in one walk of each file."""
    kinds = ast.Import | ast.ImportFrom | ast.Call | ast.ClassDef
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


def test_every_module_has_a_rung():
    assert {part(p) for p in FILES} - {"__init__"} <= set(RUNG)


def test_imports_climb_one_ladder():
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
            if other != mine and RUNG.get(other, len(LADDER)) >= RUNG[mine]:
                wrong.append(f"{label(path)}, line {line}: imports {name}")
    assert not wrong
    at_once = imports_of(tree(ROOT / "__init__.py").body, ["workbench"])
    assert not [name for name, _ in at_once if name.startswith("workbench")]


def test_files_import_each_other_in_no_circle():
    """Deferred imports count."""
    graph: dict[str, set[str]] = {label(path): set() for path in FILES}
    for path in FILES:
        for name, _ in imports(path):
            home = name if name in MODULES else name.rpartition(".")[0]
            if home in MODULES and home != module(path) and name.split(".")[-1] not in for_types(path):
                graph[label(path)].add(label(MODULES[home]))
    assert not [part for part in strongly_connected(graph) if len(part) > 1]


@cache
def for_types(path: Path) -> set[str]:
    """Names that a file imports for type checkers alone."""
    blocks = [
        node
        for node in tree(path).body
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
    ]
    return {name.split(".")[-1] for block in blocks for name, _ in imports_of(ast.walk(block), [])}


def strongly_connected(graph: dict[str, set[str]]) -> list[set[str]]:
    """Groups of nodes that reach each other."""
    import networkx

    return list(networkx.strongly_connected_components(networkx.DiGraph(graph)))


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


def test_extras_come_in_by_entry_points():
    """Those of an extra lead into its folder; what the typed root shows of extras is there."""
    groups = tomllib.loads((ROOT.parent / "pyproject.toml").read_text())["project"]["entry-points"]
    homes = [home for parts in groups.values() for home in parts.values()]
    assert {extra(home.partition(":")[0]) for home in homes} == {p.name for p in EXTRAS}
    root = imports_of(ast.walk(ast.parse((ROOT / "__init__.pyi").read_text())), ["workbench"])
    typed = {name.rpartition(".")[2]: name for name, _ in root if extra(name)}
    assert typed == {name: home.replace(":", ".") for name, home in groups["workbench.root"].items()}


def test_the_package_hands_out_names_that_exist():
    import workbench

    for name in workbench.__all__:
        assert getattr(workbench, name) is not None


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
    """By arms, fits, readers, and the page before its first picture; each of these takes up to a second."""
    heavy = (
        "scipy.interpolate",
        "scipy.signal",
        "scipy.stats",
        "matplotlib",
        "pandas",
        "trimesh",
        "rerun",
        "joblib",
    )
    steps = (
        "import workbench as wb; wb.load_robot('aria'); wb.identify; wb.diagnose",
        "print('coal' in sys.modules)",
        "import workbench.data.readers, workbench.views.page.app, workbench.views.recording.recorder",
        "from workbench.views.page.panels import PANELS; list(PANELS.values())",
        "import workbench.identification.report.table",
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


IMPORTED_AS = {
    "coal": "pin",
    "pinocchio": "pin",
    "PIL": "pillow",
    "rerun": "rerun-sdk",
    "tomli_w": "tomli-w",
    "cv2": "opencv-python-headless",
    "OCP": "cadquery-ocp-novtk",
}
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
    assert undeclared == {("cli/studies.py", "studies")}  # the checkout's own folder


def test_modules_named_in_texts_exist():
    """In docstrings, in READMEs, and in scripts that tests hand to another Python."""
    top = ROOT.parent
    texts = [
        p
        for folder in ("workbench", "tests")
        for p in (top / folder).rglob("*")
        if p.suffix in (".py", ".md")
    ]
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


def test_functions_named_by_strings_exist():
    """`module:name`, by which a record calls what imports it."""
    texts = (path.read_text(encoding="utf-8") for path in FILES)
    named = {found for text in texts for found in re.findall(r'"(workbench(?:\.\w+)+):(\w+)"', text)}
    assert len(named) > 10
    wrong = [
        (home, name)
        for home, name in named
        if not re.search(rf"^(def |class )?{name}\b", MODULES[home].read_text(encoding="utf-8"), re.M)
    ]
    assert not wrong


def test_annotations_are_not_postponed():
    assert not [label(p) for p in FILES for name, _ in imports(p) if name.startswith("__future__")]


def test_files_are_short():
    lengths = {label(p): len(p.read_text(encoding="utf-8").splitlines()) for p in FILES}
    assert not {name: n for name, n in lengths.items() if n > LONGEST}


def test_names_of_the_root_are_explained():
    """Modules and classes are by ruff."""
    import workbench

    parts = {name: getattr(workbench, name) for name in workbench.__all__}
    assert not [name for name, part in parts.items() if callable(part) and not part.__doc__]


def decorator(node: ast.ClassDef) -> ast.expr | None:
    """The dataclass decorator of a class."""
    return next((d for d in node.decorator_list if ast.unparse(d).split("(")[0] == "dataclass"), None)


def test_records_are_frozen():
    loose = []
    for path, node in classes().values():
        if (found := decorator(node)) is not None:
            options = found.keywords if isinstance(found, ast.Call) else []
            if not any(o.arg == "frozen" and ast.unparse(o.value) == "True" for o in options):
                loose.append(f"{label(path)}: {node.name}")
    assert not loose


@cache
def classes() -> dict[str, tuple[Path, ast.ClassDef]]:
    found = {}
    for path in FILES:
        for node in nodes(path):
            if isinstance(node, ast.ClassDef):
                found[f"{module(path)}.{node.name}"] = (path, node)
    return found


def bases(path: Path, node: ast.ClassDef) -> list[str]:
    """Dotted names of a class's bases within the package."""
    known = {name.split(".")[-1]: name for name, _ in imports(path)}
    found = []
    for base in node.bases:
        word = ast.unparse(base).split("[")[0].split(".")[-1]
        for name in (f"{module(path)}.{word}", known.get(word, "")):
            name = resolve(name)
            if name in classes():
                found.append(name)
                break
    return found


def resolve(name: str) -> str:
    """Follow a name through the packages that hand it on."""
    for _ in range(5):
        home, _, word = name.rpartition(".")
        if name in classes() or home not in MODULES:
            return name
        name = next((n for n, _ in imports(MODULES[home]) if n.split(".")[-1] == word), name)
    return name


def is_abstract(node: ast.ClassDef) -> bool:
    """Abstract by name, or a protocol, which has nothing but abstract members."""
    protocol = any(ast.unparse(b).split(".")[-1].startswith("Protocol") for b in node.bases)
    return protocol or node.name.removeprefix("_").startswith("Abstract")


def methods(node: ast.ClassDef) -> dict[str, bool]:
    """Methods of a class, and whether each is abstract."""
    found = {}
    for item in node.body:
        if isinstance(item, ast.FunctionDef | ast.AsyncFunctionDef):
            marks = [ast.unparse(d).split(".")[-1] for d in item.decorator_list]
            found[item.name] = "abstractmethod" in marks
    return found


def ancestors(name: str) -> list[str]:
    found = []
    for base in bases(*classes()[name]):
        found += [base, *ancestors(base)]
    return found


def test_classes_are_abstract_or_final():
    wrong = []
    for name, (path, node) in classes().items():
        for base in bases(path, node):
            if base != "workbench.base.errors.WorkbenchError" and not is_abstract(classes()[base][1]):
                wrong.append(f"{name} inherits from {base}, which is concrete")
        if any(methods(node).values()) and not is_abstract(node):
            wrong.append(f"{name} has abstract methods but not the name")
    assert not wrong


def is_neutral(method: ast.FunctionDef) -> bool:
    """Whether an implementation says nothing: no more than a docstring, or one return of an empty value."""
    body = method.body[isinstance(method.body[0], ast.Expr) :]
    value = body[0].value if len(body) == 1 and isinstance(body[0], ast.Return) else None
    return not body or getattr(value, "attr", ast.unparse(value or method)) in NOTHING


def overridden(name: str) -> list[str]:
    """What a class defines again that a class above it implements, other than special methods."""
    own = {getattr(item, "name", "") for item in classes()[name][1].body} | {
        target.id
        for item in classes()[name][1].body
        if isinstance(item, ast.Assign | ast.AnnAssign)
        for target in (item.targets if isinstance(item, ast.Assign) else [item.target])
        if isinstance(target, ast.Name)
    }
    return [
        f"{name}.{method.name} overrides {base}"
        for base in ancestors(name)
        for method in classes()[base][1].body
        if isinstance(method, ast.FunctionDef)
        and method.name in own
        and not method.name.startswith("__")
        and not methods(classes()[base][1])[method.name]
        and not is_neutral(method)
    ]


def test_nothing_implemented_is_overridden():
    """A method that says nothing, such as `return None`, is a hook; one that computes is final."""
    assert not [text for name in classes() for text in overridden(name)]


def test_one_class_name_is_one_class():
    names = Counter(name.rpartition(".")[2] for name in classes())
    assert not [name for name, count in names.items() if count > 1]


def test_the_rules_are_seen():
    """The checks above find what they look for."""
    assert "workbench.arm.effects.law.AbstractLaw" in ancestors("workbench.arm.effects.backlash.Backlash")
    assert any(n.startswith("workbench.arm.urdf.") for n, _ in imports(ROOT / "arm" / "built_in_arms.py"))


def test_errors_have_one_base():
    for name, (path, node) in classes().items():
        if path == ROOT / "base" / "errors.py" and node.name != "WorkbenchError":
            assert bases(path, node) == ["workbench.base.errors.WorkbenchError"], name


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
