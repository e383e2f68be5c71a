"""From strips to a watertight surface: arrangement, overlaps, heights, kerbs, bridges, tunnels."""
