"""Calibrated arms over the years: calibrations over time and fleets."""

from workbench.parts import Parts

PARTS = Parts(
    commands={
        "fleet": "workbench.extras.service.commands:fleet",
        "rezero": "workbench.extras.service.commands:rezero",
        "verify": "workbench.extras.service.commands:verify",
    },
    root={
        "Fleet": "workbench.extras.service.fleet.result:Fleet",
        "Verification": "workbench.extras.service.verification.result:Verification",
        "compare_fleet": "workbench.extras.service.fleet.fleet:compare_fleet",
        "rezero": "workbench.extras.service.rezero.moved_joints:rezero",
        "verify": "workbench.extras.service.verification.verify:verify",
    },
    session_commands=("workbench.extras.service.rezero.session:FindZeros",),
    journal_numbers=("workbench.extras.service.rezero.session:NUMBERS",),
    panels=("workbench.extras.service.rezero.panel:RezeroPanel",),
)
