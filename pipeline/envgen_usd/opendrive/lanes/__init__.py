"""Course and links of lanes: centre lines, links, lane changes, junctions."""
