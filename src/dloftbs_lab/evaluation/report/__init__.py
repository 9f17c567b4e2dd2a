"""Tables, plots and pictures of what was scored."""
