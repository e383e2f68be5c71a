"""The OpenDRIVE file as XML: parsing, includes, findings, the repaired file."""
