"""Production: a plate used on every arm that leaves the shop, tried out on thousands of virtual arms."""
