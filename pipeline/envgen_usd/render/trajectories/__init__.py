"""Poses of the frames: along routes, spread over lanes, from files, with jitter."""
