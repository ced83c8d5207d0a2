"""A run, or several that differ by their seed, as one HTML file: figures, curves, meshes, data, settings, hashes."""
