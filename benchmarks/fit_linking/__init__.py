"""The weights of the joints between branch ends, fitted to labelled scenes of several sources."""
