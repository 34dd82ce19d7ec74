"""Files of drivers, controllers and simulators, and generated programs."""
