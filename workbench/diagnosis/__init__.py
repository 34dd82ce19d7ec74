"""Diagnosis: trace the residual error of a fit to effects that the model lacks."""
