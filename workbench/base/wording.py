"""Lists and numbers in sentences."""

from collections.abc import Sequence


def span(names: Sequence[str], *, longest: int = 4) -> str:
    """'q1, q2, x', or 'q1 … q6' when there are many."""
    if len(names) <= longest:
        return ", ".join(names)
    return f"{names[0]} … {names[-1]}"


def listed(names: Sequence[str], *, longest: int = 8) -> str:
    """The first few names, quoted, and how many more there are."""
    shown = ", ".join(f"'{name}'" for name in names[:longest])
    return shown + (f" and {len(names) - longest} more" if len(names) > longest else "")


def counted(number: int, noun: str) -> str:
    """'1 row', '3 rows'."""
    return f"{number} {noun}" + ("" if number == 1 else "s")
