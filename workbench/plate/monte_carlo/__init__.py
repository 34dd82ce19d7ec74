"""A plate used on every arm of a production, tried on thousands of virtual arms."""
