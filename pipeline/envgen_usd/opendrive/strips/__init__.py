"""Strips between two borders: lanes, road marks, paint, islands, junction corners."""
