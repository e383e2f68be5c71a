"""Traces of other programs: SUMO, esmini, ASAM OSI."""
