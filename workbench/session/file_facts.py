"""What was understood of a measurement file, as headings and short values for the panel."""

from workbench.data.dataset import Dataset
from workbench.data.readers.preview import Preview

OBSERVATIONS = (
    ("position", "rotation", "full pose of the tool"),
    ("position", None, "position of the tool"),
    ("markers", None, "markers on the tool"),
    ("distance", None, "distance to an anchor"),
    ("contact", None, "contact with a fixed point"),
    ("rotation", None, "orientation of the tool"),
    ("tilt", None, "tilt of links"),
)
LONGEST = 12
"""Columns that are listed one by one."""


def facts_of(dataset: Dataset, understood: Preview) -> tuple[tuple[str, str], ...]:
    """Pairs of a heading and what was understood."""
    kept_out = int((~dataset.included).sum())
    facts = [
        ("Rows", f"{len(dataset)}" + (f", of which {kept_out} are kept out" if kept_out else "")),
        ("Joints", f"{dataset.joints}"),
        ("Measured", observed(dataset)),
        ("Columns", _columns(understood)),
    ]
    if len(dataset.sessions) > 1:
        facts.append(("Sessions", ", ".join(dataset.sessions)))
    if understood.groups > 1:
        facts.append(("Groups", f"{understood.groups}, held out whole"))
    if understood.layout != "plain":
        facts.append(("Layout", understood.layout))
    return tuple(facts)


def observed(dataset: Dataset) -> str:
    """What the instrument saw, in words."""
    found: list[str] = []
    seen: set[str] = set()
    for first, second, words in OBSERVATIONS:
        has = getattr(dataset, first) is not None and first not in seen
        if has and (second is None or getattr(dataset, second) is not None):
            found.append(words)
            seen |= {first, second or first}
    return ", ".join(found) or "nothing"


def _columns(understood: Preview) -> str:
    read = [c for c in understood.columns if c.key is not None]
    ignored = [c.heading for c in understood.columns if c.key is None]
    words = ", ".join(c.heading for c in read[:LONGEST]) + (" …" if len(read) > LONGEST else "")
    return words + (f" (ignored: {', '.join(ignored[:LONGEST])})" if ignored else "")
