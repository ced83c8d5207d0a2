"""Raw files of known data sets from their published addresses, checked, into data/raw."""
