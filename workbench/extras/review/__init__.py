"""Recordings looked at again: in the rerun viewer, two compared, replayed with all numbers, as a report."""

from workbench.parts import Parts

PARTS = Parts(
    commands={
        "replay": "workbench.extras.review.commands:replay",
        "review": "workbench.extras.review.commands:review",
    }
)
