"""Kernels that several rooms call, and how all kernels are compiled."""
