"""The distribution that this package is installed from: its version, and the command that installs an extra.

The distribution has a longer name than the package, since another project's is called `workbench`: installing
that name from a package index fetches the other project. Every text therefore names the checkout.
"""

NAME = "arm-calibration-workbench"


def install_command(extra: str = "") -> str:
    """What to type in a checkout of the project, with an extra or without."""
    checkout = f"'.[{extra}]'" if extra else "."
    return f"pip install -e {checkout}"


def package_version() -> str:
    """The installed version; "unknown" where the package is run from its source without being installed."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(NAME)
    except PackageNotFoundError:
        return "unknown"
