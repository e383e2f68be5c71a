"""Environments that slow tests repeat themselves for.

Each shipped environment would add seconds to every test that lays out land or builds a city. So
these take Table A1 of the article, whose environments differ in all rules, and add others by hand
where an environment's figures reach a rule that those of the table do not. All environments are
in `test_plots.py` (bends), `test_judged_buildings.py` (solids) and `test_hand_written_areas.py`.
"""

Environment = tuple[str, str]
"""Country and area type."""

TABLE_A1: tuple[Environment, ...] = (
    ("1", "industrial"),
    ("1", "residential"),
    ("2", "industrial"),
    ("2", "residential"),
)
