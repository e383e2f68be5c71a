"""Real places: what is read of them, what is measured on them, and environments fitted to them."""
