"""What people read is asserted by its names and numbers, errors by class and attributes, never by wording."""

import re
from typing import Any

import pytest


def mentions(text: str, *facts: object) -> bool:
    """Whether a text has all these names, numbers, files, each as a whole."""
    return all(re.search(rf"(?<!\w){re.escape(str(fact))}(?!\w)", text) for fact in facts)


def refuses(kind: type[Exception], *facts: object, **attributes: Any) -> Any:
    """`pytest.raises` of exactly this class with these attributes.

    Args:
        facts: What its sentence must mention.
        attributes: Of the error, and their values.
    """

    def is_meant(error: Exception) -> bool:
        found = {name: getattr(error, name, None) for name in attributes}
        lacking = [fact for fact in facts if not mentions(str(error), fact)]
        assert (type(error), found, lacking) == (kind, attributes, []), f"{error}"
        return True

    return pytest.raises(kind, check=is_meant)
