"""How fast the package is; run by hand, and briefly in continuous integration."""
