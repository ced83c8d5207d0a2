"""Looks at a folder that nobody described, says what it holds, and writes the TOML file that describes it."""
