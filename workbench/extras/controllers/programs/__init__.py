"""Generated programs that compute with the whole calibrated model, effects included."""
