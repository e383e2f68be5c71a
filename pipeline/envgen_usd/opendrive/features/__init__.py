"""Objects and signals beside roads, as features in the road frame."""
