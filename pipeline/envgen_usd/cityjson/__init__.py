"""The semantic city as CityJSON 2.0, written and read."""
