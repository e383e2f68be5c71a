"""The commands `envgen-usd library ...`: a library for an author, its assets, their checks."""

import typer

from envgen_usd.commands.library_check_command import check
from envgen_usd.commands.library_import_command import import_file
from envgen_usd.commands.library_learn_command import learn
from envgen_usd.commands.library_new_command import new
from envgen_usd.commands.library_preview_command import preview
from envgen_usd.commands.library_show_command import show
from envgen_usd.commands.library_variant_command import new_variant

app = typer.Typer(
    name="library",
    help="The asset library: new assets and variants, checks, figures, contact sheets.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
for command in (new, new_variant, check, show, preview, learn):
    app.command()(command)
app.command(name="import")(import_file)
