"""Buildings: their design, closed shells, roofs, facades, and levels of detail."""
