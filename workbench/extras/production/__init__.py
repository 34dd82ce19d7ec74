"""Many arms on one plate: its yield, and plates of several sizes and ways to make them, compared."""

from workbench.parts import Parts

PARTS = Parts(
    commands={
        "plate tradeoff": "workbench.extras.production.commands:tradeoff",
        "plate yield": "workbench.extras.production.commands:yield_",
    },
    root={"try_plate": "workbench.extras.production.plate_trial:try_plate"},
    session_commands=(
        "workbench.extras.production.session:OpenChoice",
        "workbench.extras.production.session:TryPlate",
        "workbench.extras.production.session:WeighPlates",
    ),
    cube_fields=("workbench.extras.production.cube_field:VirtualArmErrorField",),
    panels=(
        "workbench.extras.production.panel:TradeoffPanel",
        "workbench.extras.production.panel:YieldPanel",
    ),
)
