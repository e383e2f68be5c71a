"""Road surface to height maps and to a ground mesh stitched to the road."""
