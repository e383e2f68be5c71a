"""Objects on plots and beside roads: ways, enclosures, trees, furniture, lights."""
