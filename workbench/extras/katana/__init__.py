"""What the Katana thesis did with little equipment: a load test with inclinometers, pencil and paper."""
