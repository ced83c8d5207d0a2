"""The training half of meshshard: feature shards in, trained networks and their results out."""
