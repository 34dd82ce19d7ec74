"""The session as a recording for the rerun viewer, and everything that is made of recordings.

A recorder follows the session beside the journal and draws it; the journal stays the truth, from which the
pictures can be drawn again. What is drawn where is said in `entities/`, one file per kind of thing; how the
viewer is laid out in `blueprint.py`. Only the modules that draw import rerun, which is an extra.
"""

from importlib.util import find_spec

from workbench.base.errors import MissingExtraError


def has_rerun() -> bool:
    """Whether pictures can be drawn."""
    return find_spec("rerun") is not None


def need_rerun(what: str) -> None:
    """Refuse what can't be done without rerun.

    Raises:
        MissingExtraError: it is not installed.
    """
    if not has_rerun():
        raise MissingExtraError(what, extra="rerun")
