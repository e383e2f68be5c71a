"""Light of the sun and the sky: position, daylight, clouds, weathers."""
