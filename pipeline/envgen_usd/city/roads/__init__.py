"""Roads in CityGML: sections, intersections, traffic spaces, markings, constructions."""
