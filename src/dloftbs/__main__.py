"""``python -m dloftbs``: the command, where it is not on the path."""

from dloftbs.cli import main

main()
