"""From plots and environment profile to a semantic city model."""
