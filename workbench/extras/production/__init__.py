"""Many virtual arms on one plate: its yield."""

from workbench.parts import Parts

PARTS = Parts(
    commands={"plate yield": "workbench.extras.production.commands:yield_"},
    root={"try_plate": "workbench.extras.production.plate_trial:try_plate"},
    session_commands=("workbench.extras.production.session:TryPlate",),
    panels=("workbench.extras.production.panel:YieldPanel",),
)
