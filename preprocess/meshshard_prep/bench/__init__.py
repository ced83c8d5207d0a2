"""Speed and exactness of the preparation beside the published way, measured in one run. `make bench`."""
