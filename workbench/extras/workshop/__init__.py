"""What a workshop makes a plate from: solids, a drawing, the list of targets; a plate as measured."""

from workbench.parts import Parts

PARTS = Parts(
    commands={
        "plate as-measured": "workbench.extras.workshop.commands:as_measured",
        "plate export": "workbench.extras.workshop.commands:export",
    },
    plate_exports=(
        "workbench.extras.workshop.outputs:CSV",
        "workbench.extras.workshop.outputs:DXF",
        "workbench.extras.workshop.outputs:PDF",
        "workbench.extras.workshop.outputs:STEP",
        "workbench.extras.workshop.outputs:STL",
    ),
)
