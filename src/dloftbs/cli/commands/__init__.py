"""The commands of ``dloftbs``, a file each."""
