"""Tables and figures of the two works, made again on virtual arms beside their printed numbers."""
