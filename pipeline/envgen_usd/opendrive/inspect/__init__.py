"""Content of an OpenDRIVE file as tables and as a map."""
