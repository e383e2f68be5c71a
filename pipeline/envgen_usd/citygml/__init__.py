"""The semantic city as CityGML, written and read."""
