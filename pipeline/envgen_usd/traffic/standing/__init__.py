"""Where vehicles park and people stand along the streets of a map."""
