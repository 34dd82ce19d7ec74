"""What an arm's geometry and its circles show without a fit: redundant constants, axes of its joints."""
