"""What an arm's geometry and its circles show without a fit: redundant constants, axes of its joints."""

from workbench.parts import Parts

PARTS = Parts(
    commands={
        "axes": "workbench.extras.geometry.commands:axes",
        "redundancy": "workbench.extras.geometry.commands:redundancy",
    }
)
