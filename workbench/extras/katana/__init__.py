"""What the Katana thesis did with little equipment: a load test with inclinometers, pencil and paper."""

from workbench.parts import Parts

PARTS = Parts(root={"run_load_test": "workbench.extras.katana.load_test.experiment:run_load_test"})
