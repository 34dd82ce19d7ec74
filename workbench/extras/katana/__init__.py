"""What the Katana thesis did with little equipment: a load test with inclinometers, pencil and paper."""

from workbench.parts import Parts

PARTS = Parts(commands={"loading": "workbench.extras.katana.commands:loading"})
