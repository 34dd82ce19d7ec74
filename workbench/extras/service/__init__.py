"""Calibrated arms later on: verified on fresh poses, rezeroed after a collision."""

from workbench.parts import Parts

PARTS = Parts(
    commands={
        "rezero": "workbench.extras.service.commands:rezero",
        "verify": "workbench.extras.service.commands:verify",
    },
    root={
        "Verification": "workbench.extras.service.verification:Verification",
        "rezero": "workbench.extras.service.rezero.moved_joints:rezero",
        "verify": "workbench.extras.service.verification:verify",
    },
)
