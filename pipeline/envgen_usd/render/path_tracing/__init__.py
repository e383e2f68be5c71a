"""Path-traced images of the same scene with Mitsuba 3."""
