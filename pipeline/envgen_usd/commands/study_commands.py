"""The commands `envgen-usd study ...`: what synthetic images are worth beside real ones."""

import typer

from envgen_usd.commands.study_compare_commands import diagnose, realism
from envgen_usd.commands.study_mix_command import mix

app = typer.Typer(
    name="study",
    help="Studies: how many real images synthetic ones replace, and what keeps them from it.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
for command in (mix, realism, diagnose):
    app.command()(command)
