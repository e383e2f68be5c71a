"""Traffic signs: their faces as data, their drawings, and which signal has which face."""
