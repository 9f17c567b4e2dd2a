"""The stages of the pipeline: one file each, pure functions of their input and their section of the configuration."""
