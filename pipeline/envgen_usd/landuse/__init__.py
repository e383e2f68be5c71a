"""From road surface and environment profile to landuse maps and plots."""
