"""Informative poses: chosen by an observability index within limits."""
