"""Extras: each folder comes in through entry points of `pyproject.toml`, as anybody's package would."""
