"""The controller as an instrument: its hidden model, tool tips and user frames by its pendant."""
