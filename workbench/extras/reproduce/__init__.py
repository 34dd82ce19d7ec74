"""The works behind this program done again, from a checkout."""

from workbench.parts import Parts

PARTS = Parts(commands={"reproduce": "workbench.extras.reproduce.commands:works"})
