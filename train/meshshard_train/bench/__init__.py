"""Speed of training, measured: `meshshard bench-train`."""
