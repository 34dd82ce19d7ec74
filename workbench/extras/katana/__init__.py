"""What the Katana theses did with little equipment: a load test with inclinometers, pencil and paper."""
