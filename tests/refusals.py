"""Errors are asserted by class, attributes, and the names and numbers in them, never by their wording."""

import re
from typing import Any

import pytest


def refuses(kind: type[Exception], *facts: object, **attributes: Any) -> Any:
    """`pytest.raises` of exactly this class with these attributes.

    Args:
        facts: Names, numbers, files that its sentence must contain, each as a whole.
        attributes: Of the error, and their values.
    """

    def is_meant(error: Exception) -> bool:
        found = {name: getattr(error, name, None) for name in attributes}
        lacking = [f for f in map(str, facts) if not re.search(rf"(?<!\w){re.escape(f)}(?!\w)", str(error))]
        assert (type(error), found, lacking) == (kind, attributes, []), f"{error}"
        return True

    return pytest.raises(kind, check=is_meant)
