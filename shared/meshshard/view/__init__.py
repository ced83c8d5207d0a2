"""`meshshard view`: the meshes of a data set in a browser, coloured by what shards and networks say of them."""
