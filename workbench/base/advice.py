"""What is computed beside a result (poses to measure next, alternatives): if it fails, the result stays.

A warning then says what is missing; nothing that rests on it is called certain.
"""

import traceback
from collections.abc import Callable
from typing import TypeVar

from workbench.base.errors import WorkbenchError
from workbench.base.progress import Cancelled

T = TypeVar("T")
U = TypeVar("U")


class Advice:
    """Asks advisers, and keeps a sentence about each that failed in `warnings`."""

    def __init__(self) -> None:
        self.warnings: list[str] = []

    def ask(self, what: str, adviser: Callable[[], T], otherwise: U) -> T | U:
        """What an adviser says; `otherwise` where it fails.

        Args:
            what: What it advises, as the subject of a sentence.
            adviser: Computes it.
            otherwise: What stands in its place.
        """
        try:
            return adviser()
        except (Cancelled, Warning):  # a request to stop; and Python's own, where they were made errors
            raise
        except WorkbenchError as error:  # what the user gave
            self.warnings.append(f"{what} could not be computed: {error}; the result omits it")
            return otherwise
        except Exception as error:
            last = traceback.extract_tb(error.__traceback__)[-1]
            why = f"{type(error).__name__} in {last.name}, line {last.lineno}: {error}"
            self.warnings.append(f"{what} could not be computed ({why}); the result omits it")
            return otherwise
