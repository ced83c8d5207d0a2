"""Pure functions of a triangle mesh, one file each. Sizes: V vertices, F faces, E edges, T times."""
