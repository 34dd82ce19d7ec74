"""Diagnosis: what a fit leaves is traced to an effect that the model lacks."""
