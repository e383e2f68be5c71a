"""Objects and signals of a road as features of the city."""
