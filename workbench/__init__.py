"""Kinematic calibration of serial robot arms.

    import workbench as wb

    arm = wb.load_robot("ur10")
    data = wb.read_measurements("ur10.csv")
    fit = wb.identify(arm, data, held_out=0.2)
    fit.robot.save("calibrated.toml")

Names are imported when they are first used, so that importing the package costs nothing. Which there are and
where they live stands in `__init__.pyi`, which type checkers and editors read as well; those of extras and of
other packages stand in their records of parts.
"""

from collections.abc import Callable
from functools import cache
from importlib import import_module


@cache
def _homes() -> dict[str, str]:
    """The module of each name of the root."""
    import ast
    from pathlib import Path

    body = ast.parse(Path(__file__).with_suffix(".pyi").read_bytes()).body
    imports = [node for node in body if isinstance(node, ast.ImportFrom)]
    found = {a.name: str(node.module) for node in imports for a in node.names}
    return {name: home for name, home in found.items() if not home.startswith("workbench.extras.")}


def _offered() -> dict:
    """Names that extras and other packages add to the root, with their parts and where these come from."""
    from workbench.parts import offered

    return {name: (part, origin) for name, part, origin in reversed([*offered("root")])}


def _loaded(name: str, part, origin: str):
    """The verb or class of a record; another package's that is broken raises what names it."""
    from workbench.parts import resolved

    try:
        if not callable(found := resolved(part)):
            raise TypeError("a name of the root is a function or a class")
    except Exception as error:  # whatever is wrong with somebody else's package
        message = f"'{name}' of {origin} can't be used: {type(error).__name__}: {error}"
        raise AttributeError(message) from error
    return found


@cache
def _checked(verb: Callable) -> Callable:
    """A verb that the package itself calls as it is, with its arguments checked or read."""
    from workbench.base.arguments import checked_arguments

    return checked_arguments()(verb)


def __getattr__(name: str):
    if name == "__all__":
        return __dir__()
    if name == "__version__":
        return import_module("workbench.base.installed_package").package_version()
    if name in _homes():
        part = getattr(import_module(_homes()[name]), name)
    elif name.startswith("_") or name not in (offered := _offered()):
        raise AttributeError(f"module 'workbench' has no attribute '{name}'")
    else:
        part = _loaded(name, *offered[name])
    return part if isinstance(part, type) or hasattr(part, "__signature__") else _checked(part)


def __dir__() -> list[str]:
    return sorted({*_homes(), *_offered()})
