"""What is read of masks that are probabilities: the fit of what lies ahead of an end, and the results."""
