"""Helpers that are compiled into the kernels that call them; a change here compiles all kernels again."""
