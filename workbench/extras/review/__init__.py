"""Recordings looked at again: in the rerun viewer, or replayed with all numbers."""

from workbench.parts import Parts

PARTS = Parts(
    commands={
        "replay": "workbench.extras.review.commands:replay",
        "review": "workbench.extras.review.commands:review",
    }
)
