"""The user's own robot: interpreting a table or description so that it reproduces the pendant's poses."""
