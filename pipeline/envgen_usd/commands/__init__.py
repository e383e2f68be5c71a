"""The commands of `envgen-usd`: they parse arguments, call the recipes and print results."""
