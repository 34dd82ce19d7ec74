"""What an error follows, before any law: smooth processes over each driver, as rivals of every law."""
