"""The commands `envgen-usd landuse ...`: ground truth, training, evaluation, sampling."""

import typer

from envgen_usd.commands.landuse_eval_command import evaluate
from envgen_usd.commands.landuse_from_osm_command import from_osm
from envgen_usd.commands.landuse_places_command import places
from envgen_usd.commands.landuse_rules_command import rules
from envgen_usd.commands.landuse_sample_command import sample
from envgen_usd.commands.landuse_train_command import train

app = typer.Typer(
    name="landuse",
    help="Landuse: ground truth by rules, and networks trained on it.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
for command in (places, rules, sample, train):
    app.command()(command)
app.command(name="eval")(evaluate)
app.command(name="from-osm")(from_osm)
