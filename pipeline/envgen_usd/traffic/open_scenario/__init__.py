"""OpenSCENARIO XML 1.0 to 1.3 ─► `Trace`: entities, storyboard, triggers and actions."""
