"""Operators: observation in, intent out; scripted ones with a human-like hand."""
